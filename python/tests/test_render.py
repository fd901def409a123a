"""Pictures: the command's, to the byte."""

import json
import subprocess

import numpy as np
import pytest

import scenes
import slicestack
from conftest import field, transfer

SCENES = list(scenes.scenes())


def keywords(phantom, keys):
    return {"volume__phantom": phantom, "volume__size": 24, **{key.replace(".", "__"): value for key, value in keys.items()}}


def test_thirty_scenes_have_the_recorded_pixels_of_the_command():
    recorded = json.loads(scenes.RECORDED.read_text())
    assert len(SCENES) == 30 and set(recorded) == {name for name, _, _ in SCENES}
    different = [name for name, phantom, keys in SCENES if slicestack.render(**keywords(phantom, keys)).sha256() != recorded[name]]
    assert not different


def test_thirty_scenes_give_the_files_of_the_command(command, tmp_path):
    for name, phantom, keys in SCENES:
        for extension in ("npy", "png"):
            theirs, ours = tmp_path / f"theirs.{extension}", tmp_path / f"ours.{extension}"
            subprocess.run([command, "render", *scenes.flags(phantom, keys), "-o", theirs], check=True, capture_output=True)
            slicestack.render(**keywords(phantom, keys)).save(ours)
            assert theirs.read_bytes() == ours.read_bytes(), f"{name}.{extension}"


def test_a_path_a_scene_file_a_dict_and_an_array_give_the_same_picture(tmp_path):
    values = field((10, 12, 14), "i2")
    np.save(tmp_path / "waves.npy", values)
    keys = {"transfer": transfer(-30000, 30000), "slices": {"count": 60}, "image": {"width": 50, "height": 40}, "camera": {"azimuth": 20}}
    (tmp_path / "scene.json").write_text(json.dumps({"volume": {"path": "waves.npy"}, **keys}))
    volume = slicestack.Volume.open(tmp_path / "waves.npy")
    pictures = [
        slicestack.render(tmp_path / "waves.npy", keys),
        slicestack.render(tmp_path / "waves.npy", **keys),
        slicestack.render(tmp_path / "scene.json"),
        slicestack.render(scene=tmp_path / "scene.json"),
        slicestack.render(values, keys),
        slicestack.render(values, {**keys, "camera": {"azimuth": 90}}, azimuth=20),
        slicestack.render(volume, keys),
        slicestack.Renderer(volume).render(keys),
        slicestack.render(volume, slicestack.Scene(volume, keys)),
        slicestack.render(values, slicestack.Scene(volume, keys).to_dict()),
    ]
    assert len({picture.sha256() for picture in pictures}) == 1
    assert pictures[0].array[..., 3].max() > 0.3
    # A file and the array in it are the same volume.
    assert volume.sha256() == slicestack.Volume(values).sha256()


def test_short_keys_mean_what_they_mean_to_the_command():
    values = field((8, 9, 10), "u1")
    short = slicestack.render(values, transfer=transfer(0, 255), size=(33, 22), count=20, azimuth=10, elevation=5, zoom=1.2, background="#336699")
    place = {"azimuth": 10, "elevation": 5, "zoom": 1.2}
    image = {"width": 33, "height": 22, "background": [0.2, 0.4, 0.6, 1.0]}
    long = slicestack.render(values, {"transfer": transfer(0, 255), "camera": place, "image": image, "slices": {"count": 20}})
    assert short == long and (short.width, short.height) == (33, 22)
    assert short.array.shape == (22, 33, 4) and short.array.dtype == np.float32
    np.testing.assert_allclose(short.array[0, 0], [0.2, 0.4, 0.6, 1.0], atol=1e-6)


def test_how_it_is_run_changes_no_byte():
    values, keys = field((20, 20, 20)), {"transfer": transfer(0, 65535), "size": 40, "count": 50}
    want = slicestack.render(values, **keys)
    assert {slicestack.render(values, threads=threads, tile=tile, simd=simd, **keys).sha256() for threads, tile, simd in [(1, 8, "scalar"), (3, 16, "auto"), (2, 40, "scalar")]} == {want.sha256()}


def test_a_renderer_makes_many_views_and_a_turntable():
    renderer = slicestack.Renderer(field((16, 16, 16)), threads=2)
    keys = {"transfer": transfer(0, 65535), "size": 32, "count": 40}
    first = renderer.render(**keys, azimuth=0)
    second = renderer.render(**keys, azimuth=90)
    assert first != second and renderer.render(**keys, azimuth=0) == first
    around = list(renderer.turntable(4, **keys))
    assert len(around) == 4 and len({image.sha256() for image in around}) == 4
    assert [i.sha256() for i in slicestack.turntable(field((16, 16, 16)), 4, **keys)] == [i.sha256() for i in around]


