"""Dask arrays, in any chunks, on threads and on clusters: the picture of the whole."""

import os
import time

import numpy as np
import pytest

import slicestack
from conftest import field, transfer

dask = pytest.importorskip("dask")
da = pytest.importorskip("dask.array")
import slicestack.dask as sdask  # noqa: E402

SHAPE = (34, 40, 45)
BASE = {"size": (60, 50), "count": 90, "azimuth": 35, "elevation": 20, "background": "#204060"}
# What sums in another order come to.
CLOSE = 2e-6
# As parts are rendered.
WHOLE = {"slices__terminate": 0.0, "slices__accumulation": "compensated"}


def whole(array, **keys):
    """The picture of the array in one piece, as parts would sum it."""
    volume_keys = {key: keys.pop(key) for key in ("spacing", "affine", "rescale") if key in keys}
    blend = keys.get("blend", "over")
    return slicestack.render(slicestack.Volume(array, **volume_keys), **keys, **(WHOLE if blend == "over" else {"slices__terminate": 0.0}))


def far(a, b):
    return float(np.abs(a.array - b.array).max())


@pytest.mark.parametrize(
    "chunks",
    [
        (34, 40, 45),
        (17, 20, 45),
        (10, 11, 12),
        ((1, 3, 20, 10), (39, 1), (5, 40)),
        ((33, 1), (2,) * 20, (44, 1)),
        ((34,), (13, 14, 13), (1, 1, 1, 42)),
    ],
)
def test_any_chunks_make_the_picture_of_the_whole(chunks):
    array = field(SHAPE, "u2")
    keys = {**BASE, "transfer": transfer(0, 65535), "spacing": (1, 1.5, 0.7)}
    want = whole(array, **keys)
    got = sdask.render(da.from_array(array, chunks=chunks), **keys)
    assert far(got, want) <= CLOSE and want.array[..., :3].std() > 0.02


@pytest.mark.parametrize("kind", ["u1", "i1", "u2", "i2", "u4", "i4", "f4", "f8"])
def test_every_type(kind):
    array = field(SHAPE, kind)
    if kind[0] == "f":
        array[3, 4, 5] = np.nan
    keys = {**BASE, "transfer": transfer(float(np.nanmin(array)), float(np.nanmax(array)))}
    assert far(sdask.render(da.from_array(array, chunks=(20, 17, 13)), **keys), whole(array, **keys)) <= CLOSE


@pytest.mark.parametrize(
    "keys",
    [
        {"blend": "mip"},
        {"blend": "min"},
        {"blend": "average"},
        {"blend": "add", "render__window": [5.0, 10.0]},
        {"light": {"ambient": 0.3, "position": [60, 10, -30]}},
        {"transfer__classification": "pre-integrated"},
        {"transfer__classification": "second-order", "light": {"specular": 0.4}},
        {"fog": {"mode": "exp", "density": 0.02, "distance": "radial"}, "camera__projection": "perspective"},
        {"camera": {"eye": [20, 21, 18], "target": [40, 30, 10], "up": [0, 0, 1], "projection": "perspective", "fov_y": 80.0}, "azimuth": None, "elevation": None},
        {"clip": [{"normal": [1, 0.3, -0.2], "offset": 12}]},
        {"rescale": (-0.5, 40.0)},
    ],
    ids=lambda keys: next(iter(keys)) + "-" + str(next(iter(keys.values())))[:20],
)
def test_every_way_that_parts_can_render(keys):
    array = field(SHAPE, "i2") // 300
    low, high = (float(x) for x in (array.min(), array.max()))
    if "rescale" in keys:
        low, high = high * -0.5 + 40, low * -0.5 + 40
    looks = {"transfer": {**transfer(low, high)}}
    if "transfer__classification" in keys:
        keys = dict(keys)
        looks["transfer"]["classification"] = keys.pop("transfer__classification")
    keys = {**BASE, **looks, **keys}
    want = whole(array, **keys)
    got = sdask.render(da.from_array(array, chunks=(11, 20, 16)), **keys)
    assert far(got, want) <= CLOSE and want.array.std() > 0.02


def test_a_sheared_affine():
    array = field(SHAPE, "u1")
    affine = np.array([[1, 0.2, 0, 5], [-0.1, 0.9, 0.3, -7], [0, 0.1, -1.6, 2], [0, 0, 0, 1.0]])
    keys = {**BASE, "transfer": transfer(0, 255), "affine": affine}
    assert far(sdask.render(da.from_array(array, chunks=(12, 40, 15)), **keys), whole(array, **keys)) <= CLOSE


def test_one_chunk_gives_the_very_same_bytes():
    array = field(SHAPE, "u2")
    keys = {**BASE, "transfer": transfer(0, 65535)}
    assert sdask.render(da.from_array(array, chunks=SHAPE), **keys).compare(whole(array, **keys))["max"] < 1.2e-7


