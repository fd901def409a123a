//! The tables, and all numbers behind them.

use super::case::SIDE;
use super::dense::{BOUND, Dense, TURNING, Turn, VIEWS};
use super::ours::Way;
use super::rounds::Times;
use super::{THREADS, VOLPACK_PART, VTK_DEFAULT, VTK_LIT, VTK_PART};
use serde::Serialize;
use slicestack::Level;
use std::error::Error;
use std::fmt::Write;
use std::path::Path;

/// What a peer was told, and how good its picture is.
#[derive(Debug, Serialize)]
pub(crate) struct Peer {
    #[serde(skip)]
    pub(crate) name: &'static str,
    pub(crate) setting: String,
    pub(crate) threads: usize,
    /// Our error has to be so many times smaller.
    pub(crate) part: f64,
    /// RMS error.
    pub(crate) error: f64,
}

/// One of our pictures.
#[derive(Debug, Serialize)]
pub(crate) struct Entry {
    pub(crate) method: &'static str,
    pub(crate) slices: u64,
    pub(crate) error: f64,
    pub(crate) seconds: f64,
    pub(crate) median_seconds: f64,
    /// Times as fast as the peer.
    pub(crate) ratio: f64,
}

impl Entry {
    pub(crate) fn new(way: &Way, times: Times, theirs: Times) -> Self {
        Self {
            method: way.method,
            slices: way.slices,
            error: way.error,
            seconds: times.least,
            median_seconds: times.median,
            ratio: theirs.least / times.least,
        }
    }
}

/// A peer on a scene, and ours beside it.
#[derive(Debug, Serialize)]
pub(crate) struct Row {
    pub(crate) scene: String,
    pub(crate) peer: &'static str,
    /// None of these where the peer is not installed.
    pub(crate) measured: Option<Peer>,
    pub(crate) seconds: Option<f64>,
    pub(crate) median_seconds: Option<f64>,
    /// The faster method of those that reach the error in some number of slices.
    pub(crate) counted: Option<Entry>,
    pub(crate) tolerance: Option<Entry>,
}

impl Row {
    pub(crate) fn missing(scene: &str, peer: &'static str) -> Self {
        Self { scene: scene.into(), peer, measured: None, seconds: None, median_seconds: None, counted: None, tolerance: None }
    }

    fn line(&self) -> String {
        let Some((peer, seconds)) = self.measured.as_ref().zip(self.seconds) else {
            return format!("| {} | not installed |{}", self.scene, " |".repeat(10));
        };
        let ours = |entry: &Option<Entry>, way: fn(&Entry) -> String| match entry {
            Some(e) => format!("{} | {:.1e} | {} | {}", way(e), e.error, ms(e.seconds), times(e.ratio)),
            None => "out of reach | | | ".into(),
        };
        format!(
            "| {} | {} | {:.1e} | {} | {} | {} |",
            self.scene,
            peer.setting,
            peer.error,
            ms(seconds),
            ours(&self.counted, |e| format!("{}, {}", e.method, e.slices)),
            ours(&self.tolerance, |e| e.method.to_owned()),
        )
    }
}

/// Everything that was measured.
#[derive(Debug, Serialize)]
pub(crate) struct Record {
    pub(crate) version: &'static str,
    pub(crate) cpu: String,
    pub(crate) cores: usize,
    pub(crate) simd: &'static str,
    pub(crate) threads: usize,
    pub(crate) rounds: usize,
    pub(crate) llvmpipe: String,
    pub(crate) vtk: Option<String>,
    /// Version and driver of VTK's default mapper.
    pub(crate) vtk_default: Option<String>,
    pub(crate) rows: Vec<Row>,
    pub(crate) turns: Vec<Turn>,
    pub(crate) dense: Option<Dense>,
    /// Seconds that it all took.
    pub(crate) seconds: f64,
}

