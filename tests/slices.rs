//! Cut pictures and annotations as a user meets them: turned by what files say of the body, one-line errors, the bytes of plain pictures.
#![cfg(feature = "cli")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test fails by panicking")]

use slicestack::cut::{Frame, Orientation, Sheet};
use slicestack::scene::Filter;
use slicestack::{Picture, Volume};
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn run(dir: &Path, args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_slicestack")).args(args).current_dir(dir).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Voxels along the body's axes left, posterior, superior, and their spacing.
const BODY: [usize; 3] = [3, 4, 5];
const SPACING: [f64; 3] = [1.0, 1.5, 2.0];

/// How the voxels of a file lie in the body: axis `a` of voxels runs along axis `to[a]` of the body, backwards where `flip[a]`.
#[derive(Debug, Clone, Copy)]
struct Lie {
    to: [usize; 3],
    flip: [bool; 3],
}

impl Lie {
    fn all() -> Vec<Self> {
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        orders.into_iter().flat_map(|to| (0..8).map(move |f| Self { to, flip: [f & 1 == 1, f & 2 == 2, f & 4 == 4] })).collect()
    }

    fn dims(&self) -> [usize; 3] {
        self.to.map(|b| BODY[b])
    }

    /// Step of each voxel axis and position of the first voxel in the world LPS; the body lies around 10, 20, 30.
    fn geometry(&self) -> ([[f64; 3]; 3], [f64; 3]) {
        let mut steps = [[0.0; 3]; 3];
        let mut origin = [10.0, 20.0, 30.0];
        for a in 0..3 {
            let b = self.to[a];
            steps[a][b] = if self.flip[a] { -SPACING[b] } else { SPACING[b] };
            origin[b] += if self.flip[a] { SPACING[b] * (BODY[b] - 1) as f64 } else { 0.0 };
        }
        (steps, origin)
    }

    /// 200 in the corner that is the subject's right, front and top; 10 elsewhere.
    fn voxels(&self) -> Vec<u8> {
        let dims = self.dims();
        // Right and front are the low ends of LPS, the top is the high one.
        let corner = [0, 1, 2].map(|a| if (self.to[a] == 2) == self.flip[a] { 0 } else { dims[a] - 1 });
        let mut voxels = vec![10; dims.iter().product()];
        voxels[corner[0] + dims[0] * (corner[1] + dims[1] * corner[2])] = 200;
        voxels
    }

    fn nrrd(&self) -> Vec<u8> {
        let (steps, [x, y, z]) = self.geometry();
        let [nx, ny, nz] = self.dims();
        let directions: Vec<String> = steps.iter().map(|[x, y, z]| format!("({x},{y},{z})")).collect();
        let head = format!(
            "NRRD0005\ntype: uchar\ndimension: 3\nsizes: {nx} {ny} {nz}\nencoding: raw\nspace: left-posterior-superior\nspace directions: {}\nspace origin: ({x},{y},{z})\n\n",
            directions.join(" ")
        );
        [head.into_bytes(), self.voxels()].concat()
    }

    fn nifti(&self) -> Vec<u8> {
        let (steps, origin) = self.geometry();
        let mut head = vec![0u8; 352];
        let mut put = |at: usize, bytes: &[u8]| head[at..at + bytes.len()].copy_from_slice(bytes);
        put(0, &348i32.to_le_bytes());
        put(40, &3i16.to_le_bytes());
        for (n, size) in self.dims().into_iter().chain([1; 4]).enumerate() {
            put(42 + 2 * n, &(size as i16).to_le_bytes());
        }
        put(70, &2i16.to_le_bytes());
        put(72, &8i16.to_le_bytes());
        for n in 0..4 {
            put(76 + 4 * n, &1f32.to_le_bytes());
        }
        put(108, &352f32.to_le_bytes());
        put(254, &1i16.to_le_bytes());
        for row in 0..3 {
            // NIfTI's x points right and its y to the front.
            let sign = if row < 2 { -1.0 } else { 1.0 };
            let numbers = [steps[0][row], steps[1][row], steps[2][row], origin[row]];
            for (n, x) in numbers.into_iter().enumerate() {
                put(280 + 16 * row + 4 * n, &((sign * x) as f32).to_le_bytes());
            }
        }
        put(344, b"n+1\0");
        [head, self.voxels()].concat()
    }
}

#[test]
fn a_marked_corner_is_found_however_a_file_lies_in_the_body() {
    let dir = tempfile::tempdir().unwrap();
    for lie in Lie::all() {
        for (name, bytes) in [("a.nrrd", lie.nrrd()), ("a.nii", lie.nifti())] {
            fs::write(dir.path().join(name), bytes).unwrap();
            let volume = Volume::open(dir.path().join(name)).unwrap();
            let grid = volume.grid();
            // The layer at the subject's top, front, right; and the opposite one. Marked is the picture's upper left.
            for (orientation, near, size) in [
                (Orientation::Axial, 1.0 - 0.5 / 5.0, (30, 60)),
                (Orientation::Coronal, 1.0 - 0.5 / 4.0, (30, 100)),
                (Orientation::Sagittal, 0.5 / 3.0, (60, 100)),
            ] {
                let frame = Frame::new(grid, orientation).unwrap();
                for (share, marked) in [(near, true), (1.0 - near, false)] {
                    let sheet = Sheet::new(grid, orientation, vec![frame.offset_at(grid, share)]).unwrap().with_filter(Filter::Nearest);
                    let picture = sheet.with_size(size.0, size.1).unwrap().draw(&volume).unwrap().picture;
                    let bright: Vec<(u32, u32)> = (0..size.1)
                        .flat_map(|y| (0..size.0).map(move |x| (x, y)))
                        .filter(|&(x, y)| picture.pixel(x, y)[0] > picture.pixel(size.0 - 1, size.1 - 1)[0])
                        .collect();
                    assert_eq!(!bright.is_empty(), marked, "{name} {lie:?} {orientation:?}");
                    assert!(bright.iter().all(|(x, y)| *x < 15 && *y < 20), "{name} {lie:?} {orientation:?}");
                }
            }
        }
    }
}

#[test]
fn slices_says_what_it_made() {
    let dir = tempfile::tempdir().unwrap();
    let lie = Lie { to: [0, 1, 2], flip: [false; 3] };
    fs::write(dir.path().join("a.nrrd"), lie.nrrd()).unwrap();
    let out = run(
        dir.path(),
        &["slices", "a.nrrd", "--window", "105,190", "--size", "60x40", "--index", "4", "--filter", "nearest", "-o", "a.png"],
    );
    assert!(out.status.success() && out.stdout.is_empty(), "{}", text(&out.stderr));
    assert_eq!(text(&out.stderr), "axial cut at S 38.0 mm, patient's right at the left, anterior at the top; window 105,190\n");
    let picture = Picture::open(dir.path().join("a.png")).unwrap();
    // Square pixels: three by six units in the middle of 60 x 40, beside them nothing.
    assert_eq!((picture.width(), picture.height(), picture.pixel(5, 5)), (60, 40, [0.0; 4]));
    assert_eq!((picture.pixel(21, 1), picture.pixel(38, 38)), ([1.0; 4], [0.0, 0.0, 0.0, 1.0]));
    let out = run(
        dir.path(),
        &["slices", "a.nrrd", "--plane", "coronal", "--montage", "2x1", "-o", "m.png", "--annotate.axes", "--annotate.scale_bar"],
    );
    let said = text(&out.stderr);
    assert!(out.status.success() && said.contains("2 coronal cuts from P "), "{said}");
    let out = run(dir.path(), &["slices", "a.nrrd", "--normal", "0,-1,0", "--at", "-22", "-o", "o.png"]);
    assert!(
        text(&out.stderr).contains("oblique cut at offset -22.0 mm, patient's right at the left, superior at the top; "),
        "{}",
        text(&out.stderr)
    );
    let out = run(dir.path(), &["slices", "--volume.phantom", "shepp-logan", "--volume.size", "16", "--colors", "viridis", "-o", "-"]);
    assert!(
        out.stdout.starts_with(b"\x89PNG") && text(&out.stderr).contains("world +x to the right, -y to the top"),
        "{}",
        text(&out.stderr)
    );
}

#[test]
fn slices_refuses_in_one_line() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a.nrrd"), Lie { to: [2, 0, 1], flip: [true, false, true] }.nrrd()).unwrap();
    for (args, line) in [
        (&["--plane", "oblique"][..], "--plane oblique: give its --normal X,Y,Z"),
        (&["--normal", "0,0,0"], "--normal 0,0,0: points nowhere"),
        (&["--plane", "axial", "--normal", "1,0,0"], "--normal: is for --plane oblique, not axial"),
        (&["--normal", "1,2"], "--normal 1,2: write three numbers X,Y,Z"),
        (&["--at", "120%"], "--at 120%: write a number, or a share of the box from 0% to 100%"),
        (&["--index", "5"], "--index: layer 5: the volume has 5 along its x axis, counted from 0"),
        (&["--montage", "4by5"], "--montage 4by5: write COLUMNSxROWS, such as 4x5"),
        (&["--montage", "100x100"], "--montage 100x100: 10000 cuts, 1024 are the most"),
        (&["--window", "5,0"], "--window 5,0: centre and width must be finite, the width above 0"),
        (&["--size", "0x5"], "--size: image 0 x 5: sides must be 1 to 32768 pixels"),
        (&["--size", "9"], "--size 9: write WIDTHxHEIGHT, such as 800x600"),
        (&["--background", "2,0,0"], "--background: 2 is outside [0,1]"),
        (&["-o", "a.npy", "--annotate.axes"], "annotate: a .npy file holds numbers"),
    ] {
        let out = run(dir.path(), &[&["slices", "a.nrrd"], args].concat());
        let said = text(&out.stderr);
        assert!(!out.status.success() && said.lines().count() == 1, "{args:?}: {said}");
        assert!(said.starts_with(&format!("error: {line}")), "{args:?}: {said}");
    }
    assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
}

