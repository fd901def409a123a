"""Finished pictures."""

from __future__ import annotations

import json
import os
from functools import cached_property
from typing import TYPE_CHECKING, Any

from . import _slicestack

if TYPE_CHECKING:
    import numpy as np


class Image:
    """A picture: float32, premultiplied RGBA, row 0 on top. Notebooks show it as it is."""

    def __init__(self, native: Any) -> None:
        self._native = native

    @classmethod
    def from_array(cls, array: Any) -> Image:
        """The picture of an array of shape (height, width, 4), premultiplied RGBA."""
        import numpy as np

        array = np.ascontiguousarray(array, np.float32)
        if array.ndim != 3 or array.shape[2] != 4:
            raise ValueError(f"array: of shape {array.shape}; (height, width, 4) is needed")
        return cls(_slicestack.Image.of_array(array, array.shape[1], array.shape[0]))

    @classmethod
    def open(cls, path: str | os.PathLike[str]) -> Image:
        """The picture in a file: PNG, OpenEXR, NumPy, JPEG, WebP, TIFF, ..."""
        return cls(_slicestack.decode(os.fspath(path)))

    @property
    def width(self) -> int:
        """Columns, pixels."""
        return self._native.width

    @property
    def height(self) -> int:
        """Rows, pixels."""
        return self._native.height

    @cached_property
    def array(self) -> np.ndarray:
        """The pixels: float32 of shape (height, width, 4), premultiplied RGBA. Read-only."""
        import numpy as np

        array = np.empty((self.height, self.width, 4), np.float32)
        self._native.copy_to(array)
        array.flags.writeable = False
        return array

    @cached_property
    def stats(self) -> dict[str, Any]:
        """What the picture cost: ``seconds`` (prepare, render), ``slices``, ``fragments``, ``fetches`` (voxel lookups), ``left_out``, ..."""
        return json.loads(self._native.stats)

    @property
    def warnings(self) -> list[str]:
        """What is likely not meant, one line each."""
        return self._native.warnings

    @property
    def notes(self) -> list[str]:
        """What was decided, and why, one line each."""
        return self._native.notes

    def sha256(self) -> str:
        """SHA-256 of the pixels in float32: the same for every number of threads, on every machine."""
        return self._native.sha256()

    def save(self, path: str | os.PathLike[str], *, depth: int = 8, metadata: bool = True) -> None:
        """Writes the picture; the extension tells the format: .png, .npy, .exr, .jpg, .webp, .tif.

        Parameters
        ----------
        depth
            Bits a component of PNG and TIFF: 8 or 16.
        metadata
            Whether PNG and OpenEXR files carry what ``slicestack verify`` needs: the scene, the version, fingerprints. No path is among it.
        """
        self._native.save(os.fspath(path), depth, metadata)

    def to_png(self, *, depth: int = 8, metadata: bool = False) -> bytes:
        """As the bytes of a PNG file."""
        return self._native.encode("png", depth, metadata)

    def _repr_png_(self) -> bytes:
        return self.to_png()

    def compare(self, other: Image | Any) -> dict[str, Any]:
        """How far another picture (an :class:`Image`, an array, a path) is from this one.

        Returns
        -------
        ``rms``, ``max`` (greatest difference of a component, 0 to 1), ``psnr`` (dB), ``ssim``, ``flip`` (mean, 0 to 1), ``differing`` (pixels), ``pixels``, ``worst`` (column, row).
        """
        if isinstance(other, (str, os.PathLike)):
            other = Image.open(other)
        elif not isinstance(other, Image):
            other = Image.from_array(other)
        return _slicestack.compare(self._native, other._native)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        array = self.array
        if dtype is not None and array.dtype != dtype:
            return array.astype(dtype)
        return array.copy() if copy else array

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Image):
            return NotImplemented
        return (self.width, self.height, self.sha256()) == (other.width, other.height, other.sha256())

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return f"<slicestack.Image: {self.width} x {self.height} pixels>"
