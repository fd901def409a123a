//! The fuzz targets without a fuzzer: their corpus, and mutations of it, in a bounded number. `.ci/fuzz.py` runs them for long, guided by what code they
//! reach.

#![cfg(all(feature = "cli", feature = "scene-file"))]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]

#[path = "../fuzz/src/lib.rs"]
#[allow(unreachable_pub, reason = "a crate of its own for the fuzzer")]
mod bodies;

use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

/// Executions of a quick target, set to another number for a long run.
const RUNS: &str = "SLICESTACK_FUZZ_RUNS";
/// The seed to begin with.
const FROM: &str = "SLICESTACK_FUZZ_FROM";
/// A file to run alone, in the place of all others.
const INPUT: &str = "SLICESTACK_FUZZ_INPUT";

/// SplitMix64 (Steele et al. 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: usize) -> usize {
        (self.next() % count.max(1) as u64) as usize
    }
}

/// Bytes that numbers and marks are made of.
const WORDS: [&[u8]; 16] = [
    b"0",
    b"-1",
    b"1e999",
    b"nan",
    b"4294967296",
    b"18446744073709551615",
    b"9223372036854775808",
    b"\xff\xff\xff\xff",
    b"\0\0\0\0",
    b"\xff\xff\xff\x7f",
    b"\x80",
    b"\n\n",
    b"1 1 1",
    b"gzip",
    b"\r\n",
    b"/../",
];

/// `seed` of the corpus with some bytes changed, doubled, cut out or put in.
fn mutated(corpus: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut bytes = corpus[random.below(corpus.len())].clone();
    for _ in 0..=random.below(6) {
        let at = random.below(bytes.len() + 1);
        match random.below(8) {
            0 if at < bytes.len() => bytes[at] ^= 1 << random.below(8),
            1 if at < bytes.len() => bytes[at] = random.next() as u8,
            2 => bytes.splice(at..at, WORDS[random.below(WORDS.len())].iter().copied()).for_each(drop),
            3 => bytes.truncate(at),
            4 => {
                let end = (at + 1 + random.below(16)).min(bytes.len());
                drop(bytes.drain(at.min(end)..end));
            }
            5 => {
                let end = (at + 1 + random.below(64)).min(bytes.len());
                let again = bytes[at.min(end)..end].to_vec();
                bytes.splice(at..at, again).for_each(drop);
            }
            6 => {
                // The head of one and the tail of another.
                let other = &corpus[random.below(corpus.len())];
                let from = random.below(other.len() + 1);
                bytes.truncate(at);
                bytes.extend_from_slice(&other[from..]);
            }
            _ => {
                for byte in bytes.iter_mut().skip(at).take(4) {
                    *byte = random.next() as u8;
                }
            }
        }
    }
    bytes
}

/// Runs `body` on the corpus called `name` and on `runs` mutations of it. None may panic or take long.
fn target(name: &str, runs: u64, body: fn(&[u8])) {
    let number = |name: &str| std::env::var(name).ok().map(|n| n.parse::<u64>().unwrap());
    if let Some(file) = std::env::var_os(INPUT) {
        return body(&fs::read(file).unwrap());
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(name);
    let mut files: Vec<_> = fs::read_dir(&folder).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    let corpus: Vec<Vec<u8>> = files.iter().map(|f| fs::read(f).unwrap()).collect();
    assert!(corpus.len() >= 4, "{}: {} inputs", folder.display(), corpus.len());
    // Quick targets are the measure of the number that is set; slow ones keep their share.
    let runs = number(RUNS).map_or(runs, |wanted| wanted * runs / 40_000);
    let from = number(FROM).unwrap_or(0);
    let one = |what: &str, bytes: &[u8]| {
        let start = Instant::now();
        let panicked = std::panic::catch_unwind(|| body(bytes)).is_err();
        let slow = start.elapsed() > Duration::from_secs(20);
        (panicked || slow).then(|| {
            let kept = std::env::temp_dir().join(format!("slicestack-{name}-{}", what.replace(' ', "-")));
            fs::write(&kept, bytes).unwrap();
            format!("{name}: {what}: {}, {}", if slow { "takes long" } else { "a panic" }, kept.display())
        })
    };
    let found: Vec<String> =
        files.iter().zip(&corpus).filter_map(|(f, bytes)| one(&f.file_name().unwrap().to_string_lossy(), bytes)).collect();
    assert!(found.is_empty(), "{}", found.join("\n"));
    // The readers write their input to one file: such targets go in line.
    let mutation = |n: u64| one(&format!("mutation {n}"), &mutated(&corpus, &mut Random(n)));
    let found: Vec<String> = if name == "readers" {
        (from..from + runs).filter_map(mutation).collect()
    } else {
        bodies::random::on_all_cores(from..from + runs, mutation)
    };
    assert!(found.is_empty(), "{} of {runs}:\n{}", found.len(), found[..found.len().min(8)].join("\n"));
    println!("{name}: {} inputs and {runs} mutations", corpus.len());
}

#[test]
fn readers() {
    target("readers", 40_000, bodies::readers::run);
}

#[test]
fn scene_files() {
    target("scene_files", 20_000, bodies::scene_files::run);
}

#[test]
fn transfer_files() {
    target("transfer_files", 40_000, bodies::transfer_files::run);
}

#[test]
fn pictures() {
    target("pictures", 40_000, bodies::pictures::run);
}

#[test]
fn geometry() {
    target("geometry", 20_000, bodies::geometry::run);
}

#[test]
fn blending() {
    target("blending", 1_500, bodies::blending::run);
}

#[test]
fn levels() {
    target("levels", 1_500, bodies::levels::run);
}

#[test]
fn tolerance() {
    target("tolerance", 60, bodies::tolerance::run);
}
