#!/usr/bin/env python3
"""Looks at the machine code of the stages: the levels avx2 and avx512 of a default release build compute in ymm and zmm registers and call nothing.

usage: vectors.py [PROGRAM]        (default: target/release/examples/instructions, which `cargo test --release` builds)

The program tells where the stages of its scenes' plans are, so that no list here has to follow them. Prints a line for each, exit status 1
when one has no such instruction, or too many on single numbers, or calls a function other than the ones that end the program.
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
ENDS = re.compile(
    r"core9panicking|core\d*6option|5slice5index|panic_bounds_check|slice_(start|end)?_?index|unreachable|expect_failed|something_went_wrong"
)
# One number at a time: constants of a batch, and hardly more. A stage that only moves numbers has none of these, and no packed ones either.
SHARE = 8
SINGLE = re.compile(r"^v(add|sub|mul|div|min|max|sqrt|cmp\w*|ucomi|comi)s[sd]$")


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


def got(program):
    """What the entries of the global offset table lead to: {address of the entry: symbol, or its address in hexadecimal}"""
    found = {}
    for line in output("objdump", "-R", program).splitlines():
        if m := re.match(r"^([0-9a-f]+) R_X86_64_\w+\s+(?:\*ABS\*\+0x)?(\S+)$", line):
            found[int(m.group(1), 16)] = m.group(2)
    return found


def walk(start, code, table):
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
                if m := re.search(r"# ([0-9a-f]+) <", operands):
                    name = table.get(int(m.group(1), 16), operands)
                    if re.fullmatch(r"[0-9a-f]+", name) and int(name, 16) in code:
                        name = code[int(name, 16)][0]
                if not ENDS.search(name):
                    calls.add(name)
    return body, sorted(calls)


def stages(program, level, shift_of):
    """{(stage, address): cases}, in the order of the plan's lists."""
    told = [line.split() for line in output(program, "stages", level).splitlines()]
    if told[0][:2] != ["-", "mark"]:
        fail(f"not understood: {told[0]}")
    shift = shift_of(int(told[0][2], 16))
    found = {}
    for case, stage, address in told[1:]:
        found.setdefault((stage, int(address, 16) - shift), []).append(case)
    return found


def main():
    program = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else PROGRAM
    if not program.is_file():
        fail(f"{program} is not there: cargo build --release --example instructions")
    static = [line.split()[0] for line in output("nm", program).splitlines() if "instructions4mark" in line]
    if len(static) != 1:
        fail(f"no one symbol for mark(): {static}")
    shift_of = lambda mark: mark - int(static[0], 16)
    code, table = functions(program), got(program)
    # The same look must not find what is not there: the scalar level is compiled for processors without these registers.
    for stage, address in stages(program, "scalar", shift_of):
        if any("%ymm" in operands for _, operands in walk(address, code, table)[0]):
            fail(f"{stage} of the level scalar has ymm registers: it is not what was looked at")
    looked = [look(program, level, shift_of, code, table) for level in ["avx2", "avx512"] if knows(program, level)]
    if not looked:
        fail("this machine has no avx2: nothing was looked at")
    print("; ".join(looked))


def knows(program, level):
    """Whether the program and this machine have a level."""
    return subprocess.run([str(program), "stages", level], capture_output=True).returncode == 0


def look(program, level, shift_of, code, table):
    """A line that says what was found at a level."""
    found = stages(program, level, shift_of)
    bad, zmm = [], 0
    print(f"{level:10}{'instructions':>13}{'in ymm':>8}{'in zmm':>8}{'computing':>10}{'share':>7}{'single':>8}  first in")
    for (stage, address), cases in sorted(found.items()):
        if address not in code:
            fail(f"{stage} of {cases[0]}: no function at {address:x}")
        body, calls = walk(address, code, table)
        in_zmm = sum(1 for _, operands in body if "%zmm" in operands)
        wide = [mnemonic for mnemonic, operands in body if "%ymm" in operands or "%zmm" in operands]
        packed = sum(1 for mnemonic in wide if PACKED.match(mnemonic))
        single = sum(1 for mnemonic, _ in body if SINGLE.match(mnemonic))
        zmm += in_zmm
        print(
            f"{stage:10}{len(body):13}{len(wide) - in_zmm:8}{in_zmm:8}{packed:10}{packed / len(body):7.0%}{single:8}  {cases[0]}"
            + "".join("  calls " + c for c in calls)
        )
        if not wide or single * SHARE > packed:
            bad.append(f"{level}: {stage} of {cases[0]} has {len(wide)} wide instructions, {packed} computing, and {single} on single numbers")
        bad += [f"{level}: {stage} of {cases[0]} calls {c}" for c in calls]
    if len(found) < 8:
        fail(f"{len(found)} stages only")
    if bad:
        fail("; ".join(bad))
    if (zmm > 0) != (level == "avx512"):
        fail(f"{level}: {zmm} instructions in zmm registers")
    return f"{level}: {len(found)} stages, all in wide registers"


main()
