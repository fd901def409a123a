//! What goes wrong around the command: full disks, closed pipes, signals, little memory, few threads, names of all kinds. Nothing is lost, nothing
//! half-written stays, and one line tells.

#![cfg(all(feature = "cli", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test that cannot read or write its file shall stop")]

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const SLICESTACK: &str = env!("CARGO_BIN_EXE_slicestack");
/// A picture that takes no time.
const QUICK: &str = "--volume.phantom cloud --volume.size 16 --count 8";

/// Runs a line of the shell in `dir`, in which `$S` is the command.
fn shell(dir: &Path, line: &str) -> Output {
    Command::new("sh").args(["-c", line]).env("S", SLICESTACK).env("QUICK", QUICK).current_dir(dir).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Everything in `dir`, by name: contents, or what it is.
fn listing(dir: &Path) -> Vec<(String, Vec<u8>)> {
    let mut all: Vec<_> = fs::read_dir(dir)
        .unwrap()
        .map(|entry| {
            let entry = entry.unwrap();
            let kind = entry.file_type().unwrap();
            let held = if kind.is_file() { fs::read(entry.path()).unwrap() } else { format!("{kind:?}").into_bytes() };
            (entry.file_name().to_string_lossy().into_owned(), held)
        })
        .collect();
    all.sort();
    all
}

/// The line fails with `status` and one line of error that contains `says`, and leaves `dir` as it is.
fn fails(dir: &Path, line: &str, status: i32, says: &str) {
    let before = listing(dir);
    let out = shell(dir, line);
    let told = text(&out.stderr);
    assert_eq!(out.status.code(), Some(status), "{line}: {told}");
    let errors: Vec<&str> = told.lines().filter(|l| l.starts_with("error: ")).collect();
    assert!(errors.len() == 1 && errors[0].contains(says) && errors[0].chars().count() <= 400, "{line}: {told}");
    assert!(!told.contains("panicked"), "{line}: {told}");
    assert!(listing(dir) == before, "{line}: {:?}", listing(dir).iter().map(|f| f.0.clone()).collect::<Vec<_>>());
}

/// A folder with a picture of the command's own in it, `keep.png`, which may be replaced, and a volume, `v.nrrd`.
fn with_picture() -> TempDir {
    let dir = TempDir::new().unwrap();
    let header = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 32 32 32\nencoding: raw\n\n".to_vec();
    fs::write(dir.path().join("v.nrrd"), [header, (0..32 * 32 * 32).map(|i| (i % 251) as u8).collect()].concat()).unwrap();
    let out = shell(dir.path(), "$S render $QUICK -o keep.png");
    assert!(out.status.success(), "{}", text(&out.stderr));
    dir
}

#[test]
fn a_failure_of_one_result_leaves_every_earlier_file_as_it_was() {
    let dir = with_picture();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("folder")).unwrap();
    symlink("keep.png", at("link.png")).unwrap();
    for line in [
        "$S render $QUICK --azimuth 70 -o keep.png --stats /dev/full",
        "$S render $QUICK --azimuth 70 -o link.png --stats /dev/full",
        "$S render $QUICK --azimuth 70 -o keep.png --stats - >/dev/full",
        "$S render $QUICK --azimuth 70 -o new.png --aov depth --stats /dev/full",
        "$S render $QUICK --azimuth 70 -o new.png --save-scene s.toml --stats /dev/full",
        "$S render $QUICK --azimuth 70 -o /dev/full --format png",
        "$S explain $QUICK --size 24x24 -o page --frames --json /dev/full",
        "$S convert v.nrrd /dev/full --format nrrd",
        "$S convert v.nrrd - >/dev/full",
        "$S info v.nrrd >/dev/full",
        "$S presets >/dev/full",
        "$S --help >/dev/full",
        "$S render --help >/dev/full",
    ] {
        fails(dir.path(), line, 1, "No space left on device");
    }
    fails(dir.path(), "$S render $QUICK -o - >&-", 1, "stdout: is closed");
    // A reader that has gone is no error.
    let out = shell(dir.path(), "$S --help | true; $S render $QUICK -o - | head -c 8 >/dev/null; echo done");
    assert!(text(&out.stdout).contains("done") && out.stderr.is_empty(), "{}", text(&out.stderr));
}