def test_what_a_scene_leaves_open_is_decided_once_for_all_parts():
    array = field((70, 80, 90), "u2")
    parts = sdask.Parts(da.from_array(array, chunks=(40, 40, 90)), spacing=(2, 1, 1))
    assert parts.range == (float(array.min()), float(array.max())) and parts.non_finite == 0
    scene = parts.scene(preset="fire" if "fire" in slicestack.presets() else next(iter(slicestack.presets())), size=40)
    text = scene.to_toml()
    assert "spacing = 0.5" in text and "tolerance" not in text
    image = parts.render(scene)
    # The same scene of the array in one piece.
    one = slicestack.Volume(array, spacing=(2, 1, 1))
    want = slicestack.render(one, slicestack.Scene(one, scene.to_dict(), **WHOLE))
    assert far(image, want) <= CLOSE


def test_a_turntable_reads_chunks_once_for_several_pictures():
    array = field((20, 20, 20), "u1")
    read = [0]

    def counted(block):
        read[0] += block.size > 0
        return block

    lazy = da.from_array(array, chunks=(20, 20, 10)).map_blocks(counted, dtype=array.dtype, meta=np.empty((0, 0, 0), "u1"))
    keys = {"transfer": transfer(0, 255), "size": 24, "count": 30}
    images = list(sdask.turntable(lazy, 4, batch=4, compute={"scheduler": "synchronous"}, **keys))
    # Once to look, once for all four.
    assert len(images) == 4 and read[0] <= 4
    around = list(slicestack.Renderer(array).turntable(4, **keys, **WHOLE))
    assert len({image.sha256() for image in images}) == 4
    assert max(far(ours, whole) for ours, whole in zip(images, around)) <= CLOSE


@pytest.mark.parametrize(
    "array, keys, line",
    [
        (lambda: np.zeros((4, 4, 4)), {}, "ndarray; a dask array is needed"),
        (lambda: da.zeros((4, 4)), {}, "of shape (4, 4); (z, y, x) is needed"),
        (lambda: da.zeros((4, 4, 4), dtype=complex), {}, "voxels of type complex128"),
        (lambda: da.zeros((4, 4, 4)), {"blend": "lmip"}, "render blend lmip: which maximum is the first"),
        (lambda: da.zeros((4, 4, 4)), {"render__filter": "cubic"}, "render filter cubic: a spline depends on voxels all around"),
        (lambda: da.zeros((4, 4, 4)), {"camera__azimut": 3}, "--camera.azimut: unknown key"),
    ],
)
def test_what_is_not_rendered_in_parts_is_refused_in_a_line(array, keys, line):
    with pytest.raises(ValueError) as raised:
        sdask.render(array(), size=8, count=4, transfer=transfer(0, 1), **keys)
    assert line in str(raised.value) and "\n" not in str(raised.value)


def test_slicestack_render_points_to_the_right_place():
    with pytest.raises(ValueError, match="slicestack.dask.render renders it in parts"):
        slicestack.render(da.zeros((4, 4, 4)))


# ---- clusters ------------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def client():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0", memory_limit=0) as cluster:
        with distributed.Client(cluster) as client:
            yield client


def test_a_local_cluster_makes_the_same_picture(client, tmp_path):
    zarr = pytest.importorskip("zarr")
    array = field((60, 50, 40), "u2")
    store = zarr.create_array(str(tmp_path / "a.zarr"), shape=array.shape, chunks=(16, 17, 40), dtype=array.dtype)
    store[:] = array
    keys = {**BASE, "transfer": transfer(0, 65535), "light": {"ambient": 0.4}}
    got = sdask.render(da.from_zarr(str(tmp_path / "a.zarr")), **keys)
    assert far(got, whole(array, **keys)) <= CLOSE
    # Whoever renders a part does not matter.
    assert got == sdask.render(da.from_zarr(str(tmp_path / "a.zarr")), compute={"scheduler": "threads"}, **keys)


def die_once(block, flag=""):
    """Ends the worker that comes here first."""
    if block.size > 0 and not os.path.exists(flag):
        with open(flag, "w"):
            pass
        os._exit(1)
    time.sleep(0.05)
    return block


def test_a_worker_that_dies_changes_nothing(client, tmp_path):
    array = field((40, 40, 40), "u1")
    keys = {**BASE, "transfer": transfer(0, 255)}
    chunked = da.from_array(array, chunks=(10, 40, 20))
    want = sdask.render(chunked, **keys)
    parts = sdask.Parts(chunked)
    # From now on one worker ends in the middle of the picture.
    flag = str(tmp_path / "dead")
    parts.array = chunked.map_blocks(die_once, flag=flag, dtype=array.dtype, meta=np.empty((0, 0, 0), "u1"))
    got = parts.render(**keys)
    assert os.path.exists(flag) and got == want
