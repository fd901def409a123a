//! A volume of the Visible Human's size: written as a NRRD file, then rendered from it, with times and memory printed.
//!
//! ```sh
//! cargo run --release --example large_volume -- write body.nrrd                # 512 x 512 x 1871 voxels of u16: 981 MB
//! cargo run --release --example large_volume -- render body.nrrd body.png
//! cargo run --release --example large_volume -- write cube.nrrd 512 512 512 f32
//! ```

use slicestack::picture::Depth;
use slicestack::scene::{Camera, Placement, Preset, Projection, Slicing};
use slicestack::volume::VoxelType;
use slicestack::{Error, Renderer, Result, Scene, Settings, Volume};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

/// What stored values are above Hounsfield units, as scanners have it.
const OFFSET: i32 = 1024;

/// Half-widths along x and y of a body of height 1, from the feet up; the box is 1 wide and deep.
const BODY: [(f64, f64, f64); 9] = [
    (0.0, 0.05, 0.12),
    (0.04, 0.05, 0.06),
    (0.25, 0.08, 0.09),
    (0.45, 0.1, 0.12),
    (0.5, 0.3, 0.2),
    (0.65, 0.26, 0.18),
    (0.82, 0.34, 0.2),
    (0.86, 0.1, 0.11),
    (1.0, 0.14, 0.17),
];

/// The line through `points` (position, value) at `t`.
fn line(points: &[(f64, f64)], t: f64) -> f64 {
    let after = points.iter().position(|p| p.0 > t).unwrap_or(points.len() - 1).max(1);
    let ((a, low), (b, high)) = (points[after - 1], points[after]);
    low + (high - low) * ((t - a) / (b - a)).clamp(0.0, 1.0)
}

/// Squared distance from the axis of an ellipse: 1 on its edge.
fn ellipse(x: f64, y: f64, center: f64, rx: f64, ry: f64) -> f64 {
    let (u, v) = ((x - center) / rx, y / ry);
    u * u + v * v
}

/// One layer of a body at height `z` (0 to 1), `nx` x `ny` Hounsfield units.
pub(crate) fn layer(z: f64, [nx, ny]: [usize; 2], out: &mut Vec<i32>) {
    out.clear();
    let rx = line(&BODY.map(|(z, rx, _)| (z, rx)), z);
    let ry = line(&BODY.map(|(z, _, ry)| (z, ry)), z);
    let legs = z < 0.47;
    let chest = (0.6..0.82).contains(&z);
    let rib = chest && (z * 60.0).fract() < 0.45;
    for j in 0..ny {
        let y = (j as f64 + 0.5) / ny as f64 - 0.5;
        for i in 0..nx {
            let x = (i as f64 + 0.5) / nx as f64 - 0.5;
            let center = if legs { 0.13f64.copysign(x) } else { 0.0 };
            let r = ellipse(x, y, center, rx, ry);
            let bone = if legs { ellipse(x, y, center, 0.28 * rx, 0.28 * ry) } else { ellipse(x, y - 0.55 * ry, 0.0, 0.035, 0.04) };
            let head = z > 0.88;
            let arm = ellipse(x, y, 0.42f64.copysign(x), 0.05, 0.06);
            let lung = if chest { ellipse(x, y, 0.13f64.copysign(x), 0.09, 0.13) } else { 9.0 };
            let value = match () {
                () if (0.45..0.8).contains(&z) && arm < 1.0 => {
                    if arm < 0.12 {
                        900
                    } else {
                        45
                    }
                }
                () if r >= 1.0 => -1000,
                () if bone < 1.0 => {
                    if bone > 0.5 {
                        1300
                    } else {
                        350
                    }
                }
                () if lung < 1.0 => -820,
                () if rib && (0.72..0.8).contains(&r) => 700,
                () if head && (0.72..0.86).contains(&r) => 1500,
                () if r > 0.88 => -95,
                () => 40,
            };
            // Noise from the place alone: the same file everywhere.
            let seed = (j * nx + i) as u32 ^ ((z * 65536.0) as u32).wrapping_mul(0x9e37_79b9);
            let mixed = (seed ^ seed >> 15).wrapping_mul(0x2c1b_3c6d);
            out.push(value + ((mixed ^ mixed >> 12) % 25) as i32 - 12);
        }
    }
}