#[test]
fn a_full_disk_or_a_limit_on_files_leaves_nothing() {
    let dir = with_picture();
    for (line, says) in [
        ("ulimit -f 1; $S render $QUICK --size 300x300 -o keep.png", "File too large"),
        ("ulimit -f 1; $S render $QUICK --size 300x300 -o new.npy", "File too large"),
        ("ulimit -f 1; $S convert v.nrrd new.nrrd", "File too large"),
        ("ulimit -f 1; $S slices v.nrrd --size 300x300 -o new.npy", "File too large"),
        ("ulimit -f 1; $S turntable $QUICK --size 200x200 --frames 8 -o new.gif", "File too large"),
        ("ulimit -f 1; $S view --export new --views 2x1 $QUICK --size 200x200", "File too large"),
    ] {
        fails(dir.path(), line, 1, says);
    }
    // A disk of its own that is full, where one may be mounted.
    fs::create_dir(dir.path().join("disk")).unwrap();
    let mounted = shell(dir.path(), "mount -t tmpfs -o size=64k none disk").status.success();
    if !mounted {
        println!("no file system may be mounted here: the full disk is left to the limit on files");
        return;
    }
    shell(dir.path(), "cp keep.png disk/keep.png");
    fails(&dir.path().join("disk"), "$S render $QUICK --size 400x400 -o keep.npy", 1, "No space left on device");
    fails(&dir.path().join("disk"), "$S render $QUICK --azimuth 9 -o keep.png --aov depth --size 200x200", 1, "No space left on device");
    assert!(shell(dir.path(), "umount disk").status.success());
}

#[test]
fn no_file_that_was_read_is_replaced_by_whatever_name() {
    let dir = with_picture();
    let at = |name: &str| dir.path().join(name);
    fs::write(at("v.raw"), vec![9; 8 * 8 * 8]).unwrap();
    fs::write(at("voxels.npy"), [b"\x93NUMPY\x01\x00".to_vec(), vec![9; 8 * 8 * 8]].concat()).unwrap();
    let header = |file: &str| format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: 8 8 8\nencoding: raw\ndata file: {file}\n");
    fs::write(at("v.nhdr"), header("v.raw")).unwrap();
    fs::write(at("w.nhdr"), header("other/far.npy")).unwrap();
    fs::create_dir(at("other")).unwrap();
    fs::hard_link(at("v.raw"), at("other/far.npy")).unwrap();
    fs::hard_link(at("v.raw"), at("hard.npy")).unwrap();
    symlink("v.raw", at("soft.npy")).unwrap();
    for line in [
        "$S convert v.nhdr hard.npy --force",
        "$S convert w.nhdr soft.npy --force",
        "$S convert w.nhdr v.raw --force",
        "$S convert v.nhdr v.nhdr --format nrrd --force",
    ] {
        fails(dir.path(), line, 2, "would overwrite");
    }
    // The name of a picture leads to the voxels, which a file in the scene's folder says.
    fs::write(at("s.toml"), "volume.path = \"w.nhdr\"\nimage.width = 16\nimage.height = 16\n").unwrap();
    fs::remove_file(at("hard.npy")).unwrap();
    fs::write(at("picture.npy"), shell(dir.path(), "$S render $QUICK -o - --format npy").stdout).unwrap();
    fs::write(at("p.nhdr"), header("picture.npy").replace("8 8 8", "8 8 36")).unwrap();
    fails(dir.path(), "$S render p.nhdr --size 16x16 -o picture.npy", 2, "would overwrite");
}

#[test]
fn permissions_stay_and_files_that_may_only_be_read_are_refused_before_the_work() {
    let dir = with_picture();
    let at = |name: &str| dir.path().join(name);
    let mode = |name: &str| fs::metadata(at(name)).unwrap().permissions().mode() & 0o777;
    fs::set_permissions(at("keep.png"), fs::Permissions::from_mode(0o640)).unwrap();
    let inode = fs::metadata(at("keep.png")).unwrap().ino();
    assert!(shell(dir.path(), "umask 077; $S render $QUICK --azimuth 9 -o keep.png").status.success());
    assert!(
        mode("keep.png") == 0o640 && fs::metadata(at("keep.png")).unwrap().ino() != inode,
        "replaced, by a file of the same permissions"
    );
    assert!(shell(dir.path(), "umask 077; $S render $QUICK -o new.png").status.success());
    assert_eq!(mode("new.png"), 0o600);
    symlink("keep.png", at("link.png")).unwrap();
    assert!(shell(dir.path(), "$S render $QUICK -o link.png").status.success());
    assert!(fs::symlink_metadata(at("link.png")).unwrap().is_symlink() && mode("keep.png") == 0o640);

    fs::set_permissions(at("keep.png"), fs::Permissions::from_mode(0o440)).unwrap();
    // A rendering of hours is not begun.
    let start = Instant::now();
    let long = "--volume.phantom cloud --size 4000x4000 --count 1000000 --slices.terminate 0";
    fails(dir.path(), &format!("$S render {long} -o keep.png"), 1, "may only be read");
    fails(dir.path(), &format!("$S render {long} -o none/keep.png"), 1, "there is no directory");
    fails(dir.path(), &format!("$S render {long} -o {}.png", "n".repeat(252)), 1, "File name too long");
    fails(dir.path(), &format!("$S render {long} -o a.png --stats {}.json", "n".repeat(251)), 1, "File name too long");
    assert!(start.elapsed() < Duration::from_secs(10), "{:?}", start.elapsed());
    // The longest name that there can be.
    let name = format!("{}.png", "n".repeat(251));
    assert!(shell(dir.path(), &format!("$S render $QUICK -o {name}")).status.success());
    assert!(at(&name).is_file());
}

