//! Speed against error, beside other renderers that run on the CPU: prints the README's tables.
//!
//! ```text
//! cargo bench --features conformance --bench peers -- [SCENE.toml ...] [--only NAME] [--rounds N] [--json FILE] [--write]
//! ```
//! Without scenes it takes built-in volumes; `benches/peers/*.toml` are the README's scenes. Of a scene it takes the volume, in 8 bits,
//! and the transfer function; all are seen in one view.
//!
//! ```text
//!  case ---> reference in f64 (judge)
//!    |             | RMS error
//!    +--> llvmpipe, VTK (unlit, lit, and its default mapper by llvmpipe, lit), VolPack: time, error E
//!    '--> ours: fewest slices for E, E/10, E/20; tolerance of as much   --> rounds, one frame each in turn --> report
//! ```
//! llvmpipe needs libOSMesa (Debian: libosmesa6); VTK a Python with the package vtk (`$PYTHON`, or python3); VolPack libvolpack1. The
//! first is a must, the others are told as not installed.

mod case;
mod dense;
#[allow(dead_code, reason = "the conformance test needs more of it")]
#[path = "../../tests/conformance/gl.rs"]
mod gl;
mod judge;
mod llvmpipe;
mod ours;
mod report;
mod rounds;
#[path = "../scenes/mod.rs"]
mod scenes;
#[allow(dead_code, clippy::panic, reason = "the conformance test needs more of it, and may panic; these scenes look at a point")]
#[path = "../../tests/conformance/slices.rs"]
mod slices;
mod volpack;
mod vtk;

use case::Case;
use clap::Parser;
use gl::Gl;
use judge::Judge;
use llvmpipe::Llvmpipe;
use ours::{Ours, Way};
use report::{Entry, Peer, Record, Row};
use rounds::{Contestant, Times};
use slicestack::volume::phantom::Phantom;
use std::error::Error;
use std::path::PathBuf;
use std::process::{Command, ExitCode};
use std::time::Instant;
use volpack::VolPack;
use vtk::{Mapper, Vtk};

/// Threads of every peer but VolPack, and of ours beside them.
const THREADS: usize = 2;
/// Slice counts of llvmpipe.
const COUNTS: [usize; 2] = [256, 1024];
/// How much smaller than the peer's our error has to be.
const VTK_PART: f64 = 10.0;
const VOLPACK_PART: f64 = 20.0;
/// VTK in a head light: its caster for the CPU, and the mapper it takes by default.
const VTK_LIT: &str = "VTK, lit";
const VTK_DEFAULT: &str = "VTK's default, lit";
/// The built-in volumes.
const PHANTOMS: [Phantom; 4] = [Phantom::MarschnerLobb, Phantom::Hydrogen, Phantom::SheppLogan, Phantom::Cloud];
/// How Mesa is told its number of threads, before it is loaded.
const MESA_THREADS: &str = "LP_NUM_THREADS";

/// Speed against error, beside other renderers.
#[derive(Parser)]
struct Args {
    /// Scene files; built-in volumes without any.
    scenes: Vec<PathBuf>,
    /// The one scene to run, by name.
    #[arg(long, value_name = "NAME")]
    only: Option<String>,
    /// Frames of each contestant, after one to warm up.
    #[arg(long, default_value_t = 31, value_parser = clap::value_parser!(u16).range(1..))]
    rounds: u16,
    /// Where to write all numbers.
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
    /// Writes docs/peers and the README's tables.
    #[arg(long)]
    write: bool,
    /// What cargo says to every bench.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> ExitCode {
    let done = if std::env::var_os(MESA_THREADS).is_some_and(|n| n == *THREADS.to_string()) { run() } else { again() };
    done.unwrap_or_else(|e| {
        eprintln!("error: {e}");
        ExitCode::FAILURE
    })
}

