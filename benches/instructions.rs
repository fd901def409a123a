//! One frame of each of a fixed set of scenes, on one thread, for tools that count instructions.
//!
//! Not meant to be run by hand: `.ci/instructions.py` counts what lies between calls of [`mark`], `.ci/vectors.py` looks at the code
//! behind the addresses.
//!
//! ```text
//! instructions frames LEVEL [CASE...]     renders each case; mark() stands before and after one frame
//! instructions stages LEVEL [CASE...]     prints case, stage and address of each stage, and the address of mark()
//! ```

mod scenes;

use scenes::{CASES, Case, case};
use slicestack::{Level, Renderer, Settings};
use std::error::Error;
use std::hint::black_box;

/// Stands between what is counted.
#[inline(never)]
fn mark() {
    black_box(());
}

fn frames(Case { name, volume, scene }: &Case, settings: Settings) -> Result<(), Box<dyn Error>> {
    let mut renderer = Renderer::new(volume, settings);
    // The first frame prepares.
    let (first, stats) = renderer.render(scene)?;
    mark();
    let again = renderer.render(scene)?;
    mark();
    if first != again.0 {
        return Err(format!("{name}: two pictures of one scene differ").into());
    }
    println!("{name} {} {} {}", stats.fragments, stats.fetches, stats.simd);
    Ok(())
}

fn stages(Case { name, volume, scene }: &Case, settings: Settings) -> Result<(), Box<dyn Error>> {
    let mut renderer = Renderer::new(volume, settings);
    for (stage, address) in slicestack::bench::addresses(&mut renderer, scene)? {
        println!("{name} {stage} {address:x}");
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [what, level, names @ ..] = args.as_slice() else {
        return Err("usage: instructions frames|stages LEVEL [CASE...]".into());
    };
    let level = Level::from_name(level).ok_or_else(|| format!("vector level {level}: not on this machine"))?;
    let settings = Settings::new().level(level).threads(1);
    let names: Vec<&str> = if names.is_empty() { CASES.to_vec() } else { names.iter().map(String::as_str).collect() };
    if what == "stages" {
        println!("- mark {:x}", mark as fn() as usize);
    }
    for name in names {
        let case = case(name)?.ok_or_else(|| format!("case {name}: one of {}", CASES.join(", ")))?;
        match what.as_str() {
            "frames" => frames(&case, settings.clone())?,
            "stages" => stages(&case, settings.clone())?,
            _ => return Err(format!("{what}: frames or stages").into()),
        }
    }
    Ok(())
}
