#!/usr/bin/env python3
"""Holds the DICOM reader against pydicom: `dicom.py SLICESTACK`, the command to test.

Every file that pydicom brings for its own tests is read with both. Where both read it, sizes, spacing, and the smallest, largest and mean
value must agree; where one does not, the table says why. A message of more than one line, a panic or a crash fails. Exit status 3 where pydicom
cannot be had.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
import venv

# Exit status where the packages cannot be had.
ABSENT = 3

PACKAGES = ["pydicom==3.0.2", "numpy", "pylibjpeg", "pylibjpeg-libjpeg", "pylibjpeg-openjpeg", "pylibjpeg-rle"]


def inside():
    """Runs this script again in an environment of its own that has the packages."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            venv.create(folder, with_pip=True)
        except (OSError, subprocess.CalledProcessError) as e:
            print("no environment of Python can be made here:", e)
            return ABSENT
        python = os.path.join(folder, "bin", "python")
        if subprocess.run([python, "-m", "pip", "install", "--quiet", *PACKAGES]).returncode != 0:
            print("the packages cannot be had here:", *PACKAGES)
            return ABSENT
        return subprocess.run([python, __file__, *sys.argv[1:], "--inside"]).returncode


def expected(path):
    """What pydicom makes of a file: sizes, spacing, and smallest, largest and mean value; None for colours."""
    import numpy
    import pydicom

    data = pydicom.dcmread(path, force=True)
    if "PixelData" not in data and "FloatPixelData" not in data and "DoubleFloatPixelData" not in data:
        raise ValueError("no pixels")
    pixels = data.pixel_array
    frames = int(data.get("NumberOfFrames") or 1)
    sizes = [int(data.Columns), int(data.Rows), frames]
    spacing = data.get("PixelSpacing") or data.get("ImagerPixelSpacing") or None
    spacing = [float(spacing[1]), float(spacing[0])] if spacing else None
    if data.get("SamplesPerPixel", 1) != 1 or data.PhotometricInterpretation == "PALETTE COLOR":
        return sizes, spacing, None
    pixels = pixels.astype(numpy.float64)
    functional = list(data.get("SharedFunctionalGroupsSequence", [])) + list(data.get("PerFrameFunctionalGroupsSequence", []))
    moved = [s.PixelValueTransformationSequence[0] for s in functional if "PixelValueTransformationSequence" in s]
    if len(moved) > 1 and len({(m.RescaleSlope, m.RescaleIntercept) for m in moved}) > 1:
        return sizes, spacing, None
    rescale = moved[0] if moved else data
    slope = rescale.get("RescaleSlope")
    slope = data.get("DoseGridScaling") if slope in (None, "") else slope
    slope = 1 if slope in (None, "") else slope
    intercept = rescale.get("RescaleIntercept")
    pixels = pixels * float(slope) + float(0 if intercept in (None, "") else intercept)
    return sizes, spacing, [float(pixels.min()), float(pixels.max()), float(pixels.mean())]


def found(command, path):
    """What the command makes of it: the same three, or its message."""
    run = subprocess.run([command, "info", path, "--json"], capture_output=True, text=True, errors="replace", timeout=120)
    told = run.stderr.strip()
    if run.returncode not in (0, 1, 2) or "panicked" in told:
        raise SystemExit(f"{path}: exit status {run.returncode}: {told}")
    if run.returncode:
        if "\n" in told:
            raise SystemExit(f"{path}: a message of several lines: {told}")
        return None, told
    info = json.loads(run.stdout)
    return info, ""


def close(a, b):
    return math.isclose(a, b, rel_tol=1e-6, abs_tol=1e-6)


def main():
    import pydicom

    command = os.path.abspath(sys.argv[1])
    folder = os.path.join(os.path.dirname(pydicom.__file__), "data", "test_files")
    wrong, same, rows = 0, 0, []
    for where, _, names in sorted(os.walk(folder)):
        for name in sorted(names):
            path = os.path.join(where, name)
            shown = os.path.relpath(path, folder)
            try:
                want, why = expected(path), ""
            except Exception as e:  # Whatever pydicom says of its own broken files.
                want, why = None, str(e).splitlines()[0][:100] if str(e) else type(e).__name__
            info, told = found(command, path)
            if info is None or want is None:
                if info or want:
                    rows.append((shown, "only the command" if info else "only pydicom", told or why))
                continue
            sizes, spacing, values = want
            faults = []
            if info["dimensions"] != sizes:
                faults.append(f"sizes {info['dimensions']}, not {sizes}")
            if spacing and not all(close(a, b) for a, b in zip(info["spacing"], spacing)):
                faults.append(f"spacing {info['spacing']}, not {spacing}")
            if values:
                got = [info[key] for key in ("min", "max", "mean")]
                if not all(close(a, b) for a, b in zip(got, values)):
                    faults.append(f"least, most, mean {got}, not {values}")
            wrong += bool(faults)
            same += not faults
            rows.append((shown, "WRONG" if faults else "same", "; ".join(faults)))
    for row in rows:
        print("%-60s %-18s %s" % row)
    print(f"{same} files are read alike, {wrong} are not.")
    return 1 if wrong or same < 80 else 0


if __name__ == "__main__":
    sys.exit(main() if "--inside" in sys.argv else inside())