/// The program in a process whose environment tells Mesa its number of threads.
fn again() -> Result<ExitCode, Box<dyn Error>> {
    let mut child = Command::new(std::env::current_exe()?);
    let status = child.args(std::env::args_os().skip(1)).env(MESA_THREADS, THREADS.to_string()).status()?;
    Ok(status.code().and_then(|c| u8::try_from(c).ok()).map_or(ExitCode::FAILURE, ExitCode::from))
}

fn cases(args: &Args) -> Result<Vec<Case>, Box<dyn Error>> {
    let wanted = |name: &str| args.only.as_ref().is_none_or(|only| only == name);
    let mut cases = Vec::new();
    for path in args.scenes.iter().filter(|p| wanted(&p.file_stem().unwrap_or_default().to_string_lossy())) {
        cases.extend(Case::read(path)?);
    }
    if cases.is_empty() && !args.scenes.is_empty() && args.only.is_none() {
        eprintln!("no scene has its data: going on with built-in volumes");
    }
    if cases.is_empty() {
        for phantom in PHANTOMS.into_iter().filter(|p| wanted(p.name())) {
            cases.push(Case::phantom(phantom)?);
        }
    }
    if cases.is_empty() {
        return Err(format!("no scene is called {}", args.only.as_deref().unwrap_or("so")).into());
    }
    Ok(cases)
}

fn run() -> Result<ExitCode, Box<dyn Error>> {
    let args = Args::parse();
    let start = Instant::now();
    let gl = Gl::load()?;
    let mut record = Record::new(args.rounds.into());
    if !vtk::is_installed() {
        eprintln!("VTK: not installed ($PYTHON or python3 cannot import vtk)");
    }
    for case in cases(&args)? {
        eprintln!("{}: reference", case.name);
        let judge = Judge::new(&case)?;
        eprintln!("{}: frames, {:.0} s gone", case.name, start.elapsed().as_secs_f64());
        compare(&gl, &case, &judge, &mut record)?;
        compare_lit(&case, &mut record)?;
        record.turns.push(dense::turn(&case, THREADS)?);
    }
    eprintln!("haze, {:.0} s gone", start.elapsed().as_secs_f64());
    record.dense = Some(dense::dense(&gl, args.rounds.into(), THREADS)?);
    record.seconds = start.elapsed().as_secs_f64();
    eprintln!("{:.0} s in all", record.seconds);
    record.warn_of_noise();
    let text = record.markdown();
    print!("{text}");
    if let Some(file) = &args.json {
        std::fs::write(file, record.json()?).map_err(|e| format!("{}: {e}", file.display()))?;
    }
    if args.write {
        report::write(&text, &record.json()?)?;
    }
    Ok(ExitCode::SUCCESS)
}

/// A peer's picture and what it is compared with.
struct Match<'a> {
    peer: Peer,
    contestant: Contestant<'a>,
    ours: &'a Ours<'a>,
    /// Slice counts that reach the error, one for each method.
    counted: Vec<Way>,
    tolerance: Way,
}

impl<'a> Match<'a> {
    fn new(peer: Peer, contestant: Contestant<'a>, (ours, judge): (&'a Ours<'a>, &Judge)) -> Result<Self, Box<dyn Error>> {
        let aim = peer.error / peer.part;
        Ok(Self { contestant, ours, counted: ours.counted(judge, aim)?, tolerance: ours.tolerance(judge, aim)?, peer })
    }
}

