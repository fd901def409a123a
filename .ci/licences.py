#!/usr/bin/env python3
"""Every crate that Cargo.lock names must be free to use under one of the licences below.

Reads `cargo metadata --format-version 1 --locked` from standard input.
"""
import json
import re
import sys

ALLOWED = {
    "0BSD",
    "Apache-2.0",
    "Apache-2.0 WITH LLVM-exception",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "MIT-0",
    "Unicode-3.0",
    "Unlicense",
    "Zlib",
    "bzip2-1.0.6",
}


def allowed(expression):
    """Whether an SPDX expression can be met with allowed licences alone. "/" is the old way to write OR."""
    tokens = re.findall(r"\(|\)|[^\s()]+", expression.replace("/", " OR "))
    at = 0

    def peek():
        return tokens[at] if at < len(tokens) else None

    def take():
        nonlocal at
        at += 1
        return tokens[at - 1]

    def either():
        result = both()
        while peek() == "OR":
            take()
            result = both() or result
        return result

    def both():
        result = one()
        while peek() == "AND":
            take()
            result = one() and result
        return result

    def one():
        name = take()
        if name == "(":
            result = either()
            if peek() != ")":
                raise ValueError(f"no closing bracket in {expression}")
            take()
            return result
        if peek() == "WITH":
            take()
            name = f"{name} WITH {take()}"
        return name in ALLOWED

    result = either()
    if at != len(tokens):
        raise ValueError(f"cannot read licence {expression}")
    return result


def main():
    for text, want in [
        ("MIT", True), ("GPL-3.0", False), ("MIT OR GPL-3.0", True), ("MIT AND GPL-3.0", False), ("GPL-2.0/MIT", True),
        ("(GPL-3.0 OR MIT) AND Zlib", True), ("GPL-3.0 OR MIT AND MPL-2.0", False), ("Apache-2.0 WITH LLVM-exception", True),
        ("GPL-3.0 WITH LLVM-exception", False),
    ]:
        if allowed(text) != want:
            sys.exit(f"licences.py: {text} must be {'allowed' if want else 'refused'}")
    packages = json.load(sys.stdin)["packages"]
    refused = [p for p in packages if not p["license"] or not allowed(p["license"])]
    for p in refused:
        print(f"{p['name']} {p['version']}: licence {p['license']} is not on the list")
    print(f"{len(packages)} crates, {len(refused)} refused")
    sys.exit(1 if refused or len(packages) < 2 else 0)


main()
