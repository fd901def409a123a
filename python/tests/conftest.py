"""What the tests share: volumes with a formula, and the command, where there is one."""

import os
import pathlib
import shutil

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


def field(shape, kind="u2"):
    """Waves of shape (z, y, x), over the range of the type."""
    z, y, x = np.indices(shape).astype(float)
    wave = 0.5 + 0.5 * np.sin(0.31 * x + 1) * np.cos(0.23 * y) * np.sin(0.41 * z + 0.5)
    if kind[0] == "f":
        return (wave * 100 - 20).astype(kind)
    info = np.iinfo(kind)
    return (wave * (float(info.max) - info.min) * 0.99 + info.min).astype(kind)


def transfer(low, high):
    """A section of a scene: transparent below, red to blue above."""
    at = lambda share: low + share * (high - low)  # noqa: E731
    return {
        "color": [[at(0.3), 0.9, 0.3, 0.1], [at(0.7), 0.2, 0.8, 0.4], [at(1.0), 0.3, 0.3, 1.0]],
        "opacity": [[at(0.4), 0.0], [at(0.8), 0.25], [at(1.0), 0.5]],
        "opacity_unit": 1.0,
    }


@pytest.fixture(scope="session")
def command():
    """The command ``slicestack``: of ``SLICESTACK_COMMAND``, or as built beside these tests, or in the PATH."""
    for path in (os.environ.get("SLICESTACK_COMMAND"), ROOT / "target/release/slicestack", shutil.which("slicestack")):
        if path and os.access(path, os.X_OK):
            return str(path)
    pytest.skip("the command is not here: set SLICESTACK_COMMAND, or cargo build --release; its recorded pictures are compared all the same")
