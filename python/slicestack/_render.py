"""From volume and scene to pictures."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterator
from typing import Any

from . import _slicestack
from ._arrays import Progress, Volume, as_volume
from ._picture import Image
from ._scene import Scene, is_scene_path, scene_file, volume_keys

_PLACE = ("spacing", "origin", "affine", "space", "rescale", "modality", "unit")


def _opened(volume: Any, scene: Any, keys: dict[str, Any], progress: Progress | None) -> tuple[Volume, Scene]:
    """The volume, and the scene for it."""
    place = {key: keys.pop(key) for key in _PLACE if key in keys}
    if isinstance(volume, (str, os.PathLike)) and is_scene_path(os.fspath(volume)):
        if scene is not None:
            raise ValueError(f"{os.fspath(volume)}: is a scene already; give one")
        volume, scene = None, volume
    if volume is None or isinstance(volume, (str, os.PathLike)):
        if place:
            raise ValueError(f"{next(iter(place))}: is for arrays; of files say volume__{next(iter(place))}")
        named = [] if volume is None else [("volume.path", os.fspath(volume))]
        file = scene_file(scene, keys, named)
        volume = Volume._of(file.load(progress).with_keys(named))
        return volume, Scene._of(file.resolve(volume._native), file)
    volume = as_volume(volume, **place)
    if isinstance(scene, Scene) and not keys:
        return volume, scene
    file = scene_file(scene, keys, volume_keys(volume))
    return volume, Scene._of(file.resolve(volume._native), file)


def _told(image: Image) -> Image:
    """The image; its warnings are raised as such."""
    for line in image.warnings:
        warnings.warn(line, UserWarning, stacklevel=4)
    return image


class Renderer:
    """Makes many pictures of one volume: what depends on volume and transfer function alone is kept between them.

    Parameters
    ----------
    volume
        As in :func:`render`.
    threads
        Worker threads; one a core unless given. No number of them changes a byte.
    tile
        Side of a screen tile, pixels.
    simd
        Vector level: ``"auto"``, ``"scalar"``, ... No level changes a byte.
    """

    __slots__ = ("volume", "_native")

    def __init__(self, volume: Any, *, threads: int | None = None, tile: int | None = None, simd: str = "auto", **place: Any) -> None:
        if isinstance(volume, (str, os.PathLike)):
            volume = Volume.open(volume, **place)
        self.volume: Volume = as_volume(volume, **place) if not isinstance(volume, Volume) else volume
        self._native = _slicestack.Renderer(self.volume._native, threads=threads, tile=tile, simd=simd)

    def render(self, scene: Any = None, *, progress: Progress | None = None, **keys: Any) -> Image:
        """One picture: see :func:`render`."""
        if not (isinstance(scene, Scene) and not keys):
            scene = Scene(self.volume, scene, **keys)
        return _told(Image(self._native.render(scene._native, progress)))

    def turntable(self, pictures: int = 36, scene: Any = None, *, progress: Progress | None = None, **keys: Any) -> Iterator[Image]:
        """``pictures`` of them once around the volume, one after the other as they are asked for."""
        scene = Scene(self.volume, scene, **keys)
        for view in scene._file.turntable(scene._native, self.volume._native, pictures):
            yield Image(self._native.render(view, progress))


def render(
    volume: Any = None,
    scene: Any = None,
    *,
    progress: Progress | None = None,
    threads: int | None = None,
    tile: int | None = None,
    simd: str = "auto",
    **keys: Any,
) -> Image:
    """One picture of a volume.

    Parameters
    ----------
    volume
        The path of a volume file or of a scene file (``.toml``, ``.json``); a :class:`Volume`; or what :class:`Volume` takes: an array of
        shape (z, y, x), an image of SimpleITK or nibabel, a ``DataArray``, datasets of pydicom. May be left out where the scene names one.
    scene
        A dict with the sections of a scene file, the path of one, a :class:`Scene`, or nothing.
    progress
        ``progress(what, done, total)`` is called on this thread about 20 times a second; returning ``False`` stops the work
        (``InterruptedError``). Ctrl-C stops it too.
    threads, tile, simd
        How it is run; see :class:`Renderer`. Nothing of it changes a byte.
    keys
        Keys of the scene, which win: see :class:`Scene`. For arrays also ``spacing`` (world units along x, y, z), ``origin``, ``affine``, ``space``, ``rescale``,
        ``modality``, ``unit``: see :class:`Volume`.

    Returns
    -------
    Image
        ``.array`` is float32 of shape (height, width, 4), premultiplied RGBA.

    Raises
    ------
    ValueError, OSError
        With the line that the command prints.
    """
    opened, resolved = _opened(volume, scene, keys, progress)
    native = _slicestack.Renderer(opened._native, threads=threads, tile=tile, simd=simd)
    return _told(Image(native.render(resolved._native, progress)))


def turntable(volume: Any, pictures: int = 36, scene: Any = None, **keys: Any) -> list[Image]:
    """``pictures`` of them once around a volume; takes what :func:`render` takes."""
    place = {key: keys.pop(key) for key in _PLACE if key in keys}
    run = {key: keys.pop(key) for key in ("threads", "tile", "simd") if key in keys}
    return list(Renderer(volume, **run, **place).turntable(pictures, scene, **keys))