#[test]
fn stderr_that_cannot_be_written_changes_nothing() {
    let dir = with_picture();
    for to in ["2>&-", "2>/dev/full"] {
        for line in
            ["$S render $QUICK --explain --repeat 2 -o a.png", "$S slices --volume.phantom cloud -o b.png", "$S convert missing a.nrrd"]
        {
            let out = shell(dir.path(), &format!("{line} {to}"));
            let wanted = i32::from(line.contains("missing"));
            assert_eq!(out.status.code(), Some(wanted), "{line} {to}");
        }
    }
}

/// Sends `signal` once `begun` says so, and waits: how long that took, and how the command ended.
fn interrupted(mut child: Child, signal: &str, begun: impl Fn() -> bool) -> (Duration, Output) {
    let start = Instant::now();
    while !begun() {
        assert!(start.elapsed() < Duration::from_secs(60), "it does not begin");
        assert!(child.try_wait().unwrap().is_none(), "it has ended: {}", text(&child.wait_with_output().unwrap().stderr));
        std::thread::sleep(Duration::from_millis(5));
    }
    let sent = Instant::now();
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let out = child.wait_with_output().unwrap();
    (sent.elapsed(), out)
}

/// Processor seconds that the process `id` has used.
fn worked(id: u32) -> f64 {
    let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    fields.get(11..13).map_or(0.0, |times| times.iter().filter_map(|t| t.parse::<f64>().ok()).sum::<f64>() / 100.0)
}

#[test]
fn signals_end_it_at_once_and_nothing_stays() {
    let dir = with_picture();
    assert!(shell(dir.path(), "mkfifo pipe.nrrd").status.success());
    let before = listing(dir.path());
    let long = "--volume.phantom cloud --volume.size 64 --size 1200x1200 --slices.count 60000 --slices.terminate 0";
    let cases = [
        ("waits for a pipe", "render pipe.nrrd -o a.png", 0.0),
        ("renders", &*format!("render {long} -o keep.png"), 0.3),
        (
            "renders in the profile opengl",
            &*format!("render {long} --render.profile opengl -o a.png").replace(" --slices.terminate 0", ""),
            0.3,
        ),
        ("writes a large array", "render --volume.phantom cloud --volume.size 16 --size 6000x6000 --count 1 -o a.npy", 0.5),
        ("compresses a large picture", "render --volume.phantom cloud --volume.size 16 --size 6000x6000 --count 1 -o a.png", 1.2),
        ("makes a volume", "render --volume.phantom hydrogen --volume.size 900 -o a.png", 0.3),
        ("makes a report", "report --volume.phantom cloud -o report", 0.5),
        ("writes pictures all around", "view --export around --volume.phantom cloud", 0.5),
    ];
    for (what, args, seconds) in cases {
        for (signal, status) in [("-INT", 130), ("-TERM", 143)] {
            let mut command = Command::new(SLICESTACK);
            command.args(args.split_whitespace()).current_dir(dir.path()).stdout(Stdio::null()).stderr(Stdio::piped());
            let child = command.spawn().unwrap();
            let (id, start) = (child.id(), Instant::now());
            let begun = || if seconds == 0.0 { start.elapsed() > Duration::from_millis(300) } else { worked(id) > seconds };
            let (took, out) = interrupted(child, signal, begun);
            assert_eq!((out.status.code(), out.status.signal()), (Some(status), None), "{what}, {signal}: {}", text(&out.stderr));
            // 0.2 s, and what a busy machine adds: other tests run beside this one.
            assert!(took < Duration::from_millis(2000), "{what}, {signal}: {took:?}");
            assert_eq!(text(&out.stderr).lines().filter(|l| l.starts_with("error: ")).collect::<Vec<_>>(), ["error: stopped"], "{what}");
            assert!(listing(dir.path()) == before, "{what}: {:?}", listing(dir.path()).iter().map(|f| f.0.clone()).collect::<Vec<_>>());
        }
    }
}

