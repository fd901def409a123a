"""Pictures of dask arrays: each part is rendered where it lies, and only small partial pictures travel.

>>> import dask.array as da, slicestack.dask                                       # doctest: +SKIP
>>> array = da.from_zarr("embryo.zarr")                    # (z, y, x), any chunks   # doctest: +SKIP
>>> image = slicestack.dask.render(array, spacing=(0.4, 0.4, 2), preset="...")       # doctest: +SKIP

Works on dask's threads, on a ``LocalCluster``, and on any other cluster: on whatever ``dask.compute`` runs. The picture is that of the whole
array in one memory, but for rounding: within 2e-6. A task holds a chunk, a few voxels around it, and a picture.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import dask
import dask.array as da
import numpy as np

from . import _slicestack
from ._arrays import Volume
from ._picture import Image
from ._scene import Scene
from ._sources import Found, of_affine, three, voxels, with_lengths

# Samples along an axis by which what a scene leaves open is decided.
_SAMPLES = 64
# Partial pictures that one task puts together.
_FAN = 4


class Parts:
    """A dask array on its grid, and what is known of it: the range of its values, and a sample. Made once, it serves many pictures.

    Parameters
    ----------
    array
        Of shape (z, y, x), in any chunks: u8, i8, u16, i16, u32, i32, f32 or f64. Each chunk becomes a part; for chunks of less than about a million
        voxels, ``array.rechunk`` first.
    spacing, origin, affine, space, box, rescale, modality
        As of :class:`slicestack.Volume`.

    Reads the array once. Chunks are read by the tasks that need them, here and for each picture; ``array.persist()`` keeps them in the workers' memory.
    """

    def __init__(
        self,
        array: da.Array,
        *,
        spacing: Sequence[float] | None = None,
        origin: Sequence[float] | None = None,
        affine: Any = None,
        space: str = "",
        box: str = "cells",
        rescale: tuple[float, float] = (1.0, 0.0),
        modality: str = "",
    ) -> None:
        if not isinstance(array, da.Array):
            raise ValueError(f"array: {type(array).__name__}; a dask array is needed, slicestack.render takes others")
        if array.ndim != 3:
            raise ValueError(f"array: of shape {array.shape}; (z, y, x) is needed")
        if any(math.isnan(n) for n in array.shape):
            raise ValueError("array: chunks of unknown size; array.compute_chunk_sizes() finds them out")
        if 0 in array.shape:
            raise ValueError(f"array: of shape {array.shape}: without a voxel")
        if array.dtype == bool:
            array = array.view(np.uint8)
        if array.dtype == np.float16:
            array = array.astype(np.float32)
        if array.dtype.str[1:] not in ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"):
            raise ValueError(f"array: voxels of type {array.dtype}: u1, i1, u2, i2, u4, i4, f4 and f8 are rendered")
        place = Found(array)
        if affine is not None:
            if spacing is not None or origin is not None:
                raise ValueError("affine: tells spacing and origin already; give one or the other")
            place.origin, place.steps = of_affine(affine)
        if spacing is not None:
            place.steps = with_lengths(place.steps, three(spacing, "spacing"))
        if origin is not None:
            place.origin = three(origin, "origin")
        self.array = array
        self._origin, self._steps, self._space, self._nodes = place.origin, place.steps, space, box == "nodes"
        self._rescale = rescale
        self._cuts = [_cuts(chunks) for chunks in reversed(array.chunks)]
        self.range, self.non_finite, sample, stride = _look(array)
        affine = np.eye(4)
        affine[:3, :3] = np.array([[x * n for x in step] for step, n in zip(self._steps, stride[::-1])]).T
        affine[:3, 3] = self._origin
        self._sample = Volume(sample, affine=affine, space=space, box=box, rescale=rescale, modality=modality)

    @property
    def dims(self) -> list[int]:
        """Voxels along x, y, z."""
        return list(self.array.shape[::-1])

    @property
    def _grid(self) -> tuple[Any, ...]:
        return self.dims, self._origin, self._steps, self._space, self._nodes

    def scene(self, scene: Any = None, **keys: Any) -> Scene:
        """The scene for this array: what it leaves open (a camera's fit, a transfer function) is decided on a sample of at most 64 voxels a side,
        which has the whole array's range. A tolerance becomes slices half a voxel apart."""
        found = Scene(self._sample, scene, **keys)
        if found._native.to_tolerance:
            smallest = min(math.hypot(*step) for step in self._steps)
            found = Scene(self._sample, scene, **{**keys, "slices__spacing": smallest / 2})
        return found

    def partials(self, scenes: Sequence[Scene]) -> list[Any]:
        """For each of some scenes a delayed partial picture of the whole array: bytes, for :meth:`finish`. A chunk is read once for all of them."""
        halos = [_slicestack.halo(scene._native, *self._grid) for scene in scenes]
        halo = [max(sides) for sides in zip(*halos)]
        tiles = _slicestack.tiles(*self._grid, self._cuts, halo, self.range, self.non_finite)
        texts = [scene.to_toml() for scene in scenes]
        shared = dask.delayed((self._grid, halo, self.range, self.non_finite, self._rescale, texts), traverse=False)
        left = []
        for tile in tiles:
            (x0, x1), (y0, y1), (z0, z1) = tile.voxels
            block = self.array[z0:z1, y0:y1, x0:x1]
            left.append(_part(block.rechunk(block.shape).to_delayed(optimize_graph=False)[0, 0, 0], tile.cells, shared))
        whole = []
        for number, scene in enumerate(scenes):
            own = [_pick(parts, number) for parts in left]
            row = [own[at] for at in _slicestack.order(scene._native, tiles)]
            while len(row) > 1:
                row = [_combine(row[i : i + _FAN]) for i in range(0, len(row), _FAN)]
            whole.append(row[0])
        return whole

    @staticmethod
    def finish(partial: bytes, scene: Scene) -> Image:
        """The picture that a partial picture of the whole array comes to."""
        return Image(_slicestack.finish(partial, scene._native))

    def render(self, scene: Any = None, *, compute: dict[str, Any] | None = None, **keys: Any) -> Image:
        """One picture: see :func:`render`."""
        scene = scene if isinstance(scene, Scene) and not keys else self.scene(scene, **keys)
        (partial,) = dask.compute(*self.partials([scene]), **(compute or {}))
        return self.finish(partial, scene)

    def turntable(self, pictures: int = 36, scene: Any = None, *, batch: int = 8, compute: dict[str, Any] | None = None, **keys: Any) -> Iterator[Image]:
        """Pictures once around: see :func:`turntable`."""
        first = self.scene(scene, **keys)
        views = [Scene._of(view, first._file) for view in first._file.turntable(first._native, self._sample._native, pictures)]
        for begin in range(0, pictures, batch):
            some = views[begin : begin + batch]
            for partial, view in zip(dask.compute(*self.partials(some), **(compute or {})), some):
                yield self.finish(partial, view)


def render(array: da.Array, scene: Any = None, *, compute: dict[str, Any] | None = None, **keys: Any) -> Image:
    """One picture of a dask array.

    Parameters
    ----------
    array
        Of shape (z, y, x), in any chunks.
    scene, keys
        As of :func:`slicestack.render`; blends over, mip, min, average and add. Keys of the array's place: ``spacing`` (world units along x, y, z), ``origin``,
        ``affine``, ``space``, ``box``, ``rescale``, ``modality``.
    compute
        Arguments for ``dask.compute``: ``{"scheduler": "threads"}``, ``{"retries": 3}``, ...

    Returns
    -------
    Image
        Within 2e-6 of the picture of the whole array in one memory, with the same scene in as many slices.

    Raises
    ------
    ValueError
        For scenes that are not rendered in parts, with the reason.
    """
    return Parts(array, **_place(keys)).render(scene, compute=compute, **keys)


def turntable(array: da.Array, pictures: int = 36, scene: Any = None, *, batch: int = 8, compute: dict[str, Any] | None = None, **keys: Any) -> Iterator[Image]:
    """``pictures`` of them once around a dask array, one after the other: takes what :func:`render` takes. Each chunk is read once for
    ``batch`` pictures, whose partial pictures a task then holds."""
    return Parts(array, **_place(keys)).turntable(pictures, scene, batch=batch, compute=compute, **keys)


def _place(keys: dict[str, Any]) -> dict[str, Any]:
    """The keys of the array's place, taken out of ``keys``."""
    names = ("spacing", "origin", "affine", "space", "box", "rescale", "modality")
    return {name: keys.pop(name) for name in names if name in keys}


def _cuts(chunks: Sequence[int]) -> list[int]:
    """Where chunks end, as index coordinates without the ends. A last chunk of one voxel has no cell of its own: it goes with the one before."""
    ends = np.cumsum([n for n in chunks if n > 0]).tolist()
    last = ends[-1] - 1
    return [end for end in ends[:-1] if 0 < end < last]


def _look(array: da.Array) -> tuple[tuple[float, float], int, np.ndarray, list[int]]:
    """The range of the finite values, how many are none, a sample of the array, and its strides along z, y, x."""
    stride = [max(1, -(-n // _SAMPLES)) for n in array.shape]
    seen, places = [], []
    starts = [np.cumsum([0, *chunks[:-1]]).tolist() for chunks in array.chunks]
    blocks = array.to_delayed(optimize_graph=False)
    for at in np.ndindex(*blocks.shape):
        first = [starts[axis][at[axis]] for axis in range(3)]
        if 0 in (array.chunks[axis][at[axis]] for axis in range(3)):
            continue
        seen.append(_seen(blocks[at], [-f % s for f, s in zip(first, stride)], stride))
        places.append([-(-f // s) for f, s in zip(first, stride)])
    found = dask.compute(*seen)
    sample = np.empty([-(-n // s) for n, s in zip(array.shape, stride)], array.dtype)
    for (_, _, _, part), (z, y, x) in zip(found, places):
        sample[z : z + part.shape[0], y : y + part.shape[1], x : x + part.shape[2]] = part
    some = [f for f in found if f[0] <= f[1]]
    low, high = (min(f[0] for f in some), max(f[1] for f in some)) if some else (0.0, 0.0)
    if some and max(stride) > 1:
        # With the array's own range, so that what goes by that is decided as for all of it.
        finite = np.isfinite(sample)
        if finite.any():
            least, greatest = np.where(finite, sample, high).argmin(), np.where(finite, sample, low).argmax()
            sample.flat[least], sample.flat[greatest] = low, high
    return (low, high), sum(f[2] for f in found), sample, stride


@dask.delayed(pure=True)
def _seen(block: np.ndarray, first: list[int], stride: list[int]) -> tuple[float, float, int, np.ndarray]:
    """Least and greatest finite value of a chunk, how many are none, and its share of the sample."""
    block = np.asarray(block)
    sample = block[first[0] :: stride[0], first[1] :: stride[1], first[2] :: stride[2]].copy()
    low, high, holes = block.min(), block.max(), 0
    if block.dtype.kind == "f" and not (np.isfinite(low) and np.isfinite(high)):
        finite = np.isfinite(block)
        holes = int(block.size - np.count_nonzero(finite))
        low = block.min(where=finite, initial=np.inf)
        high = block.max(where=finite, initial=-np.inf)
    return float(low), float(high), holes, sample


@dask.delayed(pure=True)
def _part(block: np.ndarray, cells: list[tuple[int, int]], shared: tuple[Any, ...]) -> list[bytes]:
    """What the part that owns ``cells`` leaves of each scene."""
    grid, halo, value_range, non_finite, rescale, texts = shared
    tile = _slicestack.Domain(*grid, cells, halo, value_range, non_finite)
    array, _, _ = voxels(np.asarray(block), False)
    _, _, steps, space, nodes = grid
    volume = _slicestack.Volume.of_array(
        array,
        array.dtype.str[1:],
        list(array.shape[::-1]),
        tile.origin,
        steps,
        space=space,
        nodes=nodes,
        slope=float(rescale[0]),
        intercept=float(rescale[1]),
    )
    # Dask has a task for each core already.
    renderer = _slicestack.Renderer(volume, threads=1)
    left = []
    for text in texts:
        scene = _slicestack.SceneFile.parse(text, "", [("volume.path", "array")]).resolve(volume)
        left.append(renderer.render_part(scene, tile))
    return left


@dask.delayed(pure=True)
def _pick(partials: list[bytes], number: int) -> bytes:
    return partials[number]


@dask.delayed(pure=True)
def _combine(partials: list[bytes]) -> bytes:
    """Partial pictures, nearest first, as one."""
    return _slicestack.combine(partials)