def test_pictures_are_saved_read_shown_and_compared(tmp_path):
    image = slicestack.render(field((12, 12, 12)), transfer=transfer(0, 65535), size=24, count=30, background="white")
    for name in ("a.npy", "a.exr"):
        image.save(tmp_path / name)
        assert slicestack.Image.open(tmp_path / name) == image
    image.save(tmp_path / "a.png")
    assert image._repr_png_().startswith(b"\x89PNG") and 0 < image.compare(tmp_path / "a.png")["max"] < 0.01
    assert image.compare(image)["rms"] == 0 and image.compare(np.zeros((24, 24, 4), np.float32))["differing"] > 100
    assert slicestack.Image.from_array(image.array) == image
    assert image.stats["slices"] == 30 and image.stats["sha256"] == image.sha256() and image.stats["seconds"]["render"] > 0
    np.testing.assert_array_equal(np.asarray(image), image.array)
    with pytest.raises(ValueError, match="read-only"):
        image.array[0, 0, 0] = 1


def test_annotations_are_drawn_on_files_and_not_on_numbers(tmp_path):
    keys = {"transfer": transfer(0, 65535), "size": 120, "count": 30}
    plain = slicestack.render(field((12, 12, 12)), **keys)
    drawn = slicestack.render(field((12, 12, 12)), **keys, annotate={"box": True})
    assert drawn == plain and drawn.to_png() != plain.to_png()
    with pytest.raises(ValueError, match="annotate: a .npy file holds numbers"):
        drawn.save(tmp_path / "a.npy")
    assert not (tmp_path / "a.npy").exists()


@pytest.mark.parametrize(
    "call, kind, line",
    [
        (lambda: slicestack.render("nowhere.nrrd"), OSError, "nowhere.nrrd: "),
        (lambda: slicestack.render(field((4, 4, 4)), {"camera": {"azimut": 3}}), ValueError, "camera.azimut: unknown key; the nearest known one is camera.azimuth"),
        (lambda: slicestack.render(field((4, 4, 4)), azimut=3), ValueError, "--azimut: unknown key; the nearest known one is"),
        (lambda: slicestack.render(field((4, 4, 4)), count=-5), ValueError, "--slices.count"),
        (lambda: slicestack.render(field((4, 4, 4)), preset="no-such"), ValueError, "--transfer.preset"),
        (lambda: slicestack.render(field((4, 4, 4)), background="wit"), ValueError, 'background "wit"'),
        (lambda: slicestack.render(field((4, 4, 4)), threads=0), ValueError, "threads 0: at least one is needed"),
        (lambda: slicestack.render(field((4, 4, 4)), simd="mmx"), ValueError, "simd mmx: this machine has auto, "),
        (lambda: slicestack.render(scene={}), ValueError, "volume"),
        (lambda: slicestack.Image.open("nowhere.png"), OSError, "nowhere.png: "),
        (lambda: slicestack.render(field((4, 4, 4)), size=8, count=4).save("no-folder/a.png"), OSError, "no-folder"),
        (lambda: slicestack.render(field((4, 4, 4)), size=8, count=4).save("a.gif2"), ValueError, "a.gif2"),
        (lambda: slicestack.render(field((4, 4, 4)), size=8, count=4).save("a.png", depth=7), ValueError, "depth 7: 8 or 16"),
    ],
)
def test_errors_are_one_line_that_names_what_is_at_fault(call, kind, line):
    with pytest.raises(kind) as raised:
        call()
    said = str(raised.value)
    assert line in said and "\n" not in said


def test_errors_are_the_commands_own(command, tmp_path):
    bad = tmp_path / "bad.nrrd"
    bad.write_bytes(b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 9 9 9\nencoding: raw\n\n" + bytes(100))
    scene = tmp_path / "bad.toml"
    scene.write_text('[volume]\nphantom = "cloud"\n[fog]\nmode = "exp"\ndensity = -1.0\n')
    for path in (bad, scene):
        said = subprocess.run([command, "render", path, "-o", tmp_path / "x.png"], capture_output=True, text=True).stderr
        with pytest.raises(ValueError) as raised:
            slicestack.render(path)
        assert said.strip().removeprefix("error: ") == str(raised.value)


def test_presets_and_schema():
    assert "ct-bone" in slicestack.presets() and "camera" in slicestack.schema()["properties"]
    volume = slicestack.Volume.phantom("shepp-logan", 24)
    scene = slicestack.Scene(volume, preset="mr-brain", size=20)
    assert scene.size == (20, 20) and slicestack.Scene(volume, scene.to_dict()).to_toml() == scene.to_toml()


def test_a_scene_is_saved_as_a_scene_file(tmp_path):
    volume = slicestack.Volume(field((8, 8, 8)))
    scene = slicestack.Scene(volume, transfer=transfer(0, 65535), count=20, size=16)
    for name in ("a.toml", "a.json"):
        scene.save(tmp_path / name)
        assert slicestack.render(volume, tmp_path / name) == slicestack.render(volume, scene)
    with pytest.raises(ValueError, match="ends in .toml or .json"):
        scene.save(tmp_path / "a.txt")
