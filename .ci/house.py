#!/usr/bin/env python3
"""Rules of the source that no compiler checks. Prints every breach as file:line, exit status 1 when there is one.

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
    """Calls into the C libraries that tests and benches compare with; never part of the crate."""
    return path in ("tests/conformance/gl.rs", "benches/peers/volpack.rs")


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


def main():
    self_test()
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
    print(f"{len(paths)} files read, {len(sources)} of them Rust: {count} breaches")
    sys.exit(1 if count else 0)


main()
