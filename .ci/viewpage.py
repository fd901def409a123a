"""The page of `slicestack view` in a browser, for view.py: how it is started, waited for and asked."""
import base64
import pathlib
import re
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
HEAD = ROOT.parent / "shared/data/cthead/CThead_256x256x113_int16be.raw.gz"
SCENE = f'[volume]\npath = "{HEAD}"\ndimensions = [256, 256, 113]\ntype = "i16"\nendian = "big"\nspacing = [1.0, 1.0, 2.0]\n'

failures = []


def check(good, what):
    print(f"{'ok  ' if good else 'FAIL'} {what}", file=sys.stderr)
    if not good:
        failures.append(what)


class Page:
    """The page in the browser's present window."""

    def __init__(self, browser, address):
        self.browser = browser
        browser.open(address)
        self.wait("return Boolean(window.slicestack)", "the page opens")
        self.rest()

    def wait(self, script, what, seconds=60):
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if self.browser.run(script):
                return
            time.sleep(0.03)
        raise SystemExit(f"view.py: waited {seconds} s in vain: {what}; the page says: {self.browser.run('return document.body.innerText')[:300]}")

    def rest(self):
        """Waits for the still frame."""
        time.sleep(0.2)
        self.wait("return window.slicestack.idle()", "a still frame")

    def bytes(self):
        """The still frame as the server sent it."""
        text = self.browser.run_async(
            "const bytes = new Uint8Array(await window.slicestack.still().blob.arrayBuffer());"
            "let text = ''; for (let n = 0; n < bytes.length; n += 8192) text += String.fromCharCode(...bytes.subarray(n, n + 8192)); return btoa(text)"
        )
        return base64.b64decode(text)

    def angle(self, label):
        return float(self.browser.run("return [...document.querySelectorAll('label')].find((l) => l.innerText.trim() === arguments[0]).querySelector('input').value", label))

    def opacity(self):
        return self.browser.run("return window.slicestack.document().transfer.opacity")

    def choose(self, css, value):
        self.browser.run("const s = document.querySelector(arguments[0]); s.value = arguments[1]; s.dispatchEvent(new Event('change'))", css, value)
        self.rest()

    def unfold(self):
        self.browser.run("document.querySelectorAll('#sections details').forEach((d) => (d.open = true))")

    def message(self):
        return self.browser.run("return document.getElementById('message').textContent")


def scene_in(folder):
    """What the view is given: a scene of the CT head, written into `folder`, or nothing, which shows a built-in volume."""
    if not HEAD.is_file():
        print(f"view.py: NO {HEAD.name} HERE: a built-in volume is shown, and its numbers are no others' to compare with", file=sys.stderr)
        return []
    scene = folder / "head.toml"
    scene.write_text(SCENE)
    return [scene]


def serve(command, folder):
    """Starts the view, and returns its process and its address."""
    process = subprocess.Popen([command, "view", *scene_in(folder), "--no-browser", "--port", "0"], stdout=subprocess.PIPE, text=True)
    for line in process.stdout:
        if found := re.search(r"http://\S+#[0-9a-f]{32}", line):
            return process, found.group()
    raise SystemExit(f"view.py: {command} view ended with status {process.wait()} and told no address")
