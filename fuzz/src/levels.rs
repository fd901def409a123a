//! Any scene of all keys: the same bytes for any vector level, number of threads and tile as the scalar path has alone.

use super::scenes;
use slicestack::{Level, Settings};

pub fn run(bytes: &[u8]) {
    let Some((volume, scene, mut draw)) = scenes::drawn(bytes) else { return };
    let Some(alone) = scenes::rendered(&volume, &scene, Settings::new().threads(1).level(Level::SCALAR)) else { return };
    let level = draw.one(&Level::available());
    let (threads, tile) = (1 + draw.below(3), draw.one(&[1_u32, 7, 8, 13, 64]));
    let other = scenes::rendered(&volume, &scene, Settings::new().threads(threads).tile(tile).level(level));
    let bits = |p: &slicestack::Picture| p.pixels().iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
    assert!(other.is_some_and(|other| bits(&other) == bits(&alone)), "{}, {threads} threads, tiles of {tile}", level.name());
}
