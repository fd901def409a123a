#!/usr/bin/env python3
"""Runs the fuzz targets under libFuzzer, guided by the code they reach, on the stable toolchain without sanitizers.

Needs cargo-fuzz (`cargo install cargo-fuzz --locked`) and a C++ compiler. What is found lies in fuzz/artifacts; new inputs of the corpus in
fuzz/corpus-grown, which is not kept. Exit status 1 where a target fails.

usage: fuzz.py [--seconds N] [--targets LIST] [--jobs N] [--write]

  --seconds   for each target (default: 60)
  --targets   names, separated by commas (default: all)
  --jobs      targets that run at a time (default: 2)
  --write     put the figures into docs/fuzzing.md
"""
import argparse
import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
FUZZ = ROOT / "fuzz"
PAGE = ROOT / "docs" / "fuzzing.md"
BEGIN, END = "<!-- figures: .ci/fuzz.py --write -->", "<!-- end of figures -->"


def targets():
    return [bin["name"] for bin in tomllib.loads((FUZZ / "Cargo.toml").read_text())["bin"]]


def cargo(*words):
    environment = {**os.environ, "PATH": f"{ROOT}/target/tools/bin:{os.environ['PATH']}"}
    return subprocess.run(["cargo", "fuzz", *words], cwd=ROOT, env=environment, capture_output=True, text=True)


def run(name, seconds):
    """Executions, code reached, how it ended."""
    grown = FUZZ / "corpus-grown" / name
    grown.mkdir(parents=True, exist_ok=True)
    done = cargo("run", "-s", "none", name, str(grown), str(FUZZ / "corpus" / name), "--", f"-max_total_time={seconds}", "-max_len=16384", "-timeout=30", "-rss_limit_mb=2048", "-print_final_stats=1")
    text = done.stderr
    executed = re.search(r"stat::number_of_executed_units:\s+(\d+)", text)
    reached = re.findall(r"cov: (\d+) ft: (\d+)", text)
    cov, features = map(int, reached[-1]) if reached else (0, 0)
    fault = "" if done.returncode == 0 else next((l for l in text.splitlines() if "panicked at" in l or "ERROR:" in l or "error" in l), f"exit status {done.returncode}")
    detail = "" if done.returncode == 0 else "\n".join(text.splitlines()[-60:])
    return name, int(executed.group(1)) if executed else 0, cov, features, fault, detail


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1])
    parser.add_argument("--seconds", type=int, default=60)
    parser.add_argument("--targets", default=",".join(targets()))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    names = args.targets.split(",")
    if unknown := set(names) - set(targets()):
        sys.exit(f"no target {', '.join(sorted(unknown))}; there are {', '.join(targets())}")
    built = cargo("build", "-s", "none")
    if built.returncode != 0:
        sys.exit(built.stderr[-3000:])
    with concurrent.futures.ThreadPoolExecutor(args.jobs) as pool:
        found = list(pool.map(lambda name: run(name, args.seconds), names))
    rows = ["| target | executions | edges reached | features | found |", "|---|---:|---:|---:|---|"]
    rows += [f"| {name} | {executed:,} | {cov:,} | {features:,} | {fault or 'nothing'} |" for name, executed, cov, features, fault, _ in found]
    total = sum(f[1] for f in found)
    rows.append(f"| all | {total:,} | | | {sum(bool(f[4]) for f in found) or 'nothing'} |")
    table = "\n".join(rows)
    print(table)
    for name, *_, detail in found:
        if detail:
            print(f"\n{name}:\n{detail}", file=sys.stderr)
    if args.write:
        text = PAGE.read_text()
        before, rest = text.split(BEGIN)
        command = f"python3 .ci/fuzz.py --seconds {args.seconds} --write"
        PAGE.write_text(f"{before}{BEGIN}\n`{command}`, {args.jobs} targets at a time:\n\n{table}\n{END}{rest.split(END)[1]}")
    sys.exit(1 if any(f[4] for f in found) else 0)


if __name__ == "__main__":
    main()
