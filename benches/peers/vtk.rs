//! VTK's ray casters, in a Python process of its own that renders a frame when told to.

use super::case::{Case, SIDE};
use slicestack::scene::{Placement, Projection};
use std::error::Error;
use std::ffi::OsString;
use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use tempfile::TempDir;

/// Samples along the depth of the box.
pub(crate) const SAMPLES: u32 = 512;

/// The interpreter: `$PYTHON`, or python3.
fn python() -> OsString {
    std::env::var_os("PYTHON").unwrap_or_else(|| "python3".into())
}

/// Whether the interpreter has VTK.
pub(crate) fn is_installed() -> bool {
    let import = Command::new(python()).args(["-c", "import numpy, vtk"]).stdout(Stdio::null()).stderr(Stdio::null()).status();
    import.is_ok_and(|s| s.success())
}

/// Which of its ray casters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Mapper {
    /// The one for the CPU.
    Caster,
    /// The one it takes by default, in OpenGL.
    Default,
}

/// The process, and the files it works on.
pub(crate) struct Vtk {
    child: Child,
    orders: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
    folder: TempDir,
    /// VTK's version.
    pub(crate) version: String,
}

impl Drop for Vtk {
    fn drop(&mut self) {
        // The end of its orders ends the process.
        drop(self.orders.take());
        if let Err(e) = self.child.wait() {
            eprintln!("VTK: {e}");
        }
    }
}

impl Vtk {
    pub(crate) fn new(case: &Case, mapper: Mapper, threads: usize) -> Result<Self, Box<dyn Error>> {
        let (Placement::LookAt { eye, target, up }, Projection::Orthographic { height: Some(height) }) =
            (case.scene.camera().placement(), case.scene.camera().projection())
        else {
            return Err("VTK: these scenes look at a point in parallel".into());
        };
        let folder = tempfile::tempdir()?;
        let voxels = folder.path().join("voxels");
        fs::write(&voxels, case.bytes())?;
        let grid = case.volume.grid();
        let forward = (target - eye).normalize();
        let depths = grid.corners().map(|c| c.dot(forward));
        let depth = depths.iter().fold(f64::MIN, |a, &b| a.max(b)) - depths.iter().fold(f64::MAX, |a, &b| a.min(b));
        let light = case
            .scene
            .lighting()
            .map(|l| serde_json::json!({ "ambient": l.ambient, "diffuse": l.diffuse, "specular": l.specular, "shininess": l.shininess }));
        let job = serde_json::json!({
            "mapper": if mapper == Mapper::Default { "default" } else { "caster" }, "light": light,
            "voxels": voxels, "dimensions": grid.dims(), "spacing": grid.spacing(), "table": case.table(), "unit": case.unit(),
            "eye": eye.to_array(), "target": target.to_array(), "up": up.to_array(), "height": height, "side": SIDE,
            "step": depth / f64::from(SAMPLES), "threads": threads,
        });
        let file = folder.path().join("job.json");
        fs::write(&file, job.to_string())?;
        let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("benches/peers/vtk_caster.py");
        let mut child = Command::new(python()).arg(script).arg(file).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let orders = child.stdin.take();
        let answers = BufReader::new(child.stdout.take().ok_or("VTK: no output")?);
        let mut vtk = Self { child, orders, answers, folder, version: String::new() };
        vtk.version = vtk.answer()?;
        Ok(vtk)
    }

    fn answer(&mut self) -> Result<String, Box<dyn Error>> {
        let mut line = String::new();
        self.answers.read_line(&mut line)?;
        if line.is_empty() {
            return Err("VTK: the process ended before its time".into());
        }
        Ok(line.trim_end().to_owned())
    }

    fn order(&mut self, order: &str) -> Result<String, Box<dyn Error>> {
        if let Some(orders) = &mut self.orders {
            writeln!(orders, "{order}")?;
            orders.flush()?;
        }
        self.answer()
    }

    /// Seconds for a frame.
    pub(crate) fn frame(&mut self) -> Result<f64, Box<dyn Error>> {
        Ok(self.order("frame")?.parse()?)
    }

    /// The picture, row 0 on top.
    pub(crate) fn picture(&mut self) -> Result<Vec<[f32; 4]>, Box<dyn Error>> {
        let file = self.folder.path().join("pixels");
        self.order(&format!("pixels {}", file.display()))?;
        let bytes = fs::read(file)?;
        let pixel = |p: &[u8]| [p[0], p[1], p[2], p[3]].map(|c| f32::from(c) / 255.0);
        Ok(bytes.chunks_exact(4).map(pixel).collect())
    }
}
