//! The profile `opengl` against a real OpenGL: Mesa's driver for the CPU, which draws the same slices.
//!
//! `cargo test --release --features conformance --test conformance` needs libOSMesa (Debian: libosmesa6) and fails without it.
//! With `SLICESTACK_CONFORMANCE=DIRECTORY` the differences of every scene are written there, as JSON and for docs/opengl.md.

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
use slicestack::scene::{BlendFunction, Factor, OpenGl, TextureFormat};
use slicestack::{Picture, Renderer, Scene, Settings, Volume};

/// Everything that was measured on one scene.
pub(crate) struct Measured {
    pub(crate) group: &'static str,
    pub(crate) name: String,
    pub(crate) results: Vec<(Bits, Difference)>,
    pub(crate) coverage: Coverage,
}

fn ours(volume: &Volume, scene: &Scene) -> Picture {
    Renderer::new(volume, Settings::default()).render(scene).unwrap().0
}

/// A picture whose pixels are the number of fragments drawn there.
fn count(case: &Case) -> Picture {
    let white = slicestack::scene::TransferFunction::new(vec![(0.0, [1.0; 3])], vec![(0.0, 1.0)]).unwrap();
    let sum = BlendFunction::add(Factor::One, Factor::One);
    let state = OpenGl { scissor: case.state.scissor, table: Some(TextureFormat::F32), ..OpenGl::default() }.with_blend(sum);
    let scene = case.scene(Bits::Float).with_opengl(state).unwrap();
    let method = slicestack::scene::Method { target: slicestack::scene::Target::F32, ..slicestack::scene::Method::default() };
    let scene = scene.with_method(method).unwrap().with_transfer(white).with_fog(None);
    ours(&case.volume, &scene.with_background(slicestack::scene::Straight::default()).unwrap())
}

fn measure(gl: &Gl, case: &Case) -> Measured {
    let scene = case.scene(Bits::Float);
    let theirs = draw(gl, &case.volume, &scene, Show::Count);
    let coverage = coverage(&case.volume, &scene, count(case).pixels(), &theirs);
    let results = case.bits.iter().map(|&bits| {
        let scene = case.scene(bits);
        let picture = ours(&case.volume, &scene);
        let theirs = draw(gl, &case.volume, &scene, Show::Picture);
        (bits, Difference::new(picture.pixels(), &theirs, &coverage.differs))
    });
    Measured { group: case.group, name: case.name.clone(), results: results.collect(), coverage }
}

#[test]
fn pictures_agree_with_mesa() {
    let gl = Gl::load();
    let cases = scenes::cases();
    assert!(cases.len() >= 60);
    let measured: Vec<Measured> = cases.iter().map(|case| measure(&gl, case)).collect();
    if let Some(folder) = std::env::var_os("SLICESTACK_CONFORMANCE") {
        let (renderer, version) = {
            let context = gl.context(gl::constant::FLOAT, 8, 8);
            (context.text(gl::constant::RENDERER), context.text(gl::constant::VERSION))
        };
        report::write(std::path::Path::new(&folder), &measured, &renderer, &version);
    }
    let mut wrong = String::new();
    for m in &measured {
        for (bits, d) in &m.results {
            if let Err(why) = d.check(*bits) {
                wrong += &format!("{}, {} ({}): {why}\n", m.group, m.name, bits.name());
            }
        }
        if let Err(why) = m.coverage.check() {
            wrong += &format!("{}, {}: {why}\n", m.group, m.name);
        }
    }
    let compared: usize = measured.iter().map(|m| m.results.len()).sum();
    println!("{} scenes, {compared} pictures compared", measured.len());
    assert!(wrong.is_empty(), "\n{wrong}");
}

#[test]
fn weighted_fog_on_premultiplied_colours_is_mesas_fog_on_straight_ones() {
    let gl = Gl::load();
    for (weighted, literal) in scenes::weighted() {
        let picture = ours(&weighted.volume, &weighted.scene(Bits::Float));
        let scene = literal.scene(Bits::Float);
        let theirs = draw(&gl, &literal.volume, &scene, Show::Picture);
        let coverage = coverage(&literal.volume, &scene, count(&literal).pixels(), &draw(&gl, &literal.volume, &scene, Show::Count));
        Difference::new(picture.pixels(), &theirs, &coverage.differs).check(Bits::Float).unwrap();
    }
}
