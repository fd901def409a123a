//! Each stage alone: every vector level, every type of voxel, every way to classify and blend.
//!
//! `cargo bench --bench stages` prints fragments a second. A stage runs over batches of 64 fragments that were recorded while a frame
//! was rendered; the time it takes to bring them back before each run is measured too, and taken off.
//! `cargo bench --bench stages -- fetch/avx2` runs some.
#![allow(missing_docs, reason = "the macro of criterion makes a public function")]

mod scenes;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use scenes::{block, classified, fog, haze, mist, perspective, shells, signal, target};
use slicestack::bench::StageRun;
use slicestack::scene::{Blend, Classification, FogDistance, Order, Target};
use slicestack::volume::VoxelType;
use slicestack::{Level, Renderer, Result, Scene, Settings, Volume};
use std::collections::BTreeSet;
use std::time::{Duration, Instant};

const SIZE: usize = 128;
const SIDE: u32 = 256;
const COUNT: u64 = 256;

/// What `runs` passes take, without the copying. Both are timed in turn: whatever else the machine does, it does to both.
fn time(stage: &mut StageRun<'_>, runs: u64) -> Duration {
    let (mut with, mut without) = (Duration::ZERO, Duration::ZERO);
    for _ in 0..runs {
        let start = Instant::now();
        stage.run();
        let between = Instant::now();
        stage.copy();
        with += between - start;
        without += between.elapsed();
    }
    // Criterion wants some time to have passed, whatever the clock says.
    with.saturating_sub(without).max(Duration::from_nanos(runs))
}

/// Benches the stages of `scene` called `names`, all of them without names.
fn bench(c: &mut Criterion, name: &str, names: &[&str], volume: &Volume, scene: &Scene, level: Level) -> Result<()> {
    let mut renderer = Renderer::new(volume, Settings::new().level(level));
    for mut stage in slicestack::bench::stages(&mut renderer, scene)? {
        if !names.is_empty() && !names.contains(&stage.name()) {
            continue;
        }
        let mut group = c.benchmark_group(format!("{}/{}", stage.name(), level.name()));
        group.throughput(Throughput::Elements(stage.fragments()));
        group.sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_millis(600));
        group.bench_function(BenchmarkId::from_parameter(name), |b| b.iter_custom(|runs| time(&mut stage, runs)));
        group.finish();
    }
    Ok(())
}

/// The stages of `scene` that none of the `plain` scene's is called like.
fn new_stages(plain: &Scene, scene: &Scene, volume: &Volume) -> Result<Vec<&'static str>> {
    let list = |scene: &Scene| -> Result<BTreeSet<(&'static str, usize)>> {
        let mut renderer = Renderer::new(volume, Settings::new().level(Level::SCALAR));
        Ok(slicestack::bench::addresses(&mut renderer, scene)?.into_iter().collect())
    };
    Ok(list(scene)?.difference(&list(plain)?).map(|&(name, _)| name).collect())
}

fn all(c: &mut Criterion) -> Result<()> {
    let bytes = signal(SIZE, VoxelType::U8)?;
    let plain = mist(SIDE, COUNT)?;
    // What differs from the plain scene's stages is benched under the scene's name.
    let others: Vec<(&str, Scene)> = vec![
        ("perspective", perspective(shells(SIZE, SIDE, COUNT)?)?),
        ("planar-fog", fog(mist(SIDE, COUNT)?, FogDistance::Planar)?),
        ("radial-fog", fog(mist(SIDE, COUNT)?, FogDistance::Radial)?),
        ("back-to-front", mist(SIDE, COUNT)?.with_order(Order::BackToFront)),
        ("terminating", shells(SIZE, SIDE, COUNT)?),
        ("compensated", mist(SIDE, 2048)?),
        ("8-bit", target(mist(SIDE, COUNT)?, Target::Unorm8)?),
        ("pre-classified", classified(mist(SIDE, COUNT)?, Classification::Pre)?),
        ("pre-integrated", classified(mist(SIDE, COUNT)?, Classification::PreIntegrated)?),
        ("second-order", classified(mist(SIDE, COUNT)?, Classification::SecondOrder)?),
        ("add", mist(SIDE, COUNT)?.with_blend(Blend::Add)?),
        ("mip", mist(SIDE, COUNT)?.with_blend(Blend::Mip)?),
        ("min", mist(SIDE, COUNT)?.with_blend(Blend::Min)?),
        ("average", mist(SIDE, COUNT)?.with_blend(Blend::Average)?),
        ("lmip", mist(SIDE, COUNT)?.with_blend(Blend::Lmip { threshold: 0.5 })?),
        ("iso", mist(SIDE, COUNT)?.with_blend(Blend::Iso { level: 0.5 })?),
    ];
    for level in Level::available() {
        bench(c, "plain", &[], &bytes, &plain, level)?;
        for kind in VoxelType::ALL {
            bench(c, kind.name(), &["fetch"], &signal(SIZE, kind)?, &plain, level)?;
        }
        for (name, scene) in &others {
            bench(c, name, &new_stages(&plain, scene, &bytes)?, &bytes, scene, level)?;
        }
        // Rounding and clamps do not matter where nothing lies beyond the table.
        bench(c, "dense", &["classify"], &block(SIZE, scenes::Share::All)?, &haze(SIDE, COUNT)?, level)?;
    }
    Ok(())
}

fn stages(c: &mut Criterion) {
    all(c).expect("scenes that can be rendered");
}

criterion_group!(benches, stages);
criterion_main!(benches);
