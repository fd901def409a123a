//! Contestants that take turns, so that whatever else the machine does, it does to all of them.

use std::error::Error;

/// Times of one contestant.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Times {
    /// The shortest, seconds.
    pub(crate) least: f64,
    /// The middle one: far above the shortest on a busy machine.
    pub(crate) median: f64,
}

/// Someone who renders a frame and tells its seconds.
pub(crate) type Contestant<'a> = Box<dyn FnMut() -> Result<f64, Box<dyn Error>> + 'a>;

/// A round to warm up, then `rounds` rounds.
pub(crate) fn run(rounds: usize, contestants: &mut [Contestant<'_>]) -> Result<Vec<Times>, Box<dyn Error>> {
    let mut seconds = vec![Vec::new(); contestants.len()];
    for round in 0..=rounds {
        for (contestant, seconds) in contestants.iter_mut().zip(&mut seconds) {
            let taken = contestant()?;
            if round > 0 {
                seconds.push(taken);
            }
        }
    }
    let times = seconds.into_iter().map(|mut list: Vec<f64>| {
        list.sort_by(f64::total_cmp);
        Times { least: list[0], median: list[list.len() / 2] }
    });
    Ok(times.collect())
}