#[test]
fn little_memory_and_few_threads_are_told_in_a_line() {
    let dir = TempDir::new().unwrap();
    let cases = [
        "--volume.size 16 --count 8 -o a.png --size 1500x1500 --estimate",
        "--volume.size 16 --count 8 -o a.png --size 1500x1500 --slices.extrapolate true",
        "--volume.size 16 --count 8 -o a.png --size 1500x1500 --depth 16",
        "--volume.size 16 --count 8 -o a.exr --size 1500x1500",
        "--volume.size 16 -o a.png --size 700x700 --slices.tolerance 0.01",
        "--volume.size 160 --count 8 -o a.png --size 64x64",
    ];
    for case in cases {
        // From next to nothing until it works: wherever memory ends, the end is one line.
        let mut given = 30_000.0_f64;
        loop {
            let out = shell(dir.path(), &format!("ulimit -v {given:.0}; exec $S render --threads 2 --volume.phantom cloud {case}"));
            let told = text(&out.stderr);
            match out.status.code() {
                Some(0) => break,
                // The loader's own word, before the command begins.
                Some(127) => {}
                Some(1) => {
                    let errors = told.lines().filter(|l| l.starts_with("error: ")).count();
                    assert!(errors == 1 && told.lines().count() <= 3, "{case} in {given:.0} KiB: {told}");
                    assert_eq!(listing(dir.path()).len(), 0, "{case} in {given:.0} KiB");
                }
                other => unreachable!("{case} in {given:.0} KiB: {other:?} {:?}, {told}", out.status.signal()),
            }
            given *= 1.1;
            assert!(given < 2e6, "{case}: never enough, {told}");
        }
        for (name, _) in listing(dir.path()) {
            fs::remove_file(dir.path().join(name)).unwrap();
        }
    }
    for (line, told) in [
        ("RAYON_NUM_THREADS=999999 $S render $QUICK -o a.png", "RAYON_NUM_THREADS 999999: 512 are started"),
        ("RAYON_NUM_THREADS=99999999999999999999999 $S render $QUICK -o a.png", ""),
        ("$S render $QUICK --threads 4096 -o a.png", "--threads 4096: 512 are started"),
        ("$S render $QUICK --threads 18446744073709551615 -o a.png", "512 are started"),
    ] {
        let start = Instant::now();
        let out = shell(dir.path(), line);
        assert!(out.status.success() && text(&out.stderr).contains(told), "{line}: {}", text(&out.stderr));
        assert!(start.elapsed() < Duration::from_secs(20), "{line}: {:?}", start.elapsed());
    }
}

#[test]
fn inputs_of_any_length_take_no_more_than_their_length() {
    let dir = TempDir::new().unwrap();
    let write = |name: &str, text: String| fs::write(dir.path().join(name), text).unwrap();
    let small = "volume.phantom = \"cloud\"\nvolume.size = 16\nimage.width = 16\nimage.height = 16\nslices.count = 8\n";
    let points = |count: usize| {
        let list: Vec<String> = (0..count).map(|i| format!("[{}, {}]", i as f64 / count as f64, (i % 7) as f64 / 8.0)).collect();
        format!("{small}transfer.color = [[0, 1, 1, 1]]\ntransfer.opacity = [{}]\n", list.join(","))
    };
    write("few.toml", points(25_000));
    write("many.toml", points(100_000));
    write("clips.toml", small.to_owned() + &"[[clip]]\nnormal = [1, 0, 0]\noffset = 1\n".repeat(20_000));
    let keys: Vec<String> = (0..200_000).map(|i| format!("\"k{i}\": 1")).collect();
    write("keys.json", format!("{{\"volume\": {{\"phantom\": \"cloud\", {}}}}}", keys.join(",")));
    let took = |args: &str, ok: bool| {
        let mut child = Command::new(SLICESTACK).args(args.split(' ')).current_dir(dir.path()).stderr(Stdio::piped()).spawn().unwrap();
        let start = Instant::now();
        let mut used = 0.0;
        while child.try_wait().unwrap().is_none() {
            used = worked(child.id()).max(used);
            assert!(start.elapsed() < Duration::from_secs(120), "{args}");
            std::thread::sleep(Duration::from_millis(2));
        }
        let out = child.wait_with_output().unwrap();
        assert_eq!(out.status.success(), ok, "{args}: {}", text(&out.stderr));
        used
    };
    let (few, many) = (took("render few.toml -o a.png", true), took("render many.toml -o a.png", true));
    assert!(many < 6.0 * few + 0.5, "25000 points: {few} s, 100000: {many} s");
    let clips = took("render clips.toml -o a.png", false);
    let keys = took("render keys.json -o a.png", false);
    println!("processor seconds: 25000 points {few}, 100000 points {many}, 20000 clip planes {clips}, 200000 unknown keys {keys}");
    // A quadratic way through either takes minutes in a debug build.
    assert!(clips < 10.0 && keys < 10.0, "{clips} s, {keys} s");
}

