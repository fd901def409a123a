"""What view.py measures of the page of `slicestack view`, and the pictures that it takes of it."""
import pathlib
import re
import statistics
import time

from viewpage import check

# Turns the view step by step until so many more frames have come to the screen.
TURN_ON = """
const view = window.slicestack, until = view.counts.frames + args[0];
while (view.counts.frames < until) {
  const document = view.document(), { eye, target } = view.camera(), [x, y] = [eye[0] - target[0], eye[1] - target[1]];
  const [c, s] = [Math.cos(0.03), Math.sin(0.03)];
  view.show({ ...document, camera: { ...document.camera, eye: [target[0] + c * x - s * y, target[1] + s * x + c * y, eye[2]] } });
  await new Promise(requestAnimationFrame);
}
return true;
"""
# Frames before memory is looked at for the first time, and how much it may have grown by the end.
WARM, GROWN = 300, 1.1


def measure(page):
    """Turns the head with the mouse for five seconds, with and without light."""
    b = page.browser
    page.choose("#size", "512")
    rows = []

    def turn(name):
        b.run("const c = window.slicestack.counts; c.frames = 0; c.latencies.length = 0; c.stillAfter.length = 0")
        x, y = b.center("#frame")
        b.mouse("mousePressed", x, y)
        start, n = time.monotonic(), 0
        while (now := time.monotonic() - start) < 5:
            n += 1
            swing = 100 * (1 - abs((now / 2.5) % 2 - 1))
            b.mouse("mouseMoved", x + swing, y + 0.2 * swing)
            time.sleep(max(0, n / 60 - (time.monotonic() - start)))
        wall = time.monotonic() - start
        frames, latencies = b.run("const c = window.slicestack.counts; return [c.frames, c.latencies]")
        b.mouse("mouseReleased", x, y)
        page.rest()
        after = b.run("return window.slicestack.counts.stillAfter.at(-1)")
        rank = sorted(latencies)
        rows.append((name, frames / wall, statistics.median(rank), rank[int(0.95 * (len(rank) - 1))], after))

    lit = "return (window.slicestack.document().light?.model ?? 'none') !== 'none'"
    turn("lit" if b.run(lit) else "unlit")
    if b.run(lit):
        b.run("const d = window.slicestack.document(); window.slicestack.show({ ...d, light: { model: 'none' }, lights: undefined })")
        page.rest()
        turn("unlit")
    print(f"{'512 x 512':10} {'frames/s':>9} {'median ms':>10} {'95 % ms':>9} {'still ms':>9}")
    for name, rate, median, late, after in rows:
        print(f"{name:10} {rate:9.1f} {median:10.1f} {late:9.1f} {after:9.1f}")


def screens(page, folder):
    b = page.browser
    folder.mkdir(parents=True, exist_ok=True)
    for width, height in ((1280, 800), (400, 800)):
        for dark in (False, True):
            b.size(width, height, dark)
            time.sleep(0.5)
            page.rest()
            name = f"{width}-{'dark' if dark else 'light'}"
            b.run("document.querySelectorAll('#sections details').forEach((d, n) => (d.open = n < 2)); document.getElementById('panel').scrollTop = 0")
            b.screenshot(folder / f"{name}.png")
            page.unfold()
            time.sleep(3)
            page.rest()
            b.run("document.getElementById('show-handles').checked || document.getElementById('show-handles').click(); document.getElementById('frame').focus()")
            b.press("p")
            page.rest()
            tall = b.run("return document.getElementById('panel').scrollHeight")
            step = b.run("return document.getElementById('panel').clientHeight") - 40
            for part, top in enumerate(range(0, tall, step)):
                b.run("document.getElementById('panel').scrollTop = arguments[0]", top)
                b.screenshot(folder / f"{name}-panel-{part}.png")
            b.press("Escape", "?")
            b.screenshot(folder / f"{name}-help.png")
            b.press("Escape")
            b.run("document.getElementById('show-handles').click()")
            wide = b.run("return [document.documentElement.scrollWidth, document.getElementById('panel').scrollWidth - document.getElementById('panel').clientWidth]")
            check(wide[0] <= width and wide[1] <= 0, f"{name}: nothing is cut off at the side: {wide}")


def soak(page, frames, process):
    """Memory after many frames is what it was after the first few hundred."""
    b = page.browser

    def memory():
        page.rest()
        b.cdp("HeapProfiler.collectGarbage")
        heap = b.run("return performance.memory.usedJSHeapSize") / 2**20
        status = pathlib.Path(f"/proc/{process.pid}/status").read_text() if process else "VmRSS: 0"
        return heap, int(re.search(r"VmRSS:\s+(\d+)", status).group(1)) / 1024

    def turn(count):
        for _ in range(count // 100):
            if b.run_async(TURN_ON, 100) is not True:
                raise SystemExit("view.py: the view stopped turning")

    turn(WARM)
    before = memory()
    turn(frames)
    after = memory()
    told = f"{frames} frames: page {before[0]:.1f} to {after[0]:.1f} MiB, server {before[1]:.0f} to {after[1]:.0f} MiB"
    print(told)
    check(after[0] <= GROWN * before[0] + 2 and after[1] <= GROWN * before[1], f"memory does not grow: {told}")
