//! Whole frames: every vector level, every width of voxel, with and without something to leave out.
//!
//! `cargo bench --bench frames` prints seconds a frame; throughput counts the voxel lookups really done.
#![allow(missing_docs, reason = "the macro of criterion makes a public function")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use slicestack::lanes::Level;
use slicestack::scene::{Camera, Placement, Projection, Slicing, TransferFunction};
use slicestack::volume::VoxelType;
use slicestack::volume::phantom::Phantom;
use slicestack::{Limits, Renderer, Scene, Settings, Volume};
use std::hint::black_box;

const SIZE: usize = 128;

fn volume(kind: VoxelType) -> Volume {
    Phantom::MarschnerLobb.volume_as(SIZE, kind, &Limits::default()).expect("a phantom of moderate size")
}

fn scene() -> Scene {
    Scene::new(Phantom::MarschnerLobb.default_transfer())
        .with_opacity_unit(Phantom::opacity_unit(SIZE))
        .and_then(|s| s.with_size(256, 256))
        .and_then(|s| s.with_slices(Slicing::Count(256)))
        .expect("a valid scene")
}

/// A scene in which no slice is empty and no pixel is ever finished.
fn dense() -> Scene {
    let haze = TransferFunction::new(vec![(0.0, [1.0, 0.5, 0.2])], vec![(0.0, 0.001)]).expect("valid points");
    scene().with_transfer(haze).with_terminate(0.0).expect("0 is allowed")
}

fn perspective() -> Scene {
    let placement = Placement::Orbit { azimuth: 30.0, elevation: 20.0, roll: 0.0, zoom: 1.2 };
    scene().with_camera(Camera::new(placement, Projection::Perspective { fov_y: 40.0 }).expect("a valid camera"))
}

fn frames(c: &mut Criterion) {
    let run = |c: &mut Criterion, group: &str, name: &str, volume: &Volume, scene: &Scene, level: Level| {
        let settings = Settings { level: Some(level), threads: Some(1), ..Settings::default() };
        let mut renderer = Renderer::new(volume, settings);
        let (_, stats) = renderer.render(scene).expect("a valid scene");
        let mut group = c.benchmark_group(group);
        group.throughput(Throughput::Elements(stats.fetches.max(1))).sample_size(10);
        group.bench_function(BenchmarkId::new(name, level.name()), |b| b.iter(|| black_box(renderer.render(scene).expect("as before"))));
        group.finish();
    };
    for level in Level::available() {
        for kind in VoxelType::ALL {
            run(c, "dense", kind.name(), &volume(kind), &dense(), level);
        }
        let bytes = volume(VoxelType::U8);
        run(c, "scene", "marschner-lobb", &bytes, &scene(), level);
        run(c, "scene", "perspective", &bytes, &perspective(), level);
        let empty = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 0.0)]).expect("valid points");
        run(c, "scene", "nothing visible", &bytes, &scene().with_transfer(empty), level);
    }
}

criterion_group!(benches, frames);
criterion_main!(benches);