/// Writes a body of `dims` voxels as NRRD, 1.8 m tall.
pub(crate) fn write(path: &Path, [nx, ny, nz]: [usize; 3], kind: VoxelType) -> Result<()> {
    let name = match kind {
        VoxelType::U8 => "uint8",
        VoxelType::U16 => "uint16",
        VoxelType::F32 => "float",
        _ => return Err(Error::Invalid(format!("voxels of {kind}: u8, u16 or f32 are written"))),
    };
    let sink = || -> std::io::Result<()> {
        let mut file = BufWriter::with_capacity(1 << 20, File::create(path)?);
        let spacing = format!("{} {} {}", 600.0 / nx as f64, 600.0 / ny as f64, 1800.0 / nz as f64);
        let fields = format!("type: {name}\ndimension: 3\nsizes: {nx} {ny} {nz}\nspacings: {spacing}\nendian: little\nencoding: raw");
        // The header's length is a multiple of 8: voxels can be mapped where they lie.
        let (start, end) = (format!("NRRD0004\n{fields}\n"), "\n\n");
        let fill = (8 - (start.len() + 1 + end.len()) % 8) % 8;
        write!(file, "{start}#{}{end}", "-".repeat(fill))?;
        let mut values = Vec::new();
        let mut bytes = Vec::new();
        for k in 0..nz {
            layer((k as f64 + 0.5) / nz as f64, [nx, ny], &mut values);
            bytes.clear();
            for &v in &values {
                let stored = v + OFFSET;
                match kind {
                    VoxelType::U8 => bytes.push((stored / 16).clamp(0, 255) as u8),
                    VoxelType::F32 => bytes.extend((stored as f32).to_le_bytes()),
                    _ => bytes.extend((stored as u16).to_le_bytes()),
                }
            }
            file.write_all(&bytes)?;
        }
        file.flush()
    };
    sink().map_err(|source| Error::Io { path: path.to_path_buf(), source })
}

/// Most bytes of this process in memory so far, pages of mapped files with them; `None` where the system does not say.
pub(crate) fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    Some(line.split_whitespace().nth(1)?.parse::<u64>().ok()? * 1024)
}

/// Renders the body in `path` from `frames` sides, 512 x 512 pixels; prints times since `start`. The first picture goes to `out`.
pub(crate) fn render(path: &Path, out: Option<&Path>, frames: u32, start: Instant) -> Result<()> {
    let volume = Volume::open(path)?;
    let opened = start.elapsed().as_secs_f64();
    // Voxels of u8 hold a sixteenth of the value.
    let slope = if volume.voxels().voxel_type() == VoxelType::U8 { 16.0 } else { 1.0 };
    let volume = volume.with_rescale(slope, f64::from(-OFFSET))?;
    // Opacities per centimetre instead of the preset's millimetre: the body is large, and should be translucent.
    let transfer = Preset::CtSkinBone.transfer(&volume)?.with_unit(10.0)?;
    let depth = volume.grid().dims()[0] as u64;
    let scene = Scene::new(transfer).with_size(512, 512)?.with_slices(Slicing::Count(depth))?;
    let projection = Projection::Orthographic { height: Some(2.1 * volume.grid().radius()) };
    let mut renderer = Renderer::new(&volume, Settings::default());
    println!("opened after {opened:.3} s: {:?}", volume.voxels());
    for frame in 0..frames {
        let azimuth = 30.0 + 360.0 * f64::from(frame) / f64::from(frames);
        let camera = Camera::new(Placement::Orbit { azimuth, elevation: 10.0, roll: 0.0, zoom: 1.0 }, projection)?;
        let (picture, stats) = renderer.render(&scene.clone().with_camera(camera))?;
        if let (Some(out), 0) = (out, frame) {
            picture.save(out, Depth::Eight)?;
        }
        println!(
            "picture {frame} after {:.3} s: prepared {:.3} s, rendered {:.3} s",
            start.elapsed().as_secs_f64(),
            stats.prepare_seconds,
            stats.render_seconds
        );
    }
    if let Some(peak) = peak_memory() {
        let file = std::fs::metadata(path).map_or(0, |m| m.len());
        println!("at most {} MB in memory, {:.3} times the file", peak / 1_000_000, peak as f64 / file as f64);
    }
    Ok(())
}

fn run() -> Result<()> {
    let start = Instant::now();
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let number = |text: &str| {
        let n = text.parse::<usize>().ok().filter(|&n| n > 0);
        n.ok_or_else(|| Error::Invalid(format!("{text} is no number of voxels from 1 up")))
    };
    match words[..] {
        ["write", path] => write(Path::new(path), [512, 512, 1871], VoxelType::U16),
        ["write", path, x, y, z, kind] => {
            let kind = VoxelType::from_name(kind).ok_or_else(|| Error::Invalid(format!("{kind} is no type of voxels")))?;
            write(Path::new(path), [number(x)?, number(y)?, number(z)?], kind)
        }
        ["render", path] => render(Path::new(path), None, 6, start),
        ["render", path, out] => render(Path::new(path), Some(Path::new(out)), 6, start),
        _ => Err(Error::Invalid("large_volume write FILE [NX NY NZ TYPE] | render FILE [PICTURE.png]".to_owned())),
    }
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}
