"""Scenes: a dict, a file, or keywords; and what they come to for a volume."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

from . import _slicestack
from ._arrays import Volume

# The command's short flags, and the keys that they stand for.
_SHORT = {
    "preset": "transfer.preset",
    "count": "slices.count",
    "tolerance": "slices.tolerance",
    "azimuth": "camera.azimuth",
    "elevation": "camera.elevation",
    "zoom": "camera.zoom",
    "blend": "render.blend",
}
_NAMED = {"black": (0, 0, 0, 1), "white": (1, 1, 1, 1), "transparent": (0, 0, 0, 0)}


def presets() -> dict[str, str]:
    """The presets' names, and what each is for."""
    return dict(_slicestack.presets())


def schema() -> dict[str, Any]:
    """The JSON schema of a scene: every key, its type, and what it means."""
    return json.loads(_slicestack.schema())


def _plain(value: Any) -> Any:
    """Numbers of NumPy and paths as Python's own."""
    if hasattr(value, "tolist"):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise ValueError(f"scene: {type(value).__name__} {value!r} is no value of a key")


def _toml(value: Any) -> str:
    """A value as it stands in a scene file."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(inner) for inner in value) + "]"
    return _toml(_plain(value))


def key_text(value: Any) -> str:
    """A value as the command's flag of the key takes it."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return value if isinstance(value, str) else _toml(value)


def background(color: Any) -> tuple[float, ...]:
    """A colour as four numbers from 0 to 1."""
    if isinstance(color, str):
        if color in _NAMED:
            return _NAMED[color]
        digits = color.removeprefix("#")
        if color.startswith("#") and len(digits) in (3, 6):
            try:
                wide = digits if len(digits) == 6 else "".join(2 * d for d in digits)
                return tuple(int(wide[i : i + 2], 16) / 255 for i in (0, 2, 4)) + (1.0,)
            except ValueError:
                pass
        raise ValueError(f'background "{color}": "#rgb", "#rrggbb", {", ".join(_NAMED)}, or numbers from 0 to 1')
    numbers = tuple(float(c) for c in color)
    return numbers + (1.0,) if len(numbers) == 3 else numbers


def key_texts(keys: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Keywords as keys of a scene and their texts: short ones (``azimuth=30``), sections (``fog={"mode": "exp2"}``), and keys with two
    underscores in the place of the dot (``camera__fov_y=20``)."""
    texts = []
    for name, value in keys.items():
        if value is None:
            continue
        if name == "size":
            width, height = (value, value) if isinstance(value, int) else value
            texts += [("image.width", key_text(width)), ("image.height", key_text(height))]
        elif name == "background":
            texts.append(("image.background", key_text(background(value))))
        elif name in _SHORT:
            texts.append((_SHORT[name], key_text(value)))
        elif "__" in name:
            texts.append((name.replace("__", ".", 1), key_text(value)))
        elif isinstance(value, Mapping):
            texts += [(f"{name}.{key}", key_text(inner)) for key, inner in value.items() if inner is not None]
        else:
            texts.append((name, key_text(value)))
    return texts


def is_scene_path(path: str) -> bool:
    """Whether it names a scene file; the metadata of a Zarr ends like one."""
    name = os.path.basename(path).lower()
    return name.endswith((".toml", ".json")) and name != "zarr.json"


def scene_file(scene: Any, keys: Mapping[str, Any], volume_keys: Sequence[tuple[str, str]]) -> Any:
    """The scene that ``scene`` (None, a dict, a path, a Scene) and the keywords describe, of the volume that ``volume_keys`` name."""
    texts = [*volume_keys, *key_texts(keys)]
    if isinstance(scene, (str, os.PathLike)):
        path = os.fspath(scene)
        if not is_scene_path(path):
            raise ValueError(f"{path}: a scene file ends in .toml or .json")
        return _slicestack.SceneFile.read(path, texts)
    if scene is None:
        text = ""
    elif isinstance(scene, Scene):
        text = scene.to_toml()
    elif isinstance(scene, Mapping):
        text = json.dumps(scene, default=_plain)
    else:
        raise ValueError(f"scene: of type {type(scene).__name__}; a dict, a path or a Scene is needed")
    return _slicestack.SceneFile.parse(text, "", texts)


def volume_keys(volume: Volume) -> list[tuple[str, str]]:
    """Keys that stand for a volume which is there already."""
    return volume._native.keys or [("volume.path", "array")]


class Scene:
    """A scene with everything decided: what the camera fits, the transfer function, how many slices.

    Parameters
    ----------
    volume
        What it is decided for: a :class:`Volume`.
    scene
        A dict with the sections of a scene file (see :func:`schema`), the path of a scene file (``.toml``, ``.json``), another Scene, or
        nothing.
    keys
        Further keys, which win: ``preset``, ``azimuth``, ``elevation``, ``zoom`` (degrees; 1 fits), ``size`` (pixels: width, height),
        ``background``, ``count`` (slices), ``blend``; sections: ``fog={"mode": "exp2", "density": 0.02}``; or ``camera__fov_y=20``.
    """

    __slots__ = ("_native", "_file")

    def __init__(self, volume: Volume, scene: Any = None, **keys: Any) -> None:
        self._file = scene_file(scene, keys, volume_keys(volume))
        self._native = self._file.resolve(volume._native)

    @classmethod
    def _of(cls, native: Any, file: Any) -> Scene:
        scene = object.__new__(cls)
        scene._native, scene._file = native, file
        return scene

    @property
    def size(self) -> tuple[int, int]:
        """Columns and rows of the picture."""
        return self._native.size

    @property
    def warnings(self) -> list[str]:
        """What is likely not meant, one line each."""
        return self._native.warnings

    @property
    def notes(self) -> list[str]:
        """What was decided, and why, one line each."""
        return self._native.notes

    def to_toml(self) -> str:
        """The text of a scene file, in numbers that read back to the bit, without a volume."""
        return self._native.text("toml")

    def to_dict(self) -> dict[str, Any]:
        """The sections of a scene file, without a volume."""
        return json.loads(self._native.text("json"))

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes it as a scene file; name a volume when it is rendered."""
        path = os.fspath(path)
        if not is_scene_path(path):
            raise ValueError(f"{path}: a scene file ends in .toml or .json")
        text = self._native.text("json" if path.lower().endswith(".json") else "toml")
        part = f"{path}.part"
        with open(part, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(part, path)

    def __repr__(self) -> str:
        width, height = self.size
        return f"<slicestack.Scene: {width} x {height} pixels>"