fn ms(seconds: f64) -> String {
    let ms = 1e3 * seconds;
    if ms < 100.0 { format!("{ms:.1} ms") } else { format!("{ms:.0} ms") }
}

fn times(ratio: f64) -> String {
    if ratio < 10.0 { format!("{ratio:.1}") } else { format!("{ratio:.0}") }
}

/// The processor's name, as Linux tells it.
fn cpu() -> String {
    let told = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = told.lines().find_map(|l| l.strip_prefix("model name")?.split_once(": ").map(|(_, name)| name.trim().to_owned()));
    name.unwrap_or_else(|| std::env::consts::ARCH.into())
}

impl Record {
    pub(crate) fn new(rounds: usize) -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            cpu: cpu(),
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            simd: Level::best().name(),
            threads: THREADS,
            rounds,
            llvmpipe: String::new(),
            vtk: None,
            vtk_default: None,
            rows: Vec::new(),
            turns: Vec::new(),
            dense: None,
            seconds: 0.0,
        }
    }

    pub(crate) fn json(&self) -> Result<String, Box<dyn Error>> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Says so when the machine was busy: shortest times are then not what frames take.
    pub(crate) fn warn_of_noise(&self) {
        let far = |least: f64, median: f64| median > NOISY * least;
        let theirs = self.rows.iter().filter_map(|r| Some(far(r.seconds?, r.median_seconds?)));
        let entries = self.rows.iter().flat_map(|r| r.counted.iter().chain(&r.tolerance));
        let list: Vec<bool> = theirs.chain(entries.map(|e| far(e.seconds, e.median_seconds))).collect();
        let noisy = list.iter().filter(|&&n| n).count();
        if noisy > 0 {
            eprintln!("{noisy} of {} have a median over {NOISY} times the shortest: the machine does other things too", list.len());
        }
    }

    /// The tables, as they stand in the README.
    pub(crate) fn markdown(&self) -> String {
        let mut text = self.against("llvmpipe", "llvmpipe, OpenGL by Mesa: slices blended in f32. Ours to the same error");
        text += &self.against("VTK", &format!("VTK's ray caster for the CPU. Ours to an error {VTK_PART} times smaller"));
        text += &self.against(
            VTK_LIT,
            &format!("In a head light, VTK's ray caster for the CPU with shading. Ours to an error {VTK_PART} times smaller"),
        );
        text += &self
            .against(VTK_DEFAULT, "In the same light, the mapper that VTK takes by default, drawn by llvmpipe. Ours to the same error");
        text += &self.against("VolPack", &format!("VolPack's shear-warp, one thread each. Ours to an error {VOLPACK_PART} times smaller"));
        text += &self.turning();
        text += &self.dense.as_ref().map(Dense::markdown).unwrap_or_default();
        let vtk = self.vtk.as_deref().map_or_else(|| "VTK not installed".into(), |v| format!("VTK {v}"));
        text += &format!(
            "{}, {} cores, {} threads, {}; {SIDE} x {SIDE} pixels, the shortest of {} frames; {}; {vtk}{}.\n",
            self.cpu,
            self.cores,
            self.threads,
            self.simd,
            self.rounds,
            self.llvmpipe,
            self.vtk_default.as_deref().map_or_else(String::new, |v| format!(", by default {v}"))
        );
        text
    }

    fn against(&self, peer: &str, about: &str) -> String {
        let rows: Vec<&Row> = self.rows.iter().filter(|r| r.peer == peer).collect();
        let mut text = format!(
            "{about}:\n\n| scene | {peer} | error | time | ours | error | time | times as fast | ours by tolerance | error | time | times as fast |\n"
        );
        text += &("|---".repeat(12) + "|\n");
        rows.iter().for_each(|r| text += &(r.line() + "\n"));
        let ratios = |entry: fn(&Row) -> Option<&Entry>| -> String {
            let list: Option<Vec<f64>> = rows.iter().map(|r| entry(r).map(|e| e.ratio)).collect();
            match list {
                Some(list) if !list.is_empty() => {
                    let mean = (list.iter().map(|r| r.ln()).sum::<f64>() / list.len() as f64).exp();
                    let least = list.iter().copied().fold(f64::INFINITY, f64::min);
                    format!("**{}** (least {})", times(mean), times(least))
                }
                _ => String::new(),
            }
        };
        let (counted, tolerance) = (ratios(|r| r.counted.as_ref()), ratios(|r| r.tolerance.as_ref()));
        text + &format!("| geometric mean | | | | | | | {counted} | | | | {tolerance} |\n\n")
    }

    fn turning(&self) -> String {
        let mut text = format!(
            "Turning once around in {VIEWS} views:\n\n| scene | 256 slices: mean | worst | tolerance {TURNING:e}: mean | worst |\n|---|---|---|---|---|\n"
        );
        for t in &self.turns {
            let told = [t.mean_seconds, t.worst_seconds, t.tolerance_mean_seconds, t.tolerance_worst_seconds].map(ms);
            let _ = writeln!(text, "| {} | {} |", t.scene, told.join(" | "));
        }
        text + "\n"
    }
}

