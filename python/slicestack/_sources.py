"""What other libraries' images tell: the array, and where it lies in the world."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

Three = list[float]


@dataclass
class Found:
    """An array, and what is known of its place in the world."""

    array: Any
    origin: Three = field(default_factory=lambda: [0.0, 0.0, 0.0])
    # Steps along x, y and z in the world, each three numbers.
    steps: list[Three] = field(default_factory=lambda: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    space: str = ""
    rescale: tuple[float, float] = (1.0, 0.0)
    modality: str = ""
    unit: str = ""
    name: str = ""


def three(numbers: Sequence[float], what: str) -> Three:
    """Three numbers, along x, y, z."""
    numbers = [float(x) for x in numbers]
    if len(numbers) != 3:
        raise ValueError(f"{what}: {len(numbers)} numbers; three are needed, along x, y, z")
    return numbers


def of_affine(affine: Any) -> tuple[Three, list[Three]]:
    """Origin and steps of a 4 x 4 matrix from index to world."""
    import numpy as np

    m = np.asarray(affine, float)
    if m.shape != (4, 4):
        raise ValueError(f"affine: of shape {m.shape}; (4, 4) is needed")
    return m[:3, 3].tolist(), m[:3, :3].T.tolist()


def with_lengths(steps: list[Three], lengths: Three) -> list[Three]:
    """The steps with other lengths; a negative one turns an axis around."""
    import math

    return [[x / math.hypot(*step) * length for x in step] for step, length in zip(steps, lengths)]


def _of(data: Any, module: str, name: str) -> bool:
    """Whether it is an instance of a class of a library, which is not imported for the question."""
    kind = getattr(sys.modules.get(module), name, None)
    return isinstance(kind, type) and isinstance(data, kind)


def read(data: Any) -> Found:
    """What ``data`` is."""
    if isinstance(data, (str, bytes, os.PathLike)):
        raise ValueError(f"{os.fspath(data)!r}: is a path; Volume.open reads files")
    if _of(data, "xarray", "DataArray"):
        return _of_xarray(data)
    if _of(data, "SimpleITK", "Image"):
        return _of_simpleitk(data)
    if _of(data, "nibabel.spatialimages", "SpatialImage"):
        return _of_nibabel(data)
    if _of(data, "pydicom.dataset", "Dataset"):
        return _of_pydicom([data])
    if isinstance(data, (list, tuple)) and data and all(_of(d, "pydicom.dataset", "Dataset") for d in data):
        return _of_pydicom(list(data))
    if _of(data, "dask.array", "Array"):
        raise ValueError("a dask array: slicestack.dask.render renders it in parts, without bringing it into one memory")
    return Found(as_array(data))


def as_array(data: Any) -> Any:
    """An array of NumPy that looks at the memory of ``data``."""
    import numpy as np

    if isinstance(data, np.ndarray):
        return data
    # Libraries of tensors say by DLPack where their memory is.
    if hasattr(data, "__dlpack__") and hasattr(data, "__dlpack_device__") and not hasattr(data, "__array_interface__"):
        device = data.__dlpack_device__()[0]
        if int(device) != 1:
            raise ValueError(f"array: lies on device {int(device)} of DLPack; bring it to the CPU first")
        return np.from_dlpack(data)
    return np.asarray(data)


def voxels(array: Any, labels: bool) -> tuple[Any, str, str]:
    """The array as its voxels are used, what they are, and why it was copied, if it was."""
    import numpy as np

    shape = array.shape
    if array.ndim not in (3, 4) or array.ndim == 4 and shape[3] not in (3, 4):
        raise ValueError(f"array: of shape {shape}; (z, y, x) is needed, or (z, y, x, 3) or (z, y, x, 4) of colours")
    if 0 in shape:
        raise ValueError(f"array: of shape {shape}: without a voxel")
    channels = "labels" if labels else "scalar"
    why = ""
    if array.dtype == bool:
        # As bytes they are 0 and 1 already.
        array = array.view(np.uint8)
    if array.dtype == np.float16:
        array, why = array.astype(np.float32), "is of half precision, which becomes float32"
    if array.dtype in (np.int64, np.uint64):
        kind = np.dtype("i4" if array.dtype == np.int64 else "u4")
        low, high = array.min(), array.max()
        if low < np.iinfo(kind).min or high > np.iinfo(kind).max:
            raise ValueError(f"array: {array.dtype} from {low} to {high}: only what fits {kind} is rendered; convert it to float64")
        array, why = array.astype(kind), f"is of {array.dtype}, which becomes {kind}"
    if array.dtype.str[1:] not in ("u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"):
        raise ValueError(f"array: voxels of type {array.dtype}: u1, i1, u2, i2, u4, i4, f4 and f8 are rendered")
    if not array.dtype.isnative:
        array, why = array.astype(array.dtype.newbyteorder("=")), "is in the other byte order"
    elif array.dtype.byteorder in "<>":
        # Named, and this machine's own.
        array = array.view(array.dtype.newbyteorder("="))
    if array.ndim == 4:
        if labels:
            raise ValueError(f"array: of shape {shape}: labels are one number each")
        channels = "rgba"
        if shape[3] == 3:
            full = np.empty((*shape[:3], 4), array.dtype)
            full[..., :3] = array
            full[..., 3] = np.iinfo(array.dtype).max if array.dtype.kind in "ui" else 1
            array, channels, why = full, "rgb", "has three colours a voxel, which become four"
    if not array.flags.c_contiguous:
        array, why = np.ascontiguousarray(array), "does not lie in C order, x fastest"
    if not array.flags.aligned:
        array, why = array.copy(), "is not aligned"
    return array, channels, why


def _steps(values: Any, what: str) -> float:
    """The distance of coordinates that are evenly spaced."""
    import numpy as np

    values = np.asarray(values, float)
    if len(values) < 2:
        return 1.0
    step = (values[-1] - values[0]) / (len(values) - 1)
    off = np.abs(np.diff(values) - step).max()
    if step == 0 or off > 1e-3 * abs(step):
        raise ValueError(f"{what}: its coordinates are not evenly spaced: steps of {np.diff(values).min():g} to {np.diff(values).max():g}")
    return float(step)


def _of_xarray(data: Any) -> Found:
    dims = data.dims[:3]
    origin, lengths = [0.0] * 3, [1.0] * 3
    for axis, dim in enumerate(dims):
        if dim in data.coords and data.coords[dim].dtype.kind in "iuf":
            # Dimensions are told z first, lengths x first.
            lengths[2 - axis] = _steps(data.coords[dim].values, f"xarray: {dim}")
            origin[2 - axis] = float(data.coords[dim].values[0])
    steps = [[lengths[axis] if axis == other else 0.0 for other in range(3)] for axis in range(3)]
    units = {str(data.coords[d].attrs.get("units", "")) for d in dims if d in data.coords}
    unit = units.pop() if len(units) == 1 else ""
    known = unit if unit in ("m", "cm", "mm", "um", "nm") else ""
    return Found(as_array(data.data), origin, steps, unit=known, name=str(data.name or ""))


def _of_simpleitk(image: Any) -> Found:
    import SimpleITK

    if image.GetDimension() != 3:
        raise ValueError(f"SimpleITK: an image of {image.GetDimension()} dimensions; 3 are needed")
    direction, spacing = image.GetDirection(), image.GetSpacing()
    steps = [[direction[3 * row + axis] * spacing[axis] for row in range(3)] for axis in range(3)]
    return Found(SimpleITK.GetArrayViewFromImage(image), list(image.GetOrigin()), steps, space="lps", unit="mm")


def _of_nibabel(image: Any) -> Found:
    import numpy as np

    # Scaled integers stay integers, with their slope beside them.
    slope, intercept = getattr(image.dataobj, "slope", 1.0), getattr(image.dataobj, "inter", 0.0)
    unscaled = getattr(image.dataobj, "get_unscaled", None)
    array = np.asarray(unscaled() if unscaled else image.dataobj)
    if array.ndim != 3:
        raise ValueError(f"nibabel: an image of shape {array.shape}; three axes are needed")
    origin, steps = of_affine(image.affine)
    # Its arrays are indexed (x, y, z), and lie x fastest.
    rescale = (float(slope), float(intercept)) if unscaled else (1.0, 0.0)
    return Found(array.T, origin, steps, space="ras", rescale=rescale, unit="mm")


def _of_pydicom(datasets: list[Any]) -> Found:
    import numpy as np

    first = datasets[0]
    orientation = [float(x) for x in getattr(first, "ImageOrientationPatient", (1, 0, 0, 0, 1, 0))]
    along, down = np.array(orientation[:3]), np.array(orientation[3:])
    normal = np.cross(along, down)
    row, column = (float(x) for x in getattr(first, "PixelSpacing", (1, 1)))
    modality = {"CT": "ct", "MR": "mr"}.get(str(getattr(first, "Modality", "")), "other")
    rescale = (float(getattr(first, "RescaleSlope", 1) or 1), float(getattr(first, "RescaleIntercept", 0) or 0))
    if len(datasets) == 1:
        array = first.pixel_array
        if array.ndim == 2:
            array = array[None]
        step = float(getattr(first, "SpacingBetweenSlices", None) or getattr(first, "SliceThickness", None) or 1)
        place, across = np.array([float(x) for x in getattr(first, "ImagePositionPatient", (0, 0, 0))]), normal * step
    else:
        for other in datasets[1:]:
            for key in ("ImageOrientationPatient", "PixelSpacing", "Rows", "Columns", "RescaleSlope", "RescaleIntercept"):
                if getattr(other, key, None) != getattr(first, key, None):
                    raise ValueError(f"pydicom: {key} differs between slices: {getattr(first, key, None)} and {getattr(other, key, None)}")
        places = [np.array([float(x) for x in d.ImagePositionPatient]) for d in datasets]
        order = sorted(range(len(datasets)), key=lambda i: float(places[i] @ normal))
        _steps([places[i] @ normal for i in order], "pydicom: slices")
        array = np.stack([datasets[i].pixel_array for i in order])
        place, across = places[order[0]], (places[order[-1]] - places[order[0]]) / (len(order) - 1)
    steps = [(along * column).tolist(), (down * row).tolist(), across.tolist()]
    return Found(array, place.tolist(), steps, space="lps", rescale=rescale, modality=modality, unit="mm")
