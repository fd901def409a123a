//! A game of chance: a coin for each sample of a ray, which falls heads with the probability of the sample's opacity.
//!
//! A game flips the coins from the nearest sample on. The first that falls heads ends it, and pays the sample's straight colour; a game without heads pays
//! the background. A game is expected to pay the sum of C_k A_k (1 - A_1) ... (1 - A_(k-1)): what the blend "over" comes to. The mean over n
//! games differs from that by about 1 / sqrt(n).
//!
//! Flip k of a game is the upper half of the kth number of the generator SplitMix64 (Steele, Lea and Flood, 2014), which is a function of k: the finalizer of
//! seed + (k + 1) times 0x9E3779B97F4A7C15. The game's seed is the finalizer of (pixel's key + game), the pixel's key that of (pixel + finalizer of the
//! scene's seed); pixels are counted row by row. The coin falls heads where the flip, 0 to 2^32 - 1, lies below the opacity times 2^32.

use super::gather::{Take, shown};
use crate::fragment::Batch;

/// What SplitMix64 adds from number to number.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// The finalizer of SplitMix64.
fn mixed(x: u64) -> u64 {
    let x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

/// Flip `k` of the game with this seed.
fn flip(game: u64, k: usize) -> u32 {
    (mixed(game.wrapping_add(STEP.wrapping_mul(k as u64 + 1))) >> 32) as u32
}

/// The games of a picture.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coins {
    games: u32,
    key: u64,
}

impl Coins {
    pub(super) fn new(games: u32, seed: u32) -> Self {
        Self { games, key: mixed(u64::from(seed)) }
    }

    /// The games of pixel `pixel`, before their coins are known.
    pub(super) fn game(&self, pixel: u64) -> Game {
        Game { games: self.games, key: mixed(pixel.wrapping_add(self.key)), coins: Vec::new() }
    }
}

/// The games of a pixel.
pub(super) struct Game {
    games: u32,
    key: u64,
    /// For each sample that shows: flips below this are heads, and what heads pays.
    coins: Vec<(u64, [f64; 3])>,
}

impl Game {
    /// Mean payoff over black, and the share of games that pay the background.
    pub(super) fn played(&self) -> [f32; 4] {
        // Whole numbers, so that no order of games matters.
        let mut ended = vec![0u32; self.coins.len()];
        for n in 0..self.games {
            let game = mixed(self.key.wrapping_add(u64::from(n)));
            let heads = self.coins.iter().enumerate().position(|(k, coin)| u64::from(flip(game, k)) < coin.0);
            if let Some(k) = heads {
                ended[k] += 1;
            }
        }
        let mut paid = [0.0; 3];
        for (&count, (_, color)) in ended.iter().zip(&self.coins) {
            for (sum, c) in paid.iter_mut().zip(color) {
                *sum += f64::from(count) * c;
            }
        }
        let games = f64::from(self.games);
        let left = self.games - ended.iter().sum::<u32>();
        let [r, g, b] = paid.map(|c| (c / games) as f32);
        [r, g, b, (f64::from(left) / games) as f32]
    }
}

impl Take for Game {
    fn take(&mut self, batch: &Batch, count: usize) -> bool {
        for i in shown(batch, count) {
            let alpha = f64::from(batch.slab.alpha[i]);
            if alpha > 0.0 {
                let color = [0, 1, 2].map(|c: usize| f64::from(batch.slab.color[c][i]) / alpha);
                self.coins.push(((alpha * 4_294_967_296.0) as u64, color));
            }
            if alpha >= 1.0 {
                return false;
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flips_are_the_numbers_of_splitmix64() {
        // The first numbers of the generator from seed 1234567, from its authors' program.
        let known = [6457827717110365317u64, 3203168211198807973, 9817491932198370423, 4593380528125082431, 16408922859458223821];
        for (k, number) in known.into_iter().enumerate() {
            assert_eq!(flip(1_234_567, k), (number >> 32) as u32);
        }
    }

    #[test]
    fn coins_fall_heads_as_often_as_they_should() {
        for (alpha, color) in [(0.25, 1.0), (0.001, 0.5), (0.75, 0.1)] {
            let coins = Coins::new(100_000, 7);
            let mut game = coins.game(3);
            game.coins = vec![((alpha * 4_294_967_296.0) as u64, [color; 3])];
            let [r, .., left] = game.played();
            // Five standard deviations of so many games.
            let off = 5.0 * (alpha * (1.0 - alpha) / 1e5f64).sqrt();
            assert!((f64::from(left) - (1.0 - alpha)).abs() < off, "{alpha}: {left}");
            assert!((f64::from(r) - alpha * color).abs() < off * color, "{alpha}: {r}");
        }
    }
}
