#!/usr/bin/env python3
"""Makes the archive of a release, twice, and fails where the two are not the same bytes.

The archive holds the command, its manual pages, completions for five shells, the licences, README, CHANGELOG and SHA256SUMS. Nothing in it depends on
when or where it was made: times are that of the last commit, names are sorted, folders of the build are cut out of the command.

usage: release.py [--out DIR] [--once]

  --out    where the archive goes, and its SHA-256 beside it (default: target/release-archive)
  --once   build once, and compare nothing
"""
import argparse
import gzip
import hashlib
import io
import os
import pathlib
import re
import subprocess
import sys
import tarfile
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
SHELLS = {"bash": "slicestack.bash", "zsh": "_slicestack", "fish": "slicestack.fish", "powershell": "_slicestack.ps1", "elvish": "slicestack.elv"}
TEXTS = ["README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE", "SECURITY.md"]


def run(*words, **more):
    done = subprocess.run([str(w) for w in words], capture_output=True, cwd=more.pop("cwd", ROOT), **more)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(w) for w in words)}: {done.stderr.decode(errors='replace').strip()}")
    return done.stdout


def built(target):
    """The command, built in `target`."""
    home = pathlib.Path(os.environ.get("CARGO_HOME", pathlib.Path.home() / ".cargo"))
    flags = [f"--remap-path-prefix={a}={b}" for a, b in ((ROOT, "slicestack"), (home, "cargo"), (pathlib.Path.home(), "home"))]
    environment = {k: v for k, v in os.environ.items() if k not in ("RUSTFLAGS", "CARGO_TARGET_DIR", "CARGO_BUILD_TARGET")}
    environment |= {"CARGO_ENCODED_RUSTFLAGS": "\x1f".join(flags), "CARGO_INCREMENTAL": "0", "CARGO_PROFILE_RELEASE_DEBUG": "0", "CARGO_PROFILE_RELEASE_STRIP": "symbols"}
    run("cargo", "build", "--release", "--locked", "--bin", "slicestack", "--target-dir", target, env=environment)
    return pathlib.Path(target, "release", "slicestack")


def files(command):
    """What goes into the archive: bytes by name, and which of them is a program."""
    all = {"slicestack": command.read_bytes()}
    for shell, name in SHELLS.items():
        all[f"completions/{name}"] = run(command, "completions", shell)
    with tempfile.TemporaryDirectory() as folder:
        run(command, "manual", folder)
        for page in sorted(pathlib.Path(folder).iterdir()):
            all[f"man/man1/{page.name}"] = page.read_bytes()
    for name in TEXTS:
        all[name] = (ROOT / name).read_bytes()
    all["SHA256SUMS"] = "".join(f"{hashlib.sha256(data).hexdigest()}  {name}\n" for name, data in sorted(all.items())).encode()
    return all


def archive(top, all, time):
    packed = io.BytesIO()
    with gzip.GzipFile(fileobj=packed, mode="wb", filename="", mtime=time, compresslevel=9) as out:
        with tarfile.open(fileobj=out, mode="w", format=tarfile.USTAR_FORMAT) as tar:
            for name, data in sorted(all.items()):
                entry = tarfile.TarInfo(f"{top}/{name}")
                entry.size, entry.mtime, entry.mode = len(data), time, 0o755 if name == "slicestack" else 0o644
                tar.addfile(entry, io.BytesIO(data))
    return packed.getvalue()


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1])
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "target" / "release-archive")
    parser.add_argument("--once", action="store_true")
    args = parser.parse_args()
    version = re.search(r'^version = "(.*)"', (ROOT / "Cargo.toml").read_text(), re.M).group(1)
    host = re.search(r"^host: (.*)", run("rustc", "-vV").decode(), re.M).group(1)
    time = int(run("git", "log", "-1", "--format=%ct"))
    top = f"slicestack-{version}-{host}"
    made = []
    for n in range(1 if args.once else 2):
        all = files(built(ROOT / "target" / f"release-{n + 1}"))
        made.append((all, archive(top, all, time)))
    if not args.once and made[0][1] != made[1][1]:
        apart = [name for name in made[0][0] if made[0][0][name] != made[1][0].get(name)]
        sys.exit(f"two builds differ: {', '.join(apart) or 'in their order'}")
    # What it says of itself is so.
    all, data = made[0]
    for line in all["SHA256SUMS"].decode().splitlines():
        digest, name = line.split("  ")
        assert hashlib.sha256(all[name]).hexdigest() == digest, name
    pages = [name for name in all if name.startswith("man/")]
    assert len(pages) > 15 and all["man/man1/slicestack.1"].startswith(b".ie"), pages
    args.out.mkdir(parents=True, exist_ok=True)
    path = args.out / f"{top}.tar.gz"
    path.write_bytes(data)
    (args.out / f"{path.name}.sha256").write_text(f"{hashlib.sha256(data).hexdigest()}  {path.name}\n")
    again = "" if args.once else ", the same bytes from two builds"
    print(f"{path}: {len(data)} bytes, {len(all)} files, {len(pages)} manual pages{again}")


if __name__ == "__main__":
    main()
