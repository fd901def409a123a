"""A browser driven by the W3C's WebDriver protocol, with Python's standard library alone: chromedriver is started and spoken to over HTTP."""
import base64
import json
import os
import shutil
import socket
import subprocess
import time
import urllib.error
import urllib.request

ELEMENT = "element-6066-11e4-a52e-4f735466cecf"
# Code points that WebDriver has for keys without a character.
KEYS = {
    "Tab": "\ue004", "Enter": "\ue007", "Shift": "\ue008", "Control": "\ue009", "Escape": "\ue00c", "PageUp": "\ue00e", "PageDown": "\ue00f", "End": "\ue010", "Home": "\ue011",
    "ArrowLeft": "\ue012", "ArrowUp": "\ue013", "ArrowRight": "\ue014", "ArrowDown": "\ue015", "Insert": "\ue016", "Delete": "\ue017",
}


class Browser:
    """One headless Chromium. Use it in a `with`: it ends with it."""

    def __init__(self, width=1280, height=800, downloads=None):
        driver, browser = shutil.which("chromedriver"), shutil.which("chromium") or shutil.which("google-chrome")
        if not driver or not browser:
            raise SystemExit("webdriver.py: needs chromium and chromedriver (Debian: chromium, chromium-driver)")
        with socket.socket() as s:
            s.bind(("127.0.0.1", 0))
            port = s.getsockname()[1]
        self.process = subprocess.Popen([driver, f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.base = f"http://127.0.0.1:{port}"
        self.path = ""
        args = ["--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--hide-scrollbars", f"--window-size={width},{height}"]
        prefs = {"download.default_directory": os.fspath(downloads), "download.prompt_for_download": False} if downloads else {}
        options = {"binary": browser, "args": args, "prefs": prefs}
        wanted = {"browserName": "chrome", "goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "ALL"}}
        for _ in range(100):
            try:
                self.call("GET", "/status")
                break
            except urllib.error.URLError:
                time.sleep(0.1)
        session = self.call("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})
        self.path = f"/session/{session['sessionId']}"
        self.call("POST", "/timeouts", {"script": 120_000})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        try:
            self.call("DELETE", "")
        except OSError:
            pass
        self.process.terminate()
        self.process.wait(10)

    def call(self, method, path, body=None):
        """The value that the driver answers with."""
        data = json.dumps(body or {}).encode() if method == "POST" else None
        request = urllib.request.Request(self.base + self.path + path, data, {"Content-Type": "application/json"}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=120) as answer:
                return json.load(answer)["value"]
        except urllib.error.HTTPError as e:
            told = json.load(e)["value"]
            raise RuntimeError(f"{method} {path}: {told['error']}: {told['message'].splitlines()[0]}") from None

    def open(self, address):
        self.call("POST", "/url", {"url": address})

    def run(self, script, *args):
        """What `script`, the body of a function, returns."""
        return self.call("POST", "/execute/sync", {"script": script, "args": list(args)})

    def run_async(self, script, *args):
        """What `script` resolves to: the body of an async function."""
        wrapped = f"const done = arguments[arguments.length - 1]; (async (...args) => {{ {script} }})(...arguments).then(done, (e) => done(String(e)));"
        return self.call("POST", "/execute/async", {"script": wrapped, "args": list(args)})

    def cdp(self, command, **params):
        """A command of Chromium's own protocol."""
        return self.call("POST", "/goog/cdp/execute", {"cmd": command, "params": params})

    def element(self, css):
        return self.call("POST", "/element", {"using": "css selector", "value": css})[ELEMENT]

    def label(self, css):
        """The name that a screen reader says."""
        return self.call("GET", f"/element/{self.element(css)}/computedlabel")

    def click(self, css):
        self.call("POST", f"/element/{self.element(css)}/click")

    def center(self, css):
        return self.run("const b = document.querySelector(arguments[0]).getBoundingClientRect(); return [b.x + b.width / 2, b.y + b.height / 2]", css)

    def mouse(self, kind, x, y, **more):
        """A mouse event as the system would send it: mousePressed, mouseMoved, mouseReleased or mouseWheel."""
        held = {"button": "left", "buttons": 0 if kind == "mouseReleased" else 1, "clickCount": 1}
        self.cdp("Input.dispatchMouseEvent", type=kind, x=x, y=y, **{**held, **more})

    def drag(self, start, by, steps=8):
        (x, y), (dx, dy) = start, by
        self.mouse("mousePressed", x, y)
        for n in range(1, steps + 1):
            self.mouse("mouseMoved", x + dx * n / steps, y + dy * n / steps)
        self.mouse("mouseReleased", x + dx, y + dy)

    def press(self, *keys):
        """Keys one after the other; "Control+Shift+z" holds what stands before the last."""
        actions = []
        for chord in keys:
            parts = [chord] if chord == "+" else chord.split("+")
            codes = [KEYS.get(part, part) for part in parts]
            actions += [{"type": "keyDown", "value": code} for code in codes]
            actions += [{"type": "keyUp", "value": code} for code in reversed(codes)]
        self.call("POST", "/actions", {"actions": [{"type": "key", "id": "keys", "actions": actions}]})

    def size(self, width, height, dark=False):
        self.cdp("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=False)
        self.cdp("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark" if dark else "light"}])

    def screenshot(self, path):
        path.write_bytes(base64.b64decode(self.call("GET", "/screenshot")))

    def log(self):
        """What was written on the console since the last call, worse than a note."""
        return [entry["message"] for entry in self.call("POST", "/se/log", {"type": "browser"}) if entry["level"] in ("SEVERE", "WARNING")]