/// Everybody's frames of one case.
fn compare(gl: &Gl, case: &Case, judge: &Judge, record: &mut Record) -> Result<(), Box<dyn Error>> {
    let (both, one) = (Ours::new(case, THREADS), Ours::new(case, 1));
    let llvmpipe = Llvmpipe::new(gl, case, &COUNTS);
    let mut matches = Vec::new();
    record.llvmpipe = llvmpipe.driver();
    for (i, &count) in COUNTS.iter().enumerate() {
        llvmpipe.frame(i);
        let error = judge.error(case::SIDE, &llvmpipe.picture())?;
        let peer = Peer { name: "llvmpipe", setting: format!("{count} slices"), threads: THREADS, part: 1.0, error };
        matches.push(Match::new(
            peer,
            Box::new({
                let l = &llvmpipe;
                move || Ok(l.frame(i))
            }),
            (&both, judge),
        )?);
    }
    let mut missing = Vec::new();
    if vtk::is_installed() {
        let mut vtk = Vtk::new(case, Mapper::Caster, THREADS)?;
        record.vtk = Some(vtk.version.clone());
        let error = judge.error(case::SIDE, &vtk.picture()?)?;
        let peer = Peer { name: "VTK", setting: format!("{} samples", vtk::SAMPLES), threads: THREADS, part: VTK_PART, error };
        matches.push(Match::new(peer, Box::new(move || vtk.frame()), (&both, judge))?);
    } else {
        missing.push("VTK");
    }
    if let Some(mut volpack) = VolPack::new(case)? {
        volpack.frame()?;
        let error = judge.error(case::SIDE, &volpack.picture())?;
        let peer = Peer { name: "VolPack", setting: "8 bits".into(), threads: 1, part: VOLPACK_PART, error };
        matches.push(Match::new(peer, Box::new(move || volpack.frame()), (&one, judge))?);
    } else {
        missing.push("VolPack");
    }
    record.rows.extend(play(case, matches, record.rounds)?);
    record.rows.extend(missing.into_iter().map(|peer| Row::missing(&case.name, peer)));
    Ok(())
}

/// VTK's frames of one case in a head light, and ours.
fn compare_lit(case: &Case, record: &mut Record) -> Result<(), Box<dyn Error>> {
    if !vtk::is_installed() {
        record.rows.extend([VTK_LIT, VTK_DEFAULT].map(|peer| Row::missing(&case.name, peer)));
        return Ok(());
    }
    let case = &case.lit()?;
    let (judge, ours) = (&Judge::new(case)?, &Ours::new(case, THREADS));
    let mut matches = Vec::new();
    for (name, mapper, part) in [(VTK_LIT, Mapper::Caster, VTK_PART), (VTK_DEFAULT, Mapper::Default, 1.0)] {
        let mut vtk = Vtk::new(case, mapper, THREADS)?;
        if mapper == Mapper::Default {
            record.vtk_default = Some(vtk.version.clone());
        }
        let error = judge.error(case::SIDE, &vtk.picture()?)?;
        let peer = Peer { name, setting: format!("{} samples", vtk::SAMPLES), threads: THREADS, part, error };
        matches.push(Match::new(peer, Box::new(move || vtk.frame()), (ours, judge))?);
    }
    record.rows.extend(play(case, matches, record.rounds)?);
    Ok(())
}

/// All matches in rounds: the peer, then ours in each way, then the next peer.
fn play(case: &Case, matches: Vec<Match<'_>>, rounds: usize) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut contestants: Vec<Contestant<'_>> = Vec::new();
    let mut told = Vec::new();
    for m in matches {
        contestants.push(m.contestant);
        let ours = m.ours;
        for way in m.counted.iter().chain([&m.tolerance]) {
            let scene = way.scene.clone();
            contestants.push(Box::new(move || Ok(ours.frame(&scene)?.0)));
        }
        told.push((m.peer, m.counted, m.tolerance));
    }
    let times: Vec<Times> = rounds::run(rounds, &mut contestants)?;
    let mut times = times.into_iter();
    let mut next = || times.next().ok_or("a contestant without times");
    let mut rows = Vec::new();
    for (peer, counted, tolerance) in told {
        let theirs = next()?;
        let mut entries = Vec::new();
        for way in &counted {
            entries.push(Entry::new(way, next()?, theirs));
        }
        entries.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
        rows.push(Row {
            scene: case.name.clone(),
            peer: peer.name,
            counted: entries.into_iter().next(),
            tolerance: Some(Entry::new(&tolerance, next()?, theirs)),
            seconds: Some(theirs.least),
            median_seconds: Some(theirs.median),
            measured: Some(peer),
        });
    }
    Ok(rows)
}
