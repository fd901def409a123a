#!/usr/bin/env python3
"""Rules of the source that no compiler checks. Prints every breach as file:line, exit status 1 when there is one.

Among them: a room (a folder or file of src/) uses no other rooms than the table in ARCHITECTURE.md allows it, and only such as stand above
it there, so that no two rooms use each other. And docs/promises.md names, for each promise, tests and checks that exist.

usage: house.py [ROOT]            (default: the directory above this file's)
"""
import pathlib
import re
import subprocess
import sys

UNSAFE = re.compile(r"\bunsafe\b")
PLATFORM_MATH = re.compile(
    r"(?:\.|\bf(?:32|64)::)"
    r"(?:exp|exp2|exp_m1|ln|ln_1p|log|log2|log10|powf|powi|sin|cos|tan|sin_cos|asin|acos|atan|atan2"
    r"|sinh|cosh|tanh|asinh|acosh|atanh|cbrt|hypot|gamma|ln_gamma)\s*(?:\(|\)|,)"
)
FUSED = re.compile(
    r"\b(?:mul_add|mul_sub|mul_neg_add|mul_neg_sub|fma|fmaf|recip_sqrt|reduce_add)\s*(?:\(|\)|,)"
    r"|_(?:fmadd|fmsub|fnmadd|fnmsub|fmaddsub|rcp|rcp14|rsqrt|rsqrt14)_[ps][sd]\b|\bv(?:fma|fms|recpe|rsqrte)q?_"
)
GLAM_TRIG = re.compile(
    r"\bfrom_(?:axis_angle|scaled_axis|rotation_[xyz]|rotation_axis|euler|angle|scale_angle_translation)\s*\("
    r"|\bperspective(?:_infinite)?(?:_reverse)?_[lr]h(?:_gl)?\s*\(|\.(?:angle_between|angle_to|slerp|to_axis_angle|to_euler)\s*\("
)
GLAM_VECTOR = re.compile(r"\bglam::[^;]*\b(?:Vec3A|Vec4|Quat|Mat2|Mat3A|Mat4|Affine2|Affine3A)\b")
HASH_ORDER = re.compile(r"\bHash(?:Map|Set)\b")
MARKS = re.compile(r"\b(?:TODO|FIXME|XXX|HACK|TBD)\b|\b(?:todo|unimplemented|dbg)!")


def rust(path):
    return path.endswith(".rs")


def pixels(path):
    """Code that a pixel may pass through: everything but the command, the studies and files of tests alone."""
    if path.startswith(("src/cli/", "src/study/")) or path in ("src/main.rs", "src/cli.rs", "src/study.rs"):
        return False
    return path.startswith("src/") and "/tests/" not in path and not path.endswith("/tests.rs")


def lanes(path):
    return path.startswith("src/lanes/") or path == "src/lanes.rs"


def foreign(path):
    """Calls into the C libraries that tests and benches compare with, and Python's memory; never part of the crate."""
    return path in ("tests/conformance/gl.rs", "benches/peers/volpack.rs", "python/src/borrowed.rs")


# name, where it holds, pattern over code without comments and strings, what to do instead
RULES = [
    ("unsafe outside src/lanes", lambda p: not lanes(p) and not foreign(p), UNSAFE, "move it into src/lanes"),
    ("platform math", pixels, PLATFORM_MATH, "use libm: the platform's bits differ between machines"),
    ("fused or approximate math", pixels, FUSED, "round after every operation; no sum across lanes"),
    ("glam's trigonometry", pixels, GLAM_TRIG, "it calls the platform's sin and cos: build it from libm's"),
    ("glam's SIMD types", pixels, GLAM_VECTOR, "their sums run in another order on other machines: use the f64 types"),
    ("hash-map order", pixels, HASH_ORDER, "use a BTreeMap, a BTreeSet or a sorted Vec"),
]

TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|b?r(?P<h>#*)".*?"(?P=h)|b?"(?:\\.|[^"\\])*"|b?\'(?:\\[^\n\']+|\\\'|[^\\\n\'])\'',
    re.DOTALL,
)


def code_only(text):
    """The text with comments, strings and characters blanked, line breaks kept."""
    return TOKEN.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)


def breaches(path, text):
    """Every (line number, rule, hint, line) that `text`, standing at `path`, breaks."""
    found = []
    lines = text.splitlines()

    def search(name, pattern, hint, where):
        for m in pattern.finditer(where):
            number = where.count("\n", 0, m.start()) + 1
            found.append((number, name, hint, lines[number - 1].strip()))

    search("unfinished work", MARKS, "finish it or leave it out", text)
    if rust(path):
        code = code_only(text)
        for name, holds, pattern, hint in RULES:
            if holds(path):
                search(name, pattern, hint, code)
    return sorted(found)


