#!/usr/bin/env python3
"""Looks at the machine code of the stages: the level avx2 of a default release build computes in ymm registers and calls nothing.

usage: vectors.py [PROGRAM]        (default: target/release/examples/instructions, which `cargo test --release` builds)

The program tells where the stages of its scenes' plans are, so that no list here has to follow them. Prints a line for each, exit status 1
when one has no packed ymm instruction, or calls a function other than the ones that end the program.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
PROGRAM = ROOT / "target/release/examples/instructions"
# Computing on eight lanes at once: floats, integers, masks, moves within and between registers.
PACKED = re.compile(r"^v(?!zero|mov|broadcast|extract|insert|perm2)\w*$")
# Where a batch's arrays are out of bounds, or a plan and its volume disagree: the end, not the way.
ENDS = re.compile(r"core9panicking|core\d*6option|5slice5index|panic_bounds_check|slice_(start|end)?_?index|unreachable|expect_failed")
# A stage that only moves numbers has few others; fewer than this, and something is not inlined or not vectorized.
LEAST = 8


def fail(text):
    sys.exit(f"vectors.py: {text}")


def output(*command):
    return subprocess.run([str(c) for c in command], check=True, capture_output=True, text=True).stdout


def functions(program):
    """{first address: (symbol, [(mnemonic, operands)])}"""
    found, body = {}, None
    head = re.compile(r"^([0-9a-f]+) <(.*)>:$")
    line_of = re.compile(r"^\s+[0-9a-f]+:\t(\S+)\s*(.*)$")
    for line in output("objdump", "-d", "--no-show-raw-insn", program).splitlines():
        if m := line_of.match(line):
            body.append((m.group(1), m.group(2)))
        elif m := head.match(line):
            body = []
            found[int(m.group(1), 16)] = (m.group(2), body)
    return found


def walk(start, code):
    """Instructions of a stage, tail calls followed, and the symbols that it calls."""
    todo, seen, body, calls = [start], set(), [], set()
    while todo:
        at = todo.pop()
        if at in seen:
            continue
        seen.add(at)
        symbol, instructions = code[at]
        for mnemonic, operands in instructions:
            body.append((mnemonic, operands))
            target = re.match(r"^([0-9a-f]+) <([^+>]*)>", operands)
            if mnemonic.startswith("j") and target and int(target.group(1), 16) in code:
                todo.append(int(target.group(1), 16))
            elif mnemonic.startswith("call"):
                name = target.group(2) if target else operands
                if not ENDS.search(name):
                    calls.add(name)
    return body, sorted(calls)


def main():
    program = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else PROGRAM
    if not program.is_file():
        fail(f"{program} is not there: cargo build --release --example instructions")
    told = [line.split() for line in output(program, "stages", "avx2").splitlines()]
    static = [line.split()[0] for line in output("nm", program).splitlines() if re.search(r"12instructions4mark17h|instructions4mark", line)]
    if told[0][:2] != ["-", "mark"] or len(static) != 1:
        fail(f"no one symbol for mark(): {told[0]}, {static}")
    shift = int(told[0][2], 16) - int(static[0], 16)
    code = functions(program)
    stages = {}
    for case, stage, address in told[1:]:
        stages.setdefault((stage, int(address, 16) - shift), []).append(case)
    bad = []
    print(f"{'stage':10}{'instructions':>13}{'packed ymm':>12}{'share':>8}  first in")
    for (stage, address), cases in sorted(stages.items()):
        if address not in code:
            fail(f"{stage} of {cases[0]}: no function at {address:x}")
        body, calls = walk(address, code)
        packed = sum(1 for mnemonic, operands in body if "%ymm" in operands and PACKED.match(mnemonic))
        print(f"{stage:10}{len(body):13}{packed:12}{packed / len(body):8.0%}  {cases[0]}{''.join('  calls ' + c for c in calls)}")
        if packed < LEAST:
            bad.append(f"{stage} of {cases[0]} has {packed} packed ymm instructions")
        bad += [f"{stage} of {cases[0]} calls {c}" for c in calls]
    if len(stages) < 8:
        fail(f"{len(stages)} stages only")
    if bad:
        fail("; ".join(bad))
    print(f"{len(stages)} stages, all in ymm registers")


main()
