"""How long work behaves: progress, Ctrl-C, other threads, the import, the live view, the fixture."""

import importlib.metadata
import os
import pathlib
import subprocess
import sys
import threading
import time
import urllib.request

import numpy as np
import pytest

import slicestack
from conftest import field, transfer

SLOW = {"transfer": transfer(0, 65535), "size": 512, "slices": {"count": 200000, "terminate": 0.0}}


def test_progress_is_told_on_the_calling_thread_and_may_stop():
    heard = []

    def listen(what, done, total):
        heard.append((what, done, total, threading.get_ident()))
        return len(heard) < 4

    begun = time.monotonic()
    with pytest.raises(InterruptedError, match="stopped"):
        slicestack.render(field((64, 64, 64)), progress=listen, **SLOW)
    assert time.monotonic() - begun < 20
    assert {h[3] for h in heard} == {threading.get_ident()} and all(0 <= done <= total for _, done, total, _ in heard)

    def fail(what, done, total):
        raise KeyError(what)

    with pytest.raises(KeyError):
        slicestack.render(field((64, 64, 64)), progress=fail, **SLOW)
    # The next one is made.
    heard.clear()
    slicestack.render(field((64, 64, 64)), progress=lambda *step: heard.append(step), transfer=transfer(0, 65535), count=100)
    assert heard and heard[-1][1] == heard[-1][2]


CTRL_C = """
import os, signal, sys, threading, time
sys.path[:0] = sys.argv[1:]
import slicestack
from conftest import field
from test_run import SLOW
# A shell may have started the tests with the signal ignored.
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Timer(0.7, lambda: (print(time.monotonic(), flush=True), os.kill(os.getpid(), signal.SIGINT))).start()
try:
    slicestack.render(field((64, 64, 64)), **SLOW)
except KeyboardInterrupt:
    print(time.monotonic(), flush=True)
"""


def test_ctrl_c_stops_a_picture_in_the_making():
    told = subprocess.run([sys.executable, "-c", CTRL_C, str(pathlib.Path(__file__).parent)], capture_output=True, text=True, timeout=120)
    asked, ended = map(float, told.stdout.split())
    assert ended - asked < 2, told


def test_other_threads_run_meanwhile():
    counted, stop = [0], threading.Event()

    def count():
        while not stop.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    slicestack.render(field((64, 64, 64)), transfer=transfer(0, 65535), size=512, slices={"count": 2000, "terminate": 0.0}, threads=1)
    stop.set()
    thread.join()
    assert counted[0] > 50


def test_one_renderer_serves_several_threads():
    renderer = slicestack.Renderer(field((24, 24, 24)), threads=2)
    keys = {"transfer": transfer(0, 65535), "size": 48, "count": 60}
    want = [renderer.render(**keys, azimuth=20 * n).sha256() for n in range(6)]
    found = [None] * 6

    def one(n):
        found[n] = renderer.render(**keys, azimuth=20 * n).sha256()

    threads = [threading.Thread(target=one, args=(n,)) for n in range(6)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert found == want


def test_the_import_is_quick():
    code = "import time; t = time.perf_counter(); import slicestack; print(time.perf_counter() - t)"
    runs = [float(subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout) for _ in range(5)]
    print(f"import: {min(runs):.3f} s")
    assert min(runs) < 0.2


def test_stubs_name_what_there_is():
    import ast

    from slicestack import _slicestack

    path = pathlib.Path(slicestack.__file__).with_name("_slicestack.pyi")
    assert path.with_name("py.typed").exists()
    told = {}
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.ClassDef):
            told[node.name] = {item.name for item in node.body if isinstance(item, ast.FunctionDef)} - {"__new__"}
        elif isinstance(node, ast.FunctionDef):
            told[node.name] = None
    there = {name: value for name, value in vars(_slicestack).items() if not name.startswith("_")}
    assert set(there) == set(told)
    for name, members in told.items():
        if members is not None:
            assert {m for m in vars(there[name]) if not m.startswith("_")} == members, name


def test_public_things_say_what_they_take():
    for name in slicestack.__all__:
        thing = getattr(slicestack, name)
        if callable(thing):
            assert thing.__doc__, name
    for kind in (slicestack.Volume, slicestack.Image, slicestack.Scene, slicestack.Renderer, slicestack.View):
        for name, member in vars(kind).items():
            if not name.startswith("_") and (callable(member) or isinstance(member, (property, classmethod))):
                assert member.__doc__, f"{kind.__name__}.{name}"


def test_the_live_view_serves_its_page_and_ends():
    view = slicestack.view(field((16, 16, 16)), transfer=transfer(0, 65535), size=64, count=30)
    assert view.url.startswith("http://127.0.0.1:") and f'src="{view.url.split("#")[0]}' in view._repr_html_()
    answer = urllib.request.urlopen(view.url.split("#")[0], timeout=10)
    assert b"<html" in answer.read().lower()
    assert "http://localhost:*" in answer.headers["Content-Security-Policy"]
    view.stop()
    view.stop()
    assert "ended" in view._repr_html_()
    with pytest.raises(OSError):
        urllib.request.urlopen(view.url.split("#")[0], timeout=2)


pytest_plugins = ["pytester"]


def test_the_fixture_compares_with_pictures_on_record(pytester):
    pytester.makepyfile(
        """
        import numpy as np, slicestack

        def test_picture(slicestack_golden, request):
            array = np.zeros((8, 9, 4), np.float32)
            array[2:5] = float(request.config.getoption("--shade", 0.5) or 0.5)
            slicestack_golden(slicestack.Image.from_array(array), "shade.png", max_rms=0.01)
        """
    )
    pytester.makeconftest("def pytest_addoption(parser):\n    parser.addoption('--shade', default=None)\n")
    # Where the package is not installed its plugin has to be named.
    named = [] if any(e.name == "slicestack" for e in importlib.metadata.entry_points(group="pytest11")) else ["-p", "slicestack.testing"]
    run = lambda *words: pytester.runpytest_subprocess(*named, *words)  # noqa: E731
    run().assert_outcomes(failed=1)
    run("--slicestack-bless").assert_outcomes(passed=1)
    run().assert_outcomes(passed=1)
    result = run("--shade=0.9")
    result.assert_outcomes(failed=1)
    result.stdout.fnmatch_lines(["*shade.png: RMS*"])