def self_test():
    """Each rule must fire on a line that breaks it and stay silent on its lawful twin."""
    bad = [
        ("src/scene/a.rs", "fn f() { unsafe { g() } }"),
        ("python/src/volume.rs", "fn f() { unsafe { g() } }"),
        ("tests/a.rs", "unsafe fn f() {}"),
        ("tests/conformance/draw.rs", "unsafe fn f() {}"),
        ("benches/peers/vtk.rs", "unsafe fn f() {}"),
        ("src/proxy/a.rs", "let y = x.sin();"),
        ("src/proxy/a.rs", "let y = f64::exp(x);"),
        ("src/proxy/a.rs", "let y: Vec<f64> = v.iter().copied().map(f64::ln).collect();"),
        ("src/fragment/a.rs", "let y = a.mul_add(b, c);"),
        ("src/fragment/a.rs", "let y = libm::fma(a, b, c);"),
        ("src/lanes/avx2.rs", "_mm256_fmadd_ps(a, b, c)"),
        ("src/scene/a.rs", "DQuat::from_axis_angle(a, b)"),
        ("src/scene/a.rs", "use glam::{DVec3, Vec4};"),
        ("src/plan.rs", "let m: HashMap<u8, u8> = x;"),
        ("README.md", "TO" + "DO: write"),
        ("src/plan.rs", "// FIX" + "ME"),
    ]
    good = [
        ("src/lanes/avx2.rs", "unsafe { g() }"),
        ("tests/conformance/gl.rs", "unsafe { g() }"),
        ("benches/peers/volpack.rs", "unsafe { g() }"),
        ("python/src/borrowed.rs", "unsafe { g() }"),
        ("src/scene/a.rs", "#![forbid(unsafe_code)] // unsafe is forbidden"),
        ("src/proxy/a.rs", "let y = libm::sin(x); // x.sin() differs"),
        ("src/proxy/a.rs", 'let y = "x.sin()"; let z = x.sqrt().exponent(); let t: &\'a str = s;'),
        ("src/cli/a.rs", "let y = x.log10();"),
        ("src/study/a.rs", "let y = x.ln();"),
        ("src/volume/phantom/tests.rs", "let y = x.powi(2);"),
        ("src/scene/a.rs", "use glam::{DVec3, DMat4, DQuat};"),
    ]
    for path, text in bad:
        if not breaches(path, text):
            sys.exit(f"house.py: no rule fired on {path}: {text}")
    for path, text in good:
        if breaches(path, text):
            sys.exit(f"house.py: {breaches(path, text)} fired on {path}: {text}")


# ---- rooms -------------------------------------------------------------------------------------------------------------

PATH = re.compile(r"(?<![\w:])(?:crate|slicestack)::(\{|\w+)")
# Rows of the table of rooms: | `name/` or `name.rs` | ... | rooms, `-` or `all` |
ROW = re.compile(r"^\| `([a-z_]+)(/|\.rs)` \|.*\| ([^|]+) \|$")


def room_table(text):
    """{room: set of rooms it may use, or None for all of them}, top to bottom, from the text of ARCHITECTURE.md."""
    table = {}
    inside = False
    for line in text.splitlines():
        if line.startswith("## "):
            inside = line == "## Rooms"
        m = ROW.match(line) if inside else None
        if m:
            uses = m.group(3).strip()
            table[m.group(1)] = None if uses == "all" else set() if uses == "-" else {u.strip() for u in uses.split(",")}
    return table


def table_faults(table, rooms):
    """What is wrong with the table itself; `rooms` are those that the source has."""
    faults = [f"ARCHITECTURE.md: the table of rooms lacks `{r}`" for r in sorted(rooms - table.keys())]
    faults += [f"ARCHITECTURE.md: the table has a room `{r}` that src/ has not" for r in sorted(table.keys() - rooms)]
    above = set()
    for room, uses in table.items():
        for used in sorted((uses or set()) - above):
            faults.append(f"ARCHITECTURE.md: `{room}` uses `{used}`, which does not stand above it in the table")
        above.add(room)
    return faults


def room_of(path):
    return pathlib.PurePath(path).parts[1].removesuffix(".rs")


