"""Volumes: arrays of other libraries as they are, and files."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from . import _slicestack

if TYPE_CHECKING:
    import numpy as np

Progress = Callable[[str, int, int], "bool | None"]
"""Is called with what is being done, the steps done, and the steps in all; returning ``False`` stops the work."""

# Types of voxels, by the letters of NumPy.
_KINDS = ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8")


class CopyWarning(UserWarning):
    """An array could not be used where it lies: it was copied once."""


class Volume:
    """Voxels on a grid in the world.

    Parameters
    ----------
    data
        An array of shape (z, y, x), or (z, y, x, 3) or (z, y, x, 4) of straight colours: of NumPy, or of anything that has
        ``__array_interface__``, the buffer protocol, or DLPack on the CPU. Voxels of type u8, i8, u16, i16, u32, i32, f32 and f64 that
        lie in C order are used without a copy; others are copied once, and a :class:`CopyWarning` tells. Also an image of SimpleITK or
        nibabel, a ``DataArray`` of xarray, or a dataset of pydicom or a list of them (a series), each with the place in the world that
        it tells of.
    spacing
        World units from voxel to voxel along x, y, z; 1 unless given. A negative number turns the axis around.
    origin
        World position of the centre of the first voxel, along x, y, z.
    affine
        4 x 4: from index (i, j, k), along x, y, z, to world coordinates, in the place of ``spacing`` and ``origin``.
    space
        What the world's axes mean in a body: ``"lps"`` (left, posterior, superior: DICOM), ``"ras"`` (NIfTI), or ``""``.
    box
        ``"cells"``: voxels have an extent; ``"nodes"``: they are corners of cells.
    rescale
        ``(slope, intercept)`` of value = slope * stored + intercept.
    modality
        ``"ct"`` (Hounsfield units), ``"mr"``, ``"other"`` or ``""``; presets go by it.
    unit
        Of lengths: ``"mm"``, ``"um"``, ...
    labels
        Whether integers are labels of segments.
    name
        For messages.

    While a picture is made of an array that is not copied, do not write into it: the picture would be of some mixture.
    """

    __slots__ = ("_native", "_array", "copied")

    def __init__(
        self,
        data: Any,
        *,
        spacing: Sequence[float] | None = None,
        origin: Sequence[float] | None = None,
        affine: Any = None,
        space: str | None = None,
        box: str = "cells",
        rescale: tuple[float, float] | None = None,
        modality: str | None = None,
        unit: str | None = None,
        labels: bool = False,
        name: str | None = None,
    ) -> None:
        from . import _sources

        if affine is not None and (spacing is not None or origin is not None):
            raise ValueError("affine: tells spacing and origin already; give one or the other")
        if box not in ("cells", "nodes"):
            raise ValueError(f'box "{box}": "cells" or "nodes"')
        found = _sources.read(data)
        if affine is not None:
            found.origin, found.steps = _sources.of_affine(affine)
        if spacing is not None:
            lengths = _sources.three(spacing, "spacing")
            found.steps = _sources.with_lengths(found.steps, lengths)
        if origin is not None:
            found.origin = _sources.three(origin, "origin")
        array, channels, self.copied = _sources.voxels(found.array, labels)
        slope, intercept = rescale if rescale is not None else found.rescale
        self._array = array
        self._native = _slicestack.Volume.of_array(
            array,
            array.dtype.str[1:],
            list(array.shape[2::-1]),
            found.origin,
            found.steps,
            space=found.space if space is None else space,
            nodes=box == "nodes",
            channels=channels,
            slope=float(slope),
            intercept=float(intercept),
            modality=found.modality if modality is None else modality,
            unit=found.unit if unit is None else unit,
            name=found.name if name is None else name,
        )
        if self.copied:
            warnings.warn(f"the array {self.copied}: it was copied once", CopyWarning, stacklevel=2)

    @classmethod
    def _of(cls, native: Any) -> Volume:
        volume = object.__new__(cls)
        volume._native, volume._array, volume.copied = native, None, ""
        return volume

    @classmethod
    def open(cls, path: str | os.PathLike[str], *, progress: Progress | None = None, map_files: bool = True, **keys: Any) -> Volume:
        """The volume in the file or folder at ``path``: NRRD, NIfTI, MetaImage, VTK, MRC, DICOM, TIFF, Zarr, NumPy, raw, ...

        Parameters
        ----------
        progress
            Is told how far reading has come: ``progress(what, done, total)``; returning ``False`` stops it.
        map_files
            Whether large files are mapped instead of read. A mapped file must not be cut short meanwhile.
        keys
            Keys of a scene's section ``volume``: ``spacing=[1, 1, 2]``, ``series=2``, ``crop=[[0, 9], [0, 9], [0, 9]]``, ``dimensions``,
            ``type``, ``endian`` of raw files, ...

        Raises
        ------
        OSError
            What the operating system refuses.
        ValueError
            For a file that is not what it claims to be.
        """
        from ._scene import key_texts

        texts = [("volume.path", os.fspath(path)), *key_texts({"volume": keys})]
        native = _slicestack.SceneFile.parse("", "", texts).load(progress, map_files=map_files)
        return cls._of(native.with_keys(texts))

    @classmethod
    def phantom(cls, name: str, size: int = 128) -> Volume:
        """A built-in volume of ``size`` voxels a side: marschner-lobb, hydrogen, shepp-logan, distance-field, cloud, ..."""
        texts = [("volume.phantom", name), ("volume.size", str(size))]
        return cls._of(_slicestack.SceneFile.parse("", "", texts).load().with_keys(texts))

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along z, y, x."""
        x, y, z = self._native.dims
        return z, y, x

    @property
    def spacing(self) -> tuple[float, float, float]:
        """World units from voxel to voxel along x, y, z; always positive."""
        return tuple(self._native.spacing)

    @property
    def origin(self) -> tuple[float, float, float]:
        """World position of the first voxel's centre: x, y, z."""
        return tuple(self._native.origin)

    @property
    def affine(self) -> np.ndarray:
        """4 x 4, float64: from index (i, j, k), along x, y, z, to world coordinates."""
        import numpy as np

        affine = np.eye(4)
        affine[:3, :3] = np.array(self._native.steps).T
        affine[:3, 3] = self._native.origin
        return affine

    @property
    def space(self) -> str:
        """``"lps"``, ``"ras"`` or ``""``."""
        return self._native.space

    @property
    def dtype(self) -> np.dtype:
        """Type of the stored numbers."""
        import numpy as np

        kind = self._native.kind
        return np.dtype(f"{kind[0]}{int(kind[1:]) // 8}")

    @property
    def channels(self) -> str:
        """``"scalar"``, ``"labels"``, ``"rgba"`` or ``"rgb"``."""
        return self._native.channels

    @property
    def rescale(self) -> tuple[float, float]:
        """Slope and intercept of value = slope * stored + intercept."""
        return self._native.rescale

    @property
    def name(self) -> str:
        """For messages: usually the file's path."""
        return self._native.name

    @property
    def notes(self) -> list[str]:
        """What its reader chose or repaired, one sentence each."""
        return self._native.notes

    @property
    def is_shared(self) -> bool:
        """Whether the voxels lie in memory that Python owns, without a copy."""
        return self._native.is_shared

    def statistics(self) -> dict[str, float]:
        """``min``, ``max``, ``mean`` of the finite values in the data's units, and how many voxels are ``non_finite``."""
        return self._native.statistics()

    def sha256(self) -> str:
        """SHA-256 of grid and voxels."""
        return self._native.sha256()

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """The stored numbers, of shape (z, y, x), or (z, y, x, 4) of colours."""
        import numpy as np

        array = self._array
        if array is None:
            if copy is False:
                raise ValueError("volume: its voxels lie outside of Python's memory: they are copied")
            shape = self.shape + ((4,) if self.channels in ("rgba", "rgb") else ())
            array = np.empty(shape, self.dtype)
            self._native.copy_to(array)
        elif copy:
            array = array.copy()
        return array if dtype is None else array.astype(dtype, copy=False)

    def __repr__(self) -> str:
        z, y, x = self.shape
        name = f" {self.name!r}" if self.name else ""
        sides = " x ".join(f"{s:.6g}" for s in self.spacing)
        return f"<slicestack.Volume{name}: {x} x {y} x {z} voxels of {self._native.kind}, {sides} apart>"


def as_volume(data: Any, **keys: Any) -> Volume:
    """``data`` as a volume, unless it is one."""
    if isinstance(data, Volume):
        if any(value is not None for value in keys.values()):
            raise ValueError("a Volume knows its place in the world already: give " + ", ".join(keys) + " where it is made")
        return data
    return Volume(data, **keys)
