#!/usr/bin/env python3
"""Counts the instructions of single frames and holds them against benches/instructions.toml.

usage: instructions.py [count] [--update]   counts against the baseline; --update writes the counts into it
       instructions.py lean                 what plain scenes pay for fog, clip planes and the like: under 1 %

Frames are those of benches/instructions.rs, one thread, under valgrind's callgrind, which counts the same on a busy machine as on an idle
one. Both build what they need in target/: the example as cargo does by itself, whatever the environment says; the lean build
(--cfg slicestack_lean) in target/lean. Exit status 1 when anything is out of bounds, or when nothing could be counted.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
BASELINE = ROOT / "benches/instructions.toml"
PROGRAM = ROOT / "target/release/examples/instructions"
LEAN_DIR = ROOT / "target/lean"

# Vector level -> cases. The scalar level, which owns the pictures, is counted where every stage runs once.
CASES = {
    "avx2": [
        "dense", "half-empty", "empty", "dense-u16", "dense-f32", "shells", "head", "perspective-fog", "pre-integrated", "second-order",
        "cubic",
    ],
    "scalar": ["shells", "perspective-fog"],
}
# Of one compiler two counts of one source differ by less than 0.1 %, on a machine under load; what moves them is code that it inlines
# differently.
MARGIN = 0.02
# Another compiler makes other code of the same source.
OTHER_COMPILER = 0.15
# Plain scenes for the lean build, and what they may pay.
PLAIN = ["dense", "half-empty", "empty", "dense-u16", "dense-f32", "shells", "head"]
PAID = 0.01
# What skipping must gain: instructions of one case as a share of another's.
SHARES = [("half-empty", "dense", 0.6), ("empty", "dense", 0.1)]


def fail(text):
    sys.exit(f"instructions.py: {text}")


def run(command, **more):
    print("+", *command, flush=True)
    done = subprocess.run([str(c) for c in command], cwd=ROOT, **more)
    if done.returncode != 0:
        fail(f"exit status {done.returncode}: {' '.join(map(str, command))}")
    return done


def clean(**more):
    """The environment without what changes code."""
    drop = re.compile(r"RUSTFLAGS|CARGO_ENCODED_RUSTFLAGS|CARGO_BUILD_.*|CARGO_TARGET_.*|CARGO_PROFILE_RELEASE_(?!DEBUG).*")
    env = {k: v for k, v in os.environ.items() if not drop.fullmatch(k)}
    return {**env, "CARGO_INCREMENTAL": "0", **more}


def build():
    run(["cargo", "build", "--locked", "--release", "--example", "instructions"], env=clean())


def build_lean():
    """The lean library by cargo, its program by rustc: cargo would compile everything that the tests need first."""
    env = clean(RUSTFLAGS="--cfg slicestack_lean")
    run(["cargo", "build", "--locked", "--release", "--lib", "--no-default-features", "--target-dir", LEAN_DIR], env=env)
    program = LEAN_DIR / "instructions"
    library = LEAN_DIR / "release/libslicestack.rlib"
    run(
        ["rustc", "--edition=2024", "-Copt-level=3", "--crate-name=instructions", "benches/instructions.rs", "-o", program]
        + ["--extern", f"slicestack={library}", "-L", f"dependency={LEAN_DIR / 'release/deps'}"],
        env=env,
    )
    return program


def count(program, level, cases):
    """Instructions of one frame of each case."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "out"
        done = run(
            ["valgrind", "--tool=callgrind", "--dump-before=*instructions::mark*", f"--callgrind-out-file={out}"]
            + [program, "frames", level, *cases],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        # A dump ends where mark() begins: before the frame, behind the frame, before the next case's frame, ...
        parts = sorted(pathlib.Path(folder).glob("out.*"), key=lambda p: int(p.suffix[1:]))
        if len(parts) != 2 * len(cases):
            fail(f"{len(parts)} dumps for {len(cases)} cases: mark() was not seen\n{done.stderr}")
        totals = [int(re.search(r"^totals: (\d+)$", p.read_text(), re.M).group(1)) for p in parts]
    said = [line.split() for line in done.stdout.splitlines()]
    if [s[0] for s in said] != cases or any(s[3] != level for s in said):
        fail(f"the program rendered other cases, or at another level:\n{done.stdout}")
    frames = totals[1::2]
    if min(frames) < 10_000:
        fail(f"{min(frames)} instructions for a frame: the frame was not counted")
    return dict(zip(cases, frames))


def compiler():
    return subprocess.run(["rustc", "--version"], check=True, capture_output=True, text=True, env=clean()).stdout.strip()


def read_baseline():
    """The compiler and {level: {case: instructions}}. A subset of TOML, read by hand: Debian's smallest Python has no reader."""
    rustc, counts, level = None, {}, None
    for line in BASELINE.read_text().splitlines():
        line = line.split("#")[0].strip()
        if m := re.fullmatch(r'rustc = "(.*)"', line):
            rustc = m.group(1)
        elif m := re.fullmatch(r"\[(\w+)\]", line):
            level = counts.setdefault(m.group(1), {})
        elif m := re.fullmatch(r"([\w-]+) = ([\d_]+)", line):
            level[m.group(1)] = int(m.group(2).replace("_", ""))
        elif line:
            fail(f"{BASELINE}: not understood: {line}")
    return rustc, counts


def write_baseline(counts):
    lines = [
        "# Instructions of one frame of each case in benches/scenes, counted by callgrind on one thread, level by level.",
        "# Written by `python3 .ci/instructions.py --update`; a change that costs or saves more than the margin updates it.",
        f'rustc = "{compiler()}"',
    ]
    for level, cases in counts.items():
        lines += ["", f"[{level}]", *(f"{case} = {n:_}" for case, n in cases.items())]
    BASELINE.write_text("\n".join(lines) + "\n")
    print(f"{BASELINE.relative_to(ROOT)} written")


def held_against(counts):
    """Names of cases out of bounds."""
    rustc, baseline = read_baseline()
    used = compiler()
    margin = MARGIN
    if rustc != used:
        margin = OTHER_COMPILER
        print(f"*** NOTE: the baseline is of {rustc}, this is {used}: margin {margin:.0%} instead of {MARGIN:.0%}")
    if {k: sorted(v) for k, v in baseline.items()} != {k: sorted(v) for k, v in counts.items()}:
        fail(f"{BASELINE} lists other cases: run instructions.py --update")
    bad = []
    print(f"{'level':8}{'case':18}{'instructions':>14}{'baseline':>14}{'change':>9}")
    for level, cases in counts.items():
        for case, n in cases.items():
            change = n / baseline[level][case] - 1
            verdict = ""
            if change > margin:
                verdict = f"  MORE than {margin:.0%}"
            elif change < -margin:
                verdict = "  less: tell the baseline, instructions.py --update"
            if verdict:
                bad.append(f"{level} {case} {change:+.1%}")
            print(f"{level:8}{case:18}{n:14_}{baseline[level][case]:14_}{change:9.2%}{verdict}")
    return bad


def shares(counts):
    bad = []
    for part, whole, most in SHARES:
        share = counts["avx2"][part] / counts["avx2"][whole]
        print(f"{part} / {whole}: {share:.3f}, at most {most}")
        if share > most:
            bad.append(f"{part} costs {share:.3f} of {whole}")
    return bad


def lean():
    build()
    program = build_lean()
    # A lean build that is not lean would agree with the other one too.
    refused = subprocess.run([program, "frames", "scalar", "perspective-fog"], capture_output=True, text=True)
    if refused.returncode == 0 or "slicestack_lean" not in refused.stderr:
        fail(f"the lean build draws fog: {refused.stderr}")
    here, there = count(PROGRAM, "avx2", PLAIN), count(program, "avx2", PLAIN)
    bad = []
    print(f"{'case':18}{'default':>14}{'lean':>14}{'paid':>9}")
    for case in PLAIN:
        paid = here[case] / there[case] - 1
        print(f"{case:18}{here[case]:14_}{there[case]:14_}{paid:9.2%}")
        if paid > PAID:
            bad.append(f"{case} pays {paid:.2%} for what it does not need")
    return bad


def main():
    args = sys.argv[1:]
    if set(args) - {"count", "lean", "--update"} or args[:2] == ["lean", "--update"]:
        sys.exit(__doc__)
    if "lean" in args:
        bad = lean()
    else:
        build()
        counts = {level: count(PROGRAM, level, cases) for level, cases in CASES.items()}
        bad = shares(counts)
        if "--update" in args:
            write_baseline(counts)
        else:
            bad += held_against(counts)
    if bad:
        fail("out of bounds: " + "; ".join(bad))
    print("all within bounds")


main()