def without_tests(code):
    """The code without what stands under `#[cfg(test)]`; blanked, line breaks kept."""
    out, at = [], 0
    for m in re.finditer(r"#\[cfg\((?:all\()?test\b[^\]]*\)\]", code):
        if m.start() < at:
            continue
        # Up to the end of the item: its closing brace, or its semicolon.
        depth, end = 0, m.end()
        while end < len(code):
            c = code[end]
            end += 1
            if c == "{":
                depth += 1
            elif c == "}":
                depth -= 1
                if depth == 0:
                    break
            elif c == ";" and depth == 0:
                break
        out += [code[at : m.start()], re.sub(r"[^\n]", " ", code[m.start() : end])]
        at = end
    return "".join(out) + code[at:]


def names_used(code):
    """(line number, first name behind `crate::`) of every path in the code, groups in braces taken apart."""
    found = []
    for m in PATH.finditer(code):
        line = code.count("\n", 0, m.start()) + 1
        if m.group(1) != "{":
            found.append((line, m.group(1)))
            continue
        depth, start, i = 1, m.end(), m.end()
        while depth and i < len(code):
            c = code[i]
            depth += (c == "{") - (c == "}")
            if (c == "," and depth == 1) or depth == 0:
                name = re.match(r"\s*(\w+)", code[start:i])
                if name:
                    found.append((line, name.group(1)))
                start = i + 1
            i += 1
    return found


def flat_names(library):
    """{name: room} of what lib.rs exports flat."""
    names = {}
    for m in re.finditer(r"\bpub use (\w+)::(\{[^}]*\}|\w+);", library):
        for name in re.findall(r"\w+", m.group(2)):
            names[name] = m.group(1)
    return names


def import_breaches(path, code, table, flat):
    """Every (line number, room used) that the room of `path` may not use."""
    room = room_of(path)
    allowed = table.get(room, set())
    if allowed is None:
        return []
    found = []
    for line, name in names_used(without_tests(code)):
        used = name if name in table else flat.get(name)
        if used and used != room and used not in allowed:
            found.append((line, used))
    return found


def test_imports():
    table = room_table("## Rooms\n| `a.rs` | x | - |\n| `b/` | y | a |\n| `lib.rs` | z | all |\n## Other\n| `c/` | no | a |\n")
    flat = flat_names("pub use a::{Error, Result};")
    assert table == {"a": set(), "b": {"a"}, "lib": None}, table
    for path, code, want in [
        ("src/b/x.rs", "use crate::a::X;", []),
        ("src/b/x.rs", "use crate::{Error, b::Y};", []),
        ("src/a.rs", "use crate::b::Y;", [(1, "b")]),
        ("src/a.rs", "fn f() {\n crate::b::g() }", [(2, "b")]),
        ("src/a.rs", "use crate::{a::X,\n b::{Y, Z}};", [(1, "b")]),
        ("src/a.rs", "#[cfg(test)]\nmod tests { use crate::b::Y; }", []),
        ("src/a.rs", "#[cfg(all(test, unix))]\nuse crate::b::Y;\nfn f() { crate::b::g() }", [(3, "b")]),
        ("src/lib.rs", "use crate::b::Y;", []),
    ]:
        got = import_breaches(path, code, table, flat)
        if got != want:
            sys.exit(f"house.py: imports of {path} {code!r}: {got}, not {want}")
    wrong = {"a": {"b"}, "b": {"a"}}
    if not table_faults(wrong, {"a", "b"}) or table_faults(table, {"a", "b", "lib"}) or not table_faults(table, {"a", "b", "lib", "d"}):
        sys.exit("house.py: the table's own faults are not found")


def check_imports(root, sources):
    """Prints every arrow that the table of rooms does not have; their number."""
    table = room_table((root / "ARCHITECTURE.md").read_text(encoding="utf-8"))
    inside = [p for p in sources if p.startswith("src/") and (root / p).is_file()]
    faults = table_faults(table, {room_of(p) for p in inside})
    flat = flat_names(code_only((root / "src/lib.rs").read_text(encoding="utf-8")))
    for path in inside:
        if path.endswith("/tests.rs") or "/tests/" in path:
            continue
        code = code_only((root / path).read_text(encoding="utf-8"))
        for line, used in import_breaches(path, code, table, flat):
            faults.append(f"{path}:{line}: room `{room_of(path)}` may not use `{used}` (the table in ARCHITECTURE.md)")
    for fault in faults:
        print(fault)
    return len(faults)


# ---- promises ----------------------------------------------------------------------------------------------------------

