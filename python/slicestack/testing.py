"""A fixture for pytest: pictures on record.

>>> def test_head(slicestack_golden):                          # doctest: +SKIP
...     slicestack_golden(slicestack.render("head.nrrd"), "head.png")

The first run with ``--slicestack-bless`` writes the pictures, beside the test in a folder ``goldens``; later runs compare.
"""

from __future__ import annotations

import os
import pathlib
from collections.abc import Callable
from typing import Any

import pytest


def pytest_addoption(parser: Any) -> None:
    """Adds ``--slicestack-bless``."""
    group = parser.getgroup("slicestack")
    group.addoption("--slicestack-bless", action="store_true", help="write the pictures that tests compare with, instead of comparing")


@pytest.fixture
def slicestack_golden(request: pytest.FixtureRequest) -> Callable[..., None]:
    """``slicestack_golden(image, name, *, max_rms=0, max_flip=None)``: fails where the image is farther than that from the one on record
    (``.npy`` and ``.exr`` hold every bit, ``.png`` 8 bits a component). A picture of the failed test is left beside it."""
    from . import Image

    folder = pathlib.Path(request.path).parent / "goldens"
    bless = request.config.getoption("--slicestack-bless")

    def golden(image: Image, name: str, *, max_rms: float = 0.0, max_flip: float | None = None) -> None:
        path = folder / name
        found = path.with_name(f"{path.stem}.found{path.suffix}")
        if bless:
            folder.mkdir(exist_ok=True)
            image.save(path)
            found.unlink(missing_ok=True)
            return
        if not path.exists():
            pytest.fail(f"{path}: no picture on record; run pytest with --slicestack-bless to write it", pytrace=False)
        image.save(found)
        # What is on record has the file's precision; so has what it is compared with.
        far = Image.open(found).compare(path)
        worse = [f"RMS {far['rms']:.3g}, {max_rms:g} is allowed"] if far["rms"] > max_rms else []
        if max_flip is not None and far["flip"] > max_flip:
            worse.append(f"FLIP {far['flip']:.3g}, {max_flip:g} is allowed")
        if worse:
            pytest.fail(f"{os.fspath(path)}: {'; '.join(worse)}; {far['differing']} of {far['pixels']} pixels differ, see {found}", pytrace=False)
        found.unlink()

    return golden
