"""Arrays of every kind, looked at where they lie."""

import subprocess
import sys

import numpy as np
import pytest

import slicestack
from conftest import field, transfer

KINDS = ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"]
KEYS = {"size": 24, "count": 30}


def looks(array):
    return {"transfer": transfer(float(array.min()), float(array.max())), **KEYS}


@pytest.mark.parametrize("kind", KINDS)
def test_every_type_is_used_where_it_lies(kind):
    array = field((9, 10, 11), kind)
    volume = slicestack.Volume(array)
    assert volume.is_shared and not volume.copied and volume.dtype == array.dtype and volume.shape == (9, 10, 11)
    assert np.asarray(volume) is array
    image = slicestack.render(volume, **looks(array))
    # The picture is of what is in the array now: nothing of it was kept.
    again = slicestack.render(slicestack.Volume(array.copy()), **looks(array))
    assert image == again and image.array[..., 3].max() > 0.2
    read_only = array.copy()
    read_only.flags.writeable = False
    assert slicestack.Volume(read_only).is_shared


@pytest.mark.parametrize(
    "change, why",
    [
        (lambda a: np.asfortranarray(a), "does not lie in C order"),
        (lambda a: np.repeat(a, 2, axis=2)[..., ::2], "does not lie in C order"),
        (lambda a: a[::-1][::-1][:, ::-1][:, ::-1].transpose(2, 1, 0).copy().transpose(2, 1, 0), "does not lie in C order"),
        (lambda a: a.astype(a.dtype.newbyteorder(">")), "is in the other byte order"),
        (lambda a: a.astype(np.int64), "is of int64, which becomes int32"),
    ],
)
def test_what_lies_otherwise_is_copied_once_and_told(change, why):
    array = field((9, 10, 11), "u2")
    with pytest.warns(slicestack.CopyWarning, match=why):
        volume = slicestack.Volume(change(array))
    assert why in volume.copied
    assert slicestack.render(volume, **looks(array)).sha256() == slicestack.render(array, **looks(array)).sha256() or "int64" in why


def test_half_precision_and_booleans():
    with pytest.warns(slicestack.CopyWarning, match="half precision"):
        assert slicestack.Volume(field((5, 5, 5), "f4").astype(np.float16)).dtype == np.float32
    assert slicestack.Volume(field((5, 5, 5), "u1") > 100).dtype == np.uint8
    with pytest.raises(ValueError, match="only what fits int32"):
        slicestack.Volume(np.full((2, 2, 2), 1 << 40))


class Interface:
    """Nothing but ``__array_interface__``."""

    def __init__(self, array):
        self.__array_interface__ = array.__array_interface__
        self.array = array


class Dlpack:
    """Nothing but DLPack."""

    def __init__(self, array, device=None):
        self.array, self.device = array, device

    def __dlpack__(self, **keys):
        return self.array.__dlpack__()

    def __dlpack_device__(self):
        return self.device or self.array.__dlpack_device__()


def test_other_libraries_arrays_share_their_memory():
    array = field((6, 7, 8), "f4")
    for other in (Interface(array), Dlpack(array), memoryview(array)):
        volume = slicestack.Volume(other)
        assert volume.is_shared and np.shares_memory(np.asarray(volume), array), type(other)
    with pytest.raises(ValueError, match="device 2 of DLPack; bring it to the CPU"):
        slicestack.Volume(Dlpack(array, (2, 0)))


def test_colours():
    z, y, x = np.indices((6, 7, 8))
    rgba = np.stack([x * 30, y * 30, z * 40, x * 20], axis=-1).astype(np.uint8)
    volume = slicestack.Volume(rgba)
    assert volume.channels == "rgba" and volume.is_shared and volume.shape == (6, 7, 8)
    assert slicestack.render(volume, **KEYS).array[..., 3].max() > 0.1
    with pytest.warns(slicestack.CopyWarning, match="three colours"):
        assert slicestack.Volume(rgba[..., :3]).channels == "rgb"


@pytest.mark.parametrize(
    "array, keys, line",
    [
        (np.zeros((3, 3)), {}, "of shape (3, 3); (z, y, x) is needed"),
        (np.zeros((3, 3, 3, 7)), {}, "of shape (3, 3, 3, 7)"),
        (np.zeros((0, 3, 3)), {}, "without a voxel"),
        (np.zeros((3, 3, 3), complex), {}, "voxels of type complex128"),
        (np.zeros((3, 3, 3), "f4"), {"spacing": (1, 2)}, "spacing: 2 numbers; three are needed"),
        (np.zeros((3, 3, 3), "f4"), {"spacing": (1, 2, 0)}, "spacing along axis 2 is 0"),
        (np.zeros((3, 3, 3), "f4"), {"affine": np.eye(3)}, "affine: of shape (3, 3)"),
        (np.zeros((3, 3, 3), "f4"), {"affine": np.eye(4), "origin": (0, 0, 0)}, "affine: tells spacing and origin already"),
        (np.zeros((3, 3, 3), "f4"), {"space": "xyz"}, 'space "xyz"'),
        (np.zeros((3, 3, 3), "f4"), {"labels": True}, "label"),
        (np.zeros((3, 3, 3), "f4"), {"rescale": (0, 1)}, "slope 0"),
        ("head.nrrd", {}, "is a path; Volume.open reads files"),
    ],
)
def test_what_is_no_volume_is_refused_in_a_line(array, keys, line):
    with pytest.raises(ValueError) as raised:
        slicestack.Volume(array, **keys)
    assert line in str(raised.value) and "\n" not in str(raised.value)


def test_places_in_the_world():
    array = field((4, 5, 6), "u1")
    volume = slicestack.Volume(array, spacing=(0.5, 2, 3), origin=(1, 2, 3))
    assert volume.spacing == (0.5, 2, 3) and volume.origin == (1, 2, 3)
    turned = np.array([[0, -1, 0, 4], [1, 0, 0, 5], [0, 0, 2, 6], [0, 0, 0, 1.0]])
    np.testing.assert_allclose(slicestack.Volume(array, affine=turned).affine, turned)


def test_the_array_lives_as_long_as_the_volume():
    volume = slicestack.Volume(field((20, 20, 20)))
    volume._array = None
    junk = [np.full((20, 20, 20), n, "u2") for n in range(50)]
    assert slicestack.render(volume, transfer=transfer(0, 65535), **KEYS).array[..., 3].max() > 0.2 and junk


MEMORY = """
import resource, sys
import numpy as np
import slicestack

array = np.empty((512, 512, 512), np.uint16)
ramp = np.arange(512, dtype=np.uint16) * 100
for z in range(512):
    array[z] = ramp[None, :] // 2 + z * 20 + ramp[:, None] // 4
peak = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
before = peak()
image = slicestack.render(array, size=256, count=200, transfer={"color": [[0, 1, 1, 1], [60000, 1, 0, 0]], "opacity": [[20000, 0], [60000, 0.1]]})
assert image.array[..., 3].max() > 0.3
print(array.nbytes >> 20, peak() - before)
"""


def test_a_large_array_is_rendered_without_its_copy():
    if sys.platform != "linux":
        pytest.skip("memory is measured as Linux counts it")
    told = subprocess.run([sys.executable, "-c", MEMORY], check=True, capture_output=True, text=True).stdout.split()
    array, more = map(int, told)
    print(f"array of {array} MiB: {more} MiB more at the peak")
    assert array == 256 and more < 128
