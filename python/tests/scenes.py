"""Thirty scenes of built-in volumes: the command and the package make the same picture of each.

python3 python/tests/scenes.py COMMAND      writes recorded.json, the SHA-256 of the command's pixels
"""

import json
import pathlib
import subprocess
import sys
import tempfile

RECORDED = pathlib.Path(__file__).with_name("recorded.json")
PHANTOMS = ["shepp-logan", "distance-field", "cloud", "marschner-lobb", "hydrogen"]

# Keys of a scene, as flags of the command and keywords of the package.
LOOKS = [
    {"camera.azimuth": 30, "slices.count": 100},
    {"camera.azimuth": -50, "camera.elevation": 20, "camera.projection": "perspective", "camera.fov_y": 35.0, "slices.count": 90},
    {"slices.tolerance": 0.01, "camera.azimuth": 100},
    {"fog.mode": "exp2", "fog.density": 0.01, "fog.color": [0.5, 0.6, 0.7], "slices.count": 64, "image.background": [1.0, 1.0, 1.0, 1.0]},
    {"render.blend": "mip", "camera.elevation": 35},
    {"light.ambient": 0.3, "light.shininess": 12, "slices.count": 80, "transfer.classification": "pre-integrated", "camera.zoom": 1.3},
]


def scenes():
    """(name, phantom, keys) of each."""
    for phantom in PHANTOMS:
        for number, look in enumerate(LOOKS):
            yield f"{phantom}-{number}", phantom, {"image.width": 72, "image.height": 60, **look}


def flags(phantom, keys):
    """The command's arguments."""
    words = ["--volume.phantom", phantom, "--volume.size", "24"]
    for key, value in keys.items():
        words += [f"--{key}", ",".join(map(repr, value)) if isinstance(value, list) else str(value)]
    return words


def main():
    recorded = {}
    with tempfile.TemporaryDirectory() as folder:
        stats = pathlib.Path(folder, "stats.json")
        for name, phantom, keys in scenes():
            words = [sys.argv[1], "render", *flags(phantom, keys), "-o", f"{folder}/{name}.npy", "--stats", str(stats)]
            subprocess.run(words, check=True)
            recorded[name] = json.loads(stats.read_text())["sha256"]
    RECORDED.write_text(json.dumps(recorded, indent=1) + "\n")
    print(f"{len(recorded)} pictures recorded")


if __name__ == "__main__":
    main()
