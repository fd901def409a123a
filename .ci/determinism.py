#!/usr/bin/env python3
"""The same scene gives the same bytes, whoever renders it and however.

usage: determinism.py --full PROGRAM [--full PROGRAM ...] [--brief COMMAND ...] [SCENE.toml ...]
  --full   a slicestack that renders every scene with every combination of threads, tile size and vector level
  --brief  a slow one, such as "qemu-aarch64 target/.../slicestack": every scene with every
           vector level it has, on one thread and on three
Scenes default to scenes/*.toml beside this file and one of a volume of each voxel type, made here. The first --full program's first picture is what the others must match.
"""
import argparse
import ast
import hashlib
import json
import pathlib
import shlex
import struct
import subprocess
import sys
import tempfile
import time

LEVELS = ["scalar", "wide", "sse2", "avx2", "avx512", "neon"]
ALWAYS = {"scalar", "wide"}
THREADS = [1, 2, 3, 8]
TILES = [8, 13, 16, 64]
SECONDS = 300


# Voxel type, format of Python's struct module, what the formula's 0 to 1000 are multiplied with and shifted by.
TYPES = [
    ("u8", "B", 0.25, 0),
    ("i8", "b", 0.25, -125),
    ("u16", "H", 60, 1000),
    ("i16", "h", 3, -1000),
    ("u32", "I", 4_000_000, 7),
    ("i32", "i", 4_000_000, -2_000_000_000),
    ("f32", "f", 1.7e-5, 0.0),
    ("f64", "d", 1e-30, 1.0e-28),
]
TYPED_SCENE = """
[volume]
path = "{path}"
dimensions = [19, 23, 14]
type = "{kind}"
spacing = [1.0, 0.75, 1.5]

[camera]
azimuth = 35.0
elevation = -20.0
projection = "{projection}"

[image]
width = {width}
height = 45

[transfer]
color = [[{low}, 0.2, 0.3, 0.9], [{middle}, 0.9, 0.4, 0.2], [{high}, 1.0, 1.0, 0.8]]
opacity = [[{low}, 0.0], [{middle}, 0.2], [{high}, 0.5]]

[slices]
{slices}
"""


class Failure(Exception):
    """The check cannot go on, or did not hold."""


class Program:
    def __init__(self, command, brief):
        self.command, self.brief = command, brief
        self.levels = []

    def run(self, scene, flags, folder):
        """Renders and returns (exit status, error text, statistics, path of the pixels)."""
        out, stats = folder / "picture.npy", folder / "statistics.json"
        for old in (out, stats):
            old.unlink(missing_ok=True)
        call = [*self.command, "render", str(scene), "-o", str(out), "--stats", str(stats), *map(str, flags)]
        try:
            done = subprocess.run(call, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS)
        except subprocess.TimeoutExpired as e:
            raise Failure(f"{shlex.join(call)}: not done after {SECONDS} s") from e
        if done.returncode != 0:
            return done.returncode, done.stderr.strip(), None, out
        return 0, "", json.loads(stats.read_text()), out

    def render(self, scene, flags, folder):
        """The statistics of a picture that must succeed, checked against the file of pixels."""
        status, error, stats, out = self.run(scene, flags, folder)
        if status != 0:
            raise Failure(f"{self}: {scene.name} {' '.join(map(str, flags))}: exit status {status}: {error}")
        pixels = read_npy(out)
        found = hashlib.sha256(pixels).hexdigest()
        if found != stats["sha256"]:
            raise Failure(f"{self}: {scene.name}: the statistics say sha256 {stats['sha256']}, the pixels written have {found}")
        return stats, pixels

    def find_levels(self, scene, folder):
        """Asks for every vector level there is; those refused are not this machine's."""
        for level in LEVELS:
            status, error, stats, _ = self.run(scene, ["--simd", level], folder)
            if status == 0:
                if stats["simd"] != level:
                    raise Failure(f"{self}: asked for --simd {level}, rendered with {stats['simd']}")
                self.levels.append(level)
            elif status in (1, 2) and level in error and level not in ALWAYS:
                print(f"  {self}: no {level} here: {error.splitlines()[0]}")
            else:
                raise Failure(f"{self}: --simd {level}: exit status {status}: {error}")
        best = self.render(scene, [], folder)[0]["simd"]
        if best not in self.levels:
            raise Failure(f"{self}: chooses level {best} by itself, which is none of {', '.join(self.levels)}")
        print(f"  {self}: levels {', '.join(self.levels)}; by itself {best}")

    def settings(self):
        """Every list of flags to render a scene with."""
        yield []
        if self.brief:
            yield from (["--threads", t, "--tile", 13, "--simd", s] for s in self.levels for t in (1, 3))
        else:
            yield from (["--threads", t, "--tile", n, "--simd", s] for s in self.levels for t in THREADS for n in TILES)

    def __str__(self):
        return " ".join(pathlib.Path(c).name if "/" in c and "=" not in c else c for c in self.command)


