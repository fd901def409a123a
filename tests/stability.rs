//! Every promise about extreme cases, asserted.
#![cfg(feature = "study")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use slicestack::study::stability;
use slicestack::{Error, Progress, Settings};
use std::sync::Arc;

#[test]
fn every_promise_holds() {
    let found = stability(&Settings::default()).unwrap();
    for row in found.broken() {
        println!("{}: {}; promised: {}; measured: {}", row.group, row.case, row.promise, row.measured);
    }
    assert_eq!(found.broken().count(), 0);
    // No kind of case is missing.
    let count = |group: &str| found.rows.iter().filter(|r| r.group == group).count();
    let least = [
        ("stiffness", 60),
        ("opacity", 6),
        ("jumps", 6),
        ("pieces of slabs", 28),
        ("many slices", 25),
        ("explicit Euler", 4),
        ("values", 19),
        ("spikes", 5),
        ("grids", 17),
        ("eyes", 20),
        ("views", 27),
        ("fogs", 18),
        ("lights", 40),
    ];
    for (group, least) in least {
        assert!(count(group) >= least, "{group}: {} rows", count(group));
    }
    // A million slices, whatever the opacity.
    for p in found.counts.iter().filter(|p| p.target == "f32" && p.slices == 1_000_000) {
        assert!(p.error <= 1e-5, "opacity {}: {}", p.opacity, p.error);
    }
    // Explicit Euler is seen to leave [0,1] and to grow, and where theory says.
    assert!(found.negative_from.is_some_and(|x| x > 1.0 && x < 1.5), "{:?}", found.negative_from);
    assert!(found.divergent_from.is_some_and(|x| x > 2.0 && x < 2.1), "{:?}", found.divergent_from);
    assert!(found.riemann.iter().any(|p| p.riemann.abs() > 1e4) && found.riemann.iter().all(|p| (0.0..=1.0).contains(&p.exponential)));
}

struct Stop;

impl Progress for Stop {
    fn step(&self, _: &str, _: u64, _: u64) -> bool {
        false
    }
}

#[test]
fn a_study_can_be_stopped() {
    let settings = Settings::new().progress(Arc::new(Stop));
    assert!(matches!(stability(&settings), Err(Error::Stopped)));
}