#[test]
fn names_of_any_bytes_work_and_errors_stay_short() {
    let dir = TempDir::new().unwrap();
    let odd = OsStr::from_bytes(b"caf\xe9 \xff");
    let with = |ending: &str| {
        let mut name = odd.to_owned();
        name.push(ending);
        name
    };
    fs::write(
        dir.path().join(with(".nrrd")),
        [b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 8 8 8\nencoding: raw\n\n".to_vec(), (0..512).map(|i| (i % 251) as u8).collect()]
            .concat(),
    )
    .unwrap();
    let run = |args: &[&OsStr]| Command::new(SLICESTACK).args(args).current_dir(dir.path()).output().unwrap();
    let word = |text: &'static str| OsStr::new(text);
    let (volume, picture, header) = (with(".nrrd"), with(".png"), with(".hdr"));
    let done = |args: &[&OsStr]| {
        let out = run(args);
        assert!(out.status.success(), "{args:?}: {}", text(&out.stderr));
    };
    done(&[word("info"), &volume]);
    done(&[word("render"), &volume, word("-o"), &picture, word("--size"), word("24x24"), word("--count"), word("8")]);
    done(&[word("verify"), &picture, word("--volume"), &volume]);
    done(&[word("slices"), &volume, word("-o"), &with("-cut.png")]);
    done(&[word("convert"), &volume, &with(".nii.gz")]);
    done(&[word("render"), &with(".nii.gz"), word("-o"), &with("-2.png"), word("--size"), word("24x24"), word("--count"), word("8")]);
    done(&[word("compare"), &picture, &picture]);
    done(&[word("explain"), &volume, word("-o"), &with("-page"), word("--size"), word("24x24"), word("--count"), word("8")]);
    assert!(dir.path().join(with("-page")).join("index.html").is_file() && dir.path().join(&picture).is_file());
    // A pair of files finds its other half.
    let nifti = fs::read(dir.path().join(with(".nii.gz"))).unwrap();
    fs::write(dir.path().join(&header), b"no header").unwrap();
    assert!(!nifti.is_empty() && !run(&[word("info"), &header]).status.success());
    // A scene of such a name; and the scene of a volume of such a name, which no scene file can hold.
    fs::write(dir.path().join(with(".toml")), "volume.phantom = \"cloud\"\nvolume.size = 16\nimage.width = 16\nimage.height = 16\n")
        .unwrap();
    done(&[word("render"), &with(".toml"), word("-o"), &with("-3.png")]);
    let out =
        run(&[word("render"), &volume, word("-o"), word("a.png"), word("--save-scene"), word("a.toml"), word("--size"), word("24x24")]);
    assert_eq!(out.status.code(), Some(1), "{}", text(&out.stderr));
    assert!(text(&out.stderr).contains("not UTF-8") && !dir.path().join("a.png").exists() && !dir.path().join("a.toml").exists());
    // The longest error has both of its ends.
    let long = "x".repeat(3000);
    let out = run(&[word("render"), OsStr::new(&format!("{long}.nrrd"))]);
    let told = text(&out.stderr);
    assert!(
        told.trim_end().chars().count() <= 400 && told.starts_with("error: xxx") && told.trim_end().ends_with("(os error 36)"),
        "{told}"
    );
    let out = run(&[word("render"), word("--camera.azimuth"), OsStr::new(&long)]);
    assert!(text(&out.stderr).trim_end().chars().count() <= 400, "{}", text(&out.stderr));
}