def read_npy(path):
    """The bytes of the pixels in a .npy file of shape (height, width, 4), f32, little-endian."""
    data = path.read_bytes()
    if data[:6] != b"\x93NUMPY":
        raise Failure(f"{path.name}: not a .npy file")
    start = 10 + struct.unpack_from("<H", data, 8)[0] if data[6] == 1 else 12 + struct.unpack_from("<I", data, 8)[0]
    header = ast.literal_eval(data[10 if data[6] == 1 else 12 : start].decode("latin-1").strip())
    shape = header["shape"]
    if header["descr"] != "<f4" or header["fortran_order"] or len(shape) != 3 or shape[2] != 4:
        raise Failure(f"{path.name}: {header}, expected C-ordered <f4 of shape (height, width, 4)")
    pixels = data[start:]
    if len(pixels) != shape[0] * shape[1] * 16:
        raise Failure(f"{path.name}: {len(pixels)} bytes of pixels for shape {shape}")
    return pixels


def typed_scenes(folder):
    """Writes a raw volume of every voxel type and a scene of it, half of them with the slices that a tolerance asks for."""
    centre = [(9, 11, 5), (5, 6, 9), (14, 15, 10)]
    cells = [(x, y, z) for z in range(14) for y in range(23) for x in range(19)]
    numbers = [sum(3000 // (3 + sum((a - b) ** 2 for a, b in zip(c, cell))) for c in centre) % 1001 for cell in cells]
    for i, (kind, letter, gain, bias) in enumerate(TYPES):
        values = [n * gain + bias for n in numbers]
        if letter not in "fd":
            values = [int(v) for v in values]
        (folder / f"{kind}.raw").write_bytes(struct.pack(f"<{len(values)}{letter}", *values))
        low, high = float(min(values)), float(max(values))
        scene = folder / f"{kind}.toml"
        scene.write_text(
            TYPED_SCENE.format(
                path=f"{kind}.raw", kind=kind, low=low, middle=low + (high - low) * 0.3, high=high, width=40 + i,
                projection="perspective" if i % 2 else "orthographic", slices="tolerance = 0.004" if i % 4 < 2 else "count = 51",
            )
        )
        yield scene


def worth_comparing(scene, stats, pixels):
    """A picture in which nothing was drawn would agree with every other one."""
    colours = {pixels[i : i + 16] for i in range(0, len(pixels), 16)}
    if stats["fragments"] <= 0 or len(colours) < 100:
        raise Failure(f"{scene.name}: {stats['fragments']} fragments, {len(colours)} different pixels: nothing to compare")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--full", action="append", required=True)
    parser.add_argument("--brief", action="append", default=[])
    parser.add_argument("scene", nargs="*", type=pathlib.Path)
    args = parser.parse_args()
    scenes = args.scene or sorted((pathlib.Path(__file__).resolve().parent / "scenes").glob("*.toml"))
    if not scenes:
        raise Failure("no scenes")
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        if not args.scene:
            scenes += typed_scenes(folder)
        return compare(args, scenes, folder)


def compare(args, scenes, folder):
    """Renders all scenes with all programs in all ways; the exit status."""
    programs = [Program(shlex.split(c), False) for c in args.full] + [Program(shlex.split(c), True) for c in args.brief]
    differences, expected, pictures = [], {}, 0
    for program in programs:
        program.find_levels(scenes[0], folder)
    for program in programs:
        begun = time.monotonic()
        for scene in scenes:
            for flags in program.settings():
                stats, pixels = program.render(scene, flags, folder)
                pictures += 1
                if scene not in expected:
                    worth_comparing(scene, stats, pixels)
                    expected[scene] = stats["sha256"]
                    print(f"  {scene.name:22} {stats['sha256']}")
                elif stats["sha256"] != expected[scene]:
                    differences.append(f"{program}: {scene.name} {' '.join(map(str, flags))}: {stats['sha256']}")
        print(f"  {program}: {time.monotonic() - begun:.0f} s", flush=True)
    if len(set(expected.values())) != len(scenes):
        raise Failure("two scenes gave the same picture")
    for line in differences[:40]:
        print(f"  differs: {line}")
    print(f"{pictures} pictures of {len(scenes)} scenes by {len(programs)} programs: {len(differences)} differ")
    return 1 if differences else 0


try:
    sys.exit(main())
except Failure as e:
    sys.exit(f"determinism.py: {e}")