impl Dense {
    fn markdown(&self) -> String {
        let rate = |seconds: f64| self.fragments as f64 / seconds / 1e6;
        let mut text = format!("Nothing to leave out, every voxel faintly opaque, {} slices:\n\n| a haze | |\n|---|---|\n", self.slices);
        let mut line = |what: &str, value: String| text += &format!("| {what} | {value} |\n");
        line("llvmpipe", format!("{:.0} million fragments a second", rate(self.llvmpipe_seconds)));
        line("ours", format!("{:.0} million, {} times as many", rate(self.seconds), times(self.llvmpipe_seconds / self.seconds)));
        line(
            "ours, cycles of a core for a fragment",
            format!(
                "{:.1} at {:.2} GHz, {:.1} times the {BOUND} that bound a loop over eight lanes",
                self.cycles,
                self.clock / 1e9,
                self.cycles / BOUND
            ),
        );
        let told = |everywhere: bool| -> String {
            let list: Vec<String> =
                self.stages.iter().filter(|s| s.everywhere == everywhere).map(|s| format!("{} {:.1}", s.name, s.cycles)).collect();
            list.join(", ")
        };
        let rest = self.cycles - self.stages.iter().filter(|s| s.everywhere).map(|s| s.cycles).sum::<f64>();
        line("each stage alone, from the cache", format!("{}; {rest:.1} more for memory, edges and all between stages", told(true)));
        line("at the box's faces alone", told(false));
        line("half of the volume empty", format!("{:.2} of the time of all of it", self.half_seconds / self.seconds));
        line("all of it empty", format!("{:.2} ms a frame", 1e3 * self.empty_seconds));
        text + "\n"
    }
}

/// A median so many times the shortest frame tells of other work on the machine.
const NOISY: f64 = 1.25;

/// Around the tables in the README.
const BEGIN: &str = "<!-- begin: printed by the bench peers -->\n";
const END: &str = "<!-- end: printed by the bench peers -->\n";

/// Writes docs/peers, and the tables into the README.
pub(crate) fn write(text: &str, json: &str) -> Result<(), Box<dyn Error>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let file = root.join("README.md");
    let readme = std::fs::read_to_string(&file)?;
    let (before, rest) = readme.split_once(BEGIN).ok_or("README.md: no place for the tables")?;
    let (_, after) = rest.split_once(END).ok_or("README.md: the tables have no end")?;
    std::fs::create_dir_all(root.join("docs/peers"))?;
    std::fs::write(root.join("docs/peers/table.md"), text)?;
    std::fs::write(root.join("docs/peers/peers.json"), json)?;
    std::fs::write(file, format!("{before}{BEGIN}\n{text}\n{END}{after}"))?;
    Ok(())
}
