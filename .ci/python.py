#!/usr/bin/env python3
"""Builds the Python package's wheel, installs it in an environment of its own, and tests it there: `python.py SLICESTACK`, the command to compare with.

The wheel is looked at: its size, its tag (one wheel for all versions from 3.11 on), its stubs. The tests of python/tests run from a folder
outside the source, so that it is the wheel that is imported. Exit status 3 where Python or the packages for this cannot be had.

usage: python.py COMMAND [--wheel-only [TARGET]]        (TARGET: cross-compile for it; builds and looks, does not run)
"""

import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import venv
import zipfile

# Exit status where the packages cannot be had.
ABSENT = 3
# Most bytes of a wheel.
LIMIT = 8 << 20
ROOT = pathlib.Path(__file__).resolve().parent.parent
TOOLS = ["maturin>=1.9,<2"]


def environment(folder, *packages):
    """A fresh environment with these packages; its Python, or None."""
    try:
        venv.create(folder, with_pip=True)
    except (OSError, subprocess.CalledProcessError) as e:
        print("no environment of Python can be made here:", e)
        return None
    python = os.path.join(folder, "bin", "python")
    if subprocess.run([python, "-m", "pip", "install", "--quiet", *packages]).returncode != 0:
        print("the packages cannot be had here:", *packages)
        return None
    return python


def built(python, folder, target):
    """The wheel, built into `folder`."""
    words = [python, "-m", "maturin", "build", "--release", "--locked", "--manifest-path", str(ROOT / "python/Cargo.toml"), "--out", str(folder)]
    words += ["--features", "pyo3/extension-module", "--compatibility", "linux"]
    words += ["--target", target] if target else []
    subprocess.run(words, check=True, cwd=ROOT)
    (wheel,) = pathlib.Path(folder).glob("*.whl")
    return wheel


def look_at(wheel):
    """Prints what the wheel is; the number of faults."""
    size = wheel.stat().st_size
    print(f"{wheel.name}: {size / (1 << 20):.2f} MiB, {LIMIT >> 20} are allowed")
    names = zipfile.ZipFile(wheel).namelist()
    faults = [f"{size} bytes, over the limit of {LIMIT}"] if size > LIMIT else []
    faults += [] if "-cp311-abi3-" in wheel.name else ["its tag is not that of the stable interface of 3.11"]
    wanted = ["py.typed", "_slicestack.pyi", "dask.py", "testing.py", "_slicestack.abi3.so"]
    faults += [f"lacks {name}" for name in wanted if f"slicestack/{name}" not in names]
    for fault in faults:
        print(f"{wheel.name}: {fault}")
    return len(faults)


def main():
    command, target = os.path.abspath(sys.argv[1]), None
    wheel_only = "--wheel-only" in sys.argv
    if wheel_only and sys.argv[-1] != "--wheel-only":
        target = sys.argv[-1]
    if sys.version_info < (3, 11):
        print(f"Python {sys.version.split()[0]}: the package takes 3.11 and later")
        return ABSENT
    with tempfile.TemporaryDirectory() as folder:
        python = environment(f"{folder}/tools", *TOOLS)
        if python is None:
            return ABSENT
        wheel = built(python, f"{folder}/wheels", target)
        faults = look_at(wheel)
        if faults or wheel_only:
            return min(faults, 1)
        python = environment(f"{folder}/clean", f"{wheel}[test]")
        if python is None:
            return ABSENT
        # A copy of the tests: beside the source its folder would be imported instead of the wheel.
        shutil.copytree(ROOT / "python/tests", f"{folder}/tests", ignore=shutil.ignore_patterns("__pycache__"))
        told = subprocess.run([python, "-c", "import slicestack; print(slicestack.__file__)"], check=True, capture_output=True, text=True, cwd=folder)
        print(told.stdout.strip())
        if not told.stdout.startswith(folder):
            print("that is not the wheel")
            return 1
        run = [python, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", "tests"]
        return subprocess.run(run, cwd=folder, env={**os.environ, "SLICESTACK_COMMAND": command}).returncode


sys.exit(main())