#[test]
fn annotations_are_drawn_when_asked_for_and_change_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let scene = "[volume]\nphantom = \"shepp-logan\"\nsize = 16\n[image]\nwidth = 256\nheight = 256\nbackground = [0, 0, 0, 1]\n[slices]\ncount = 32\n";
    fs::write(dir.path().join("plain.toml"), scene).unwrap();
    fs::write(dir.path().join("all.toml"), format!("{scene}[annotate]\ncolorbar = true\naxes = true\nbox = true\ntitle = \"Phantom\"\n"))
        .unwrap();
    let make = |args: &[&str]| {
        let out = run(dir.path(), &[&["render"], args].concat());
        assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    };
    make(&["plain.toml", "-o", "plain.png", "--stats", "plain.json"]);
    make(&["all.toml", "-o", "all.png", "--stats", "all.json"]);
    make(&[
        "plain.toml",
        "-o",
        "flags.png",
        "--annotate.colorbar",
        "--annotate.box",
        "true",
        "--annotate.title",
        "Phantom",
        "--annotate.axes",
    ]);
    make(&[
        "all.toml",
        "-o",
        "off.png",
        "--annotate.colorbar",
        "false",
        "--annotate.axes=false",
        "--annotate.box",
        "false",
        "--annotate.title",
        "",
    ]);
    let bytes = |name: &str| fs::read(dir.path().join(name)).unwrap();
    assert_eq!(bytes("all.png"), bytes("flags.png"));
    assert_eq!(bytes("plain.png"), bytes("off.png"));
    assert_ne!(bytes("plain.png"), bytes("all.png"));
    // Statistics tell the hash of what was rendered.
    let hash = |name: &str| serde_json::from_slice::<serde_json::Value>(&bytes(name)).unwrap()["sha256"].clone();
    assert_eq!(hash("plain.json"), hash("all.json"));
    // The same ink on other encodings.
    make(&["all.toml", "-o", "all.exr"]);
    let (png, exr) = (Picture::open(dir.path().join("all.png")).unwrap(), Picture::open(dir.path().join("all.exr")).unwrap());
    let most = png.pixels().iter().zip(exr.pixels()).flat_map(|(a, b)| (0..4).map(move |c| (a[c] - b[c]).abs())).fold(0.0, f32::max);
    assert!(most <= 0.5001 / 255.0, "{most}");
    let out = run(dir.path(), &["render", "all.toml", "-o", "all.npy"]);
    assert_eq!((out.status.code(), text(&out.stderr).lines().count()), (Some(2), 1), "{}", text(&out.stderr));
    let out = run(dir.path(), &["render", "plain.toml", "--annotate.scalebar"]);
    assert!(text(&out.stderr).contains("annotate.scale_bar"), "{}", text(&out.stderr));
}