PROMISES = "docs/promises.md"
# What holds a promise: `tests/a.rs: one_test, another` or `.ci/a.py`.
HOLDER = re.compile(r"`((?:tests|src|benches|examples|python/tests|\.ci)/[^`]*)`")
PYTHON_TEST = re.compile(r"^def (test_\w+)\(", re.MULTILINE)
TEST = re.compile(r"#\[test\]\s*((?:#\[[^\n]*\]\s*)*)(?:pub(?:\([a-z]+\))? )?fn (\w+)")


def tests_of(code):
    """Names of the tests that `cargo test` runs; those to be ignored are none of them."""
    return {name for attributes, name in TEST.findall(code_only(code)) if "ignore" not in attributes}


def promise_faults(text, read):
    """Every (line number, what is wrong) of the page of promises; `read` gives the text of a file, None where there is none."""
    faults, held = [], 0
    lines = text.splitlines()
    for number, line in enumerate(lines, 1):
        holders = HOLDER.findall(line)
        held += len(holders)
        for holder in holders:
            path, _, names = holder.partition(": ")
            code = read(path)
            if code is None:
                faults.append((number, f"there is no file {path}"))
            elif rust(path) or path.startswith("python/tests/"):
                known = tests_of(code) if rust(path) else set(PYTHON_TEST.findall(code))
                faults += [(number, f"{path} has no test `{name}` that runs") for name in names.split(", ") if name not in known]
            elif names or not path.startswith(".ci/"):
                faults.append((number, f"`{holder}` is neither a test nor a check"))
        heads = number < len(lines) and lines[number].startswith("|--")
        if line.startswith("|") and not line.startswith("|--") and not heads and not holders:
            faults.append((number, "a promise without a test or a check"))
    return faults if held else [*faults, (1, "no test is named at all")]


def test_promises():
    files = {
        "tests/a.rs": "#[test]\nfn one() {}\n#[test]\n#[ignore = \"slow\"]\nfn two() {}\nfn three() {}\n// #[test]\nfn four() {}",
        ".ci/a.py": "",
        "python/tests/test_a.py": "def test_one():\n    pass\ndef two():\n    def test_three(): pass\n",
    }
    head = "| promise | held by |\n|---|---|\n"
    for text, want in [
        (head + "| a | `tests/a.rs: one`; `.ci/a.py` |", []),
        ("Held by `tests/a.rs: one, one`.", []),
        (head + "| a | nothing |\n| b | `tests/a.rs: one` |", [3]),
        ("`tests/a.rs: one, five`, `tests/a.rs: one`", [1]),
        ("`tests/a.rs: two`", [1]),
        ("`tests/a.rs: three`\n`tests/a.rs: four`", [1, 2]),
        ("`tests/a.rs`", [1]),
        ("`tests/a.rs:one`", [1]),
        ("`tests/b.rs: one`", [1]),
        ("`.ci/b.py`", [1]),
        ("`python/tests/test_a.py: test_one`", []),
        ("`python/tests/test_a.py: test_three`", [1]),
        ("`.ci/a.py: one`", [1]),
        ("one", [1]),
    ]:
        got = promise_faults(text, files.get)
        if [number for number, _ in got] != want:
            sys.exit(f"house.py: promises {text!r}: {got}, not at lines {want}")


def check_promises(root):
    """Prints every promise whose test or check does not exist; their number."""

    def read(path):
        return (root / path).read_text(encoding="utf-8") if (root / path).is_file() else None

    text = read(PROMISES)
    faults = promise_faults(text, read) if text is not None else [(1, "there is no such page")]
    for number, fault in faults:
        print(f"{PROMISES}:{number}: {fault}")
    return len(faults)


def main():
    self_test()
    test_imports()
    test_promises()
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent.parent)
    tracked = subprocess.run(["git", "-C", root, "ls-files", "-z"], check=True, capture_output=True, text=True).stdout
    wanted = (".rs", ".toml", ".md", ".html", ".js", ".css", ".py", ".json")
    paths = [p for p in tracked.split("\0") if p.endswith(wanted) and not p.startswith(".ci/")]
    sources = [p for p in paths if rust(p)]
    if not sources:
        sys.exit(f"house.py: git lists no Rust file under {root}")
    count = 0
    for path in paths:
        if not (root / path).is_file():
            continue
        for number, name, hint, line in breaches(path, (root / path).read_text(encoding="utf-8")):
            print(f"{path}:{number}: {name} ({hint}): {line[:120]}")
            count += 1
    count += check_imports(root, sources)
    count += check_promises(root)
    print(f"{len(paths)} files read, {len(sources)} of them Rust: {count} breaches")
    sys.exit(1 if count else 0)


main()
