//! The profile `opengl` against a real OpenGL: Mesa's driver for the CPU, which draws the same slices.
//!
//! `cargo test --release --features conformance --test conformance` needs libOSMesa (Debian: libosmesa6) and fails without it.
//! With `SLICESTACK_BLESS=1` it writes the differences of every scene into docs/opengl.md and docs/opengl.csv.
//!
//! Mesa filters 8-bit textures in fixed point, and in floats when `GALLIVM_PERF=no_aos_sampling` is set before it is loaded. Both
//! ways are compared, the second one in a process of its own: the first with the fixed-point filter of the profile, the second with
//! its float filter, which leaves next to no difference.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

mod compare;
mod draw;
mod gl;
mod report;
mod scenes;
mod slices;

use compare::{Coverage, Difference, coverage};
use draw::{Show, draw};
use gl::Gl;
use scenes::{Bits, Case};
use slicestack::scene::{Arithmetic, BlendFunction, Factor, Method, OpenGl, Straight, Target, TextureFormat, TransferFunction};
use slicestack::{Picture, Renderer, Scene, Settings, Volume};
use std::path::Path;

/// The differences of one scene in one kind of numbers.
pub(crate) struct Compared {
    pub(crate) bits: Bits,
    /// Filtered as Mesa filters: in fixed point.
    pub(crate) fixed: Difference,
    /// Filtered in floats, while Mesa filters in fixed point.
    pub(crate) mixed: Difference,
    /// Both filtered in floats.
    pub(crate) float: Difference,
}

/// Everything that was measured on one scene.
pub(crate) struct Measured {
    pub(crate) case: Case,
    pub(crate) results: Vec<Compared>,
    pub(crate) coverage: Coverage,
}

/// Where the process that has Mesa filter in floats leaves what it measured.
const CHILD: &str = "SLICESTACK_CONFORMANCE_CHILD";

fn ours(volume: &Volume, scene: &Scene) -> Picture {
    Renderer::new(volume, Settings::default()).render(scene).unwrap().0
}

/// A picture whose pixels are the number of fragments drawn there.
fn count(case: &Case) -> Picture {
    let white = TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
    let sum = BlendFunction::add(Factor::One, Factor::One);
    let state = OpenGl { scissor: case.state.scissor, table: Some(TextureFormat::F32), ..OpenGl::default() }.with_blend(sum);
    let scene = case.scene(Bits::Float, Arithmetic::Float).with_opengl(state).unwrap();
    let scene = scene.with_method(Method::default().with_target(Target::F32)).unwrap().with_transfer(white).with_fog(None);
    ours(&case.volume, &scene.with_background(Straight::default()).unwrap())
}

fn count_fragments(gl: &Gl, case: &Case) -> Coverage {
    let scene = case.scene(Bits::Float, Arithmetic::Float);
    let theirs = draw(gl, &case.volume, &scene, Show::Count);
    coverage(&case.volume, &scene, count(case).pixels(), &theirs)
}

/// One scene, drawn by Mesa, against ours for each of `arithmetics`.
fn differences(gl: &Gl, case: &Case, bits: Bits, coverage: &Coverage, arithmetics: &[Arithmetic]) -> Vec<Difference> {
    let theirs = draw(gl, &case.volume, &case.scene(bits, Arithmetic::Float), Show::Picture);
    let ours = |&a: &Arithmetic| ours(&case.volume, &case.scene(bits, a));
    arithmetics.iter().map(|a| Difference::new(ours(a).pixels(), &theirs, &coverage.differs)).collect()
}

/// Every scene, with Mesa filtering in floats: a line for each picture.
fn measure_in_floats(gl: &Gl) -> String {
    let mut lines = String::new();
    for case in scenes::cases() {
        let coverage = count_fragments(gl, &case);
        for &bits in &case.bits {
            lines += &(differences(gl, &case, bits, &coverage, &[Arithmetic::Float])[0].line() + "\n");
        }
    }
    lines
}

/// The same from a process of its own.
fn floats() -> Vec<Difference> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("differences");
    let child = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", "pictures_agree_with_mesa", "--test-threads", "1"])
        .env(CHILD, &file)
        .env("GALLIVM_PERF", "no_aos_sampling")
        .output()
        .unwrap();
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stdout));
    std::fs::read_to_string(&file).unwrap().lines().map(Difference::from_line).collect()
}

fn measure(gl: &Gl, case: Case, floats: &mut impl Iterator<Item = Difference>) -> Measured {
    let coverage = count_fragments(gl, &case);
    let results = case.bits.iter().map(|&bits| {
        let both = differences(gl, &case, bits, &coverage, &[case.mesas_arithmetic(), Arithmetic::Float]);
        Compared { bits, fixed: both[0], mixed: both[1], float: floats.next().unwrap() }
    });
    let results = results.collect();
    Measured { case, results, coverage }
}

#[test]
fn pictures_agree_with_mesa() {
    let gl = Gl::load().unwrap();
    if let Some(file) = std::env::var_os(CHILD) {
        std::fs::write(file, measure_in_floats(&gl)).unwrap();
        return;
    }
    let mut floats = floats().into_iter();
    let measured: Vec<Measured> = scenes::cases().into_iter().map(|case| measure(&gl, case, &mut floats)).collect();
    assert!(measured.len() >= 60 && floats.next().is_none());
    if std::env::var_os("SLICESTACK_BLESS").is_some() {
        let context = gl.context(gl::constant::FLOAT, 8, 8);
        let driver = format!("{}, {}", context.text(gl::constant::RENDERER), context.text(gl::constant::VERSION));
        report::write(&Path::new(env!("CARGO_MANIFEST_DIR")).join("docs"), &measured, &driver);
    }
    let mut wrong = String::new();
    let mut compared = 0;
    for m in &measured {
        let name = format!("{}, {}", m.case.group, m.case.name);
        for r in &m.results {
            compared += 2;
            if let Err(why) = r.fixed.check(r.bits, m.case.jumps()) {
                wrong += &format!("{name} ({}), both in fixed point: {why}\n", r.bits.name());
            }
            // Without Mesa's 8-bit filters an 8-bit texture is as good as a float one.
            let bits = if r.bits == Bits::Mixed { Bits::Float } else { r.bits };
            if let Err(why) = r.float.check(bits, m.case.jumps()) {
                wrong += &format!("{name} ({}), both in floats: {why}\n", r.bits.name());
            }
        }
        if let Err(why) = m.coverage.check() {
            wrong += &format!("{name}: {why}\n");
        }
    }
    println!("{} scenes, {compared} pictures compared", measured.len());
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn weighted_fog_on_premultiplied_colours_is_mesas_fog_on_straight_ones() {
    let gl = Gl::load().unwrap();
    for (weighted, literal) in scenes::weighted() {
        let picture = ours(&weighted.volume, &weighted.scene(Bits::Float, Arithmetic::Float));
        let theirs = draw(&gl, &literal.volume, &literal.scene(Bits::Float, Arithmetic::Float), Show::Picture);
        let coverage = count_fragments(&gl, &literal);
        Difference::new(picture.pixels(), &theirs, &coverage.differs).check(Bits::Float, true).unwrap();
    }
}
