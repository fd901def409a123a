//! Whole frames: every vector level, every type of voxel, every way to a picture, with and without something to leave out.
//!
//! `cargo bench --bench frames` prints seconds a frame on one thread; throughput counts the voxel lookups really done.
//! `cargo bench --bench frames -- scene/head` runs some.
#![allow(missing_docs, reason = "the macro of criterion makes a public function")]

mod scenes;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use scenes::{Share, block, classified, fog, haze, head, mist, perspective, shells, signal, skull};
use slicestack::scene::{Blend, Classification, FogDistance, Order, Slicing};
use slicestack::volume::VoxelType;
use slicestack::{Level, Renderer, Result, Scene, Settings, Volume};
use std::hint::black_box;

const SIZE: usize = 128;
const SIDE: u32 = 256;
const COUNT: u64 = 256;

fn bench(c: &mut Criterion, group: &str, name: &str, volume: &Volume, scene: &Scene, level: Level) -> Result<()> {
    let settings = Settings::new().level(level).threads(1);
    let mut renderer = Renderer::new(volume, settings);
    let (_, stats) = renderer.render(scene)?;
    let mut group = c.benchmark_group(group);
    group.throughput(Throughput::Elements(stats.fetches.max(1))).sample_size(10);
    group.bench_function(BenchmarkId::new(name, level.name()), |b| b.iter(|| black_box(renderer.render(scene))));
    group.finish();
    Ok(())
}

fn all(c: &mut Criterion) -> Result<()> {
    let bytes = signal(SIZE, VoxelType::U8)?;
    let shells = shells(SIZE, SIDE, COUNT)?;
    let (head, skull) = (head(SIZE)?, skull(SIDE, COUNT)?);
    let of_shells: Vec<(&str, Scene)> = vec![
        ("shells", shells.clone()),
        ("perspective", perspective(shells.clone())?),
        ("planar fog", fog(shells.clone(), FogDistance::Planar)?),
        ("radial fog", fog(shells.clone(), FogDistance::Radial)?),
        ("back to front", shells.clone().with_order(Order::BackToFront)),
        ("mip", shells.clone().with_blend(Blend::Mip)?),
        ("pre-classified", classified(shells, Classification::Pre)?),
    ];
    let of_head: Vec<(&str, Scene)> = vec![
        ("head", skull.clone()),
        ("head pre-integrated", classified(skull.clone(), Classification::PreIntegrated)?),
        ("head second order", classified(skull.clone(), Classification::SecondOrder)?),
        ("head to a tolerance of 0.002", skull.with_slices(Slicing::Tolerance(0.002))?),
    ];
    for level in Level::available() {
        for kind in VoxelType::ALL {
            bench(c, "dense", kind.name(), &signal(SIZE, kind)?, &mist(SIDE, COUNT)?, level)?;
        }
        for (name, share) in [("all", Share::All), ("half", Share::Half), ("nothing", Share::Nothing)] {
            bench(c, "visible", name, &block(SIZE, share)?, &haze(SIDE, COUNT)?, level)?;
        }
        for (name, scene) in &of_shells {
            bench(c, "scene", name, &bytes, scene, level)?;
        }
        for (name, scene) in &of_head {
            bench(c, "scene", name, &head, scene, level)?;
        }
    }
    Ok(())
}

fn frames(c: &mut Criterion) {
    all(c).expect("scenes that can be rendered");
}

criterion_group!(benches, frames);
criterion_main!(benches);
