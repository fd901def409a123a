#!/usr/bin/env python3
"""No crate that Cargo.lock names has been withdrawn (yanked) from the registry: that is how authors warn of a version with a grave fault.

Reads the registry's index over the network. Exit status 1 where a version is withdrawn or unknown, 3 where the index cannot be reached.
"""
import concurrent.futures
import json
import pathlib
import re
import sys
import urllib.error
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parent.parent
INDEX = "https://index.crates.io"


def locked():
    text = (ROOT / "Cargo.lock").read_text()
    pattern = re.compile(r'name = "(?P<name>[^"]+)"\nversion = "(?P<version>[^"]+)"\nsource = "registry')
    return sorted({(m["name"], m["version"]) for m in pattern.finditer(text)})


def place(name):
    """Where the index keeps a crate: folders by the length and the first letters of its name."""
    low = name.lower()
    folder = {1: "1", 2: "2", 3: f"3/{low[0]}"}.get(len(low), f"{low[:2]}/{low[2:4]}")
    return f"{INDEX}/{folder}/{low}"


def look(entry):
    name, version = entry
    for attempt in (1, 2, 3):
        try:
            with urllib.request.urlopen(place(name), timeout=20) as answer:
                lines = answer.read().decode().splitlines()
            break
        except urllib.error.HTTPError as error:
            return f"{name} {version}: the registry says {error.code}" if error.code == 404 else None
        except OSError:
            if attempt == 3:
                return None
    found = [v for v in map(json.loads, lines) if v["vers"].split("+")[0] == version.split("+")[0]]
    if not found:
        return f"{name} {version}: the registry has no such version"
    return f"{name} {version}: withdrawn by its authors" if found[0]["yanked"] else ""


def main():
    crates = locked()
    assert len(crates) > 50, f"{len(crates)} crates in Cargo.lock"
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        said = list(pool.map(look, crates))
    if None in said:
        print(f"{said.count(None)} of {len(crates)} crates could not be looked up in the registry", file=sys.stderr)
        sys.exit(3)
    faults = [s for s in said if s]
    for fault in faults:
        print(fault, file=sys.stderr)
    if faults:
        sys.exit(1)
    print(f"{len(crates)} crates, none withdrawn")


if __name__ == "__main__":
    main()
