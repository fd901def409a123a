//! A game of chance whose mean is the blend "over".

use crate::{PARALLEL, drawn, looking, numbers, plain, rms, telling, with};
use glam::DVec3;
use slicestack::scene::{Algorithm, Straight};
use slicestack::{Renderer, Scene, Settings, Volume};

fn scene(volume: &Volume) -> Scene {
    let back = Straight { rgb: [0.2, 0.5, 0.9], alpha: 0.5 };
    let scene = plain(telling(), 32, 24).with_camera(looking(DVec3::new(20.0, 12.0, 9.0), volume, PARALLEL));
    scene.with_background(back).unwrap()
}

fn games(games: u32, seed: u32) -> Algorithm {
    Algorithm::CoinFlips { games, seed }
}

#[test]
fn the_mean_over_games_leads_to_over_as_their_root() {
    let volume = numbers([8, 9, 10]);
    let scene = scene(&volume);
    let over = drawn(&volume, &with(&scene, Algorithm::Rays));
    let errors = [16, 64, 256, 1024].map(|n| rms(&drawn(&volume, &with(&scene, games(n, 3))), &over));
    let slopes = [0, 1, 2].map(|i| (errors[i] / errors[i + 1]).log2() / 2.0);
    println!("errors {errors:?}: falling as the games to the power {slopes:?}");
    assert!(slopes.iter().all(|s| (0.42..0.58).contains(s)), "{errors:?}: {slopes:?}");
    assert!((0.45..0.55).contains(&((errors[0] / errors[3]).log2() / 6.0)), "{errors:?}");
}

#[test]
fn no_game_has_a_bias() {
    let volume = numbers([8, 9, 10]);
    let scene = scene(&volume);
    let over = drawn(&volume, &with(&scene, Algorithm::Rays));
    // 64 pictures of 64 games with seeds of their own: their mean is off by a 64th of the root of 4096 games' variance.
    let mut mean = vec![[0.0f64; 4]; over.len()];
    for seed in 0..64 {
        for (sum, pixel) in mean.iter_mut().zip(drawn(&volume, &with(&scene, games(64, seed)))) {
            (0..4).for_each(|c| sum[c] += f64::from(pixel[c]) / 64.0);
        }
    }
    let shift = |c: usize| mean.iter().zip(&over).map(|(a, b)| a[c] - f64::from(b[c])).sum::<f64>() / over.len() as f64;
    let (all, one) = (rms(&over, &mean), rms(&drawn(&volume, &with(&scene, games(64, 0))), &over));
    println!("mean of 64 pictures: rms {all:.1e}, of one {one:.1e}; shifts {:?}", [0, 1, 2, 3].map(shift));
    assert!(all < one / 6.0, "{all} for {one}");
    assert!((0..4).all(|c| shift(c).abs() < 5.0 * one / (64.0 * over.len() as f64).sqrt()));
}

#[test]
fn opacity_is_the_share_of_games_that_ended() {
    let volume = numbers([8, 9, 10]);
    let scene = scene(&volume).with_background(Straight::default()).unwrap();
    let pixels = drawn(&volume, &with(&scene, games(50, 9)));
    assert!(pixels.iter().all(|p| (f64::from(p[3]) * 50.0 - (f64::from(p[3]) * 50.0).round()).abs() < 1e-5));
    assert!(pixels.iter().any(|p| p[3] > 0.3 && p[3] < 0.9));
}

#[test]
fn neither_threads_nor_levels_change_a_flip_and_the_seed_does() {
    let volume = numbers([8, 9, 10]);
    let sha = |threads, seed| {
        let settings = Settings::new().threads(threads);
        Renderer::new(&volume, settings).render(&with(&scene(&volume), games(30, seed))).unwrap().0.sha256()
    };
    assert_eq!(sha(1, 5), sha(7, 5));
    assert_ne!(sha(1, 5), sha(1, 6));
}
