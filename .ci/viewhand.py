"""What a new hand does with the page of `slicestack view`, for view.py: slowly, with two fingers, with choices that need others, and after the
view has ended."""
import json
import subprocess
import time

from viewpage import check

DOCUMENT = "return window.slicestack.document()"
CAN_UNDO = "return !document.getElementById('undo').disabled"


def steps(page):
    """What a hand does without letting go is one step of undo."""
    b = page.browser
    before, was = page.bytes(), b.run(CAN_UNDO)

    def undone(what):
        page.rest()
        check(page.bytes() != before, f"{what} changes the picture")
        b.press("Control+z")
        page.rest()
        check(page.bytes() == before and b.run(CAN_UNDO) == was, f"{what} is one step of undo")

    x, y = b.center("#frame")
    b.mouse("mousePressed", x, y)
    for n in range(1, 4):
        b.mouse("mouseMoved", x + 20 * n, y)
        time.sleep(0.8)
    b.mouse("mouseReleased", x + 60, y)
    undone("a drag with pauses")
    b.run("document.getElementById('frame').focus()")
    for n in range(6):
        b.cdp("Input.dispatchKeyEvent", type="rawKeyDown", key="ArrowRight", code="ArrowRight", windowsVirtualKeyCode=39, autoRepeat=n > 0)
        time.sleep(0.5 if n == 0 else 0.1)
    b.cdp("Input.dispatchKeyEvent", type="keyUp", key="ArrowRight", code="ArrowRight", windowsVirtualKeyCode=39)
    undone("a key that is held down")
    for _ in range(4):
        b.cdp("Input.dispatchMouseEvent", type="mouseWheel", x=x, y=y, deltaX=0, deltaY=-60)
        time.sleep(0.05)
    time.sleep(1)
    undone("a turn of the wheel")
    b.size(1000, 700)
    time.sleep(0.3)
    page.rest()
    check(b.run(CAN_UNDO) == was, "another size of the picture is no step")
    b.size(1280, 800)
    time.sleep(0.3)
    page.rest()
    check(page.bytes() == before, "and the first size shows the first picture")


def gestures(page):
    """Keys stop at the pole, two fingers that move alike do not zoom, and the keys are shown from the top."""
    b = page.browser
    b.press("Home")
    b.press(*["ArrowUp"] * 24)
    page.rest()
    check(abs(page.angle("Elevation") - 90) < 0.01, f"the arrow key upwards stops above: {page.angle('Elevation')}")
    b.press("Home")
    page.rest()
    height = "return window.slicestack.camera().height"
    was, eye = b.run(height), b.run("return window.slicestack.camera().eye")
    x, y = b.center("#frame")

    def touch(kind, n=0, spread=0):
        points = [] if kind == "touchEnd" else [{"x": x - 60 - spread + 8 * n, "y": y + 5 * n, "id": 1}, {"x": x + 60 + spread + 8 * n, "y": y + 5 * n, "id": 2}]
        b.cdp("Input.dispatchTouchEvent", type=kind, touchPoints=points)
        time.sleep(0.06)

    touch("touchStart")
    for n in range(1, 8):
        touch("touchMove", n)
    touch("touchEnd")
    page.rest()
    check(b.run(height) == was and b.run("return window.slicestack.camera().eye") != eye, "two fingers that move alike move the view, and do not zoom")
    touch("touchStart")
    for n in range(1, 8):
        touch("touchMove", 0, 6 * n)
    touch("touchEnd")
    page.rest()
    check(b.run(height) < was, "two fingers that part zoom")
    b.press("Home")
    page.rest()
    b.size(400, 800)
    b.press("?")
    check(b.run("return document.getElementById('help').scrollTop") == 0, "the keys are shown from the top")
    b.press("Escape")
    b.size(1280, 800)
    time.sleep(0.3)
    page.rest()


def probing(page):
    b = page.browser
    x, y = b.center("#frame")
    words = "return document.getElementById('probe-words').innerText"
    b.drag((x, y), (0, 0), 1)
    page.wait("return document.getElementById('probe-words').innerText.startsWith('Value')", "the card of the probe")
    seen = b.run("const c = document.getElementById('probe-card').getBoundingClientRect(), s = document.getElementById('stage').getBoundingClientRect(); return c.width > 0 && c.left >= s.left && c.right <= s.right && c.bottom <= s.bottom")
    check(seen and "Voxel" in b.run(words), f"a click shows value and place beside the cross: {b.run(words)!r}")
    place = "const c = document.querySelector('.crosshair').getBoundingClientRect(), f = document.getElementById('frame').getBoundingClientRect(); return (c.x + c.width / 2 - f.x) / f.width"
    was = b.run(place)
    b.size(1000, 700)
    time.sleep(0.3)
    page.rest()
    check(abs(b.run(place) - was) < 0.01, "the cross stays in its place when the picture changes size")
    b.size(1280, 800)
    time.sleep(0.3)
    page.rest()
    area = b.run("const f = document.getElementById('frame').getBoundingClientRect(); return [f.x + 3, f.y + 3]")
    b.drag(area, (0, 0), 1)
    page.wait("return document.getElementById('probe-words').innerText === 'Nothing here.'", "empty space is told")
    check(True, "empty space is told")
    b.press("Escape")
    check(not b.run("return document.getElementById('probe-card').checkVisibility()"), "Escape puts the card away")


def planes(page):
    b = page.browser
    before = page.bytes()
    page.unfold()
    press = "[...document.querySelectorAll('#crop-fields button')].find((x) => x.innerText === arguments[0]).click()"
    count = "return document.getElementById('plane-count').innerText"
    check(b.run("return [...document.querySelectorAll('#crop-fields button')].find((x) => x.innerText === 'Remove this plane').disabled"), "without a plane there is none to remove")
    b.run(press, "Add a plane")
    page.rest()
    at = "const e = document.querySelector(arguments[0]).getBoundingClientRect(); return [e.x + e.width / 2, e.y + e.height / 2]"
    middle, tip = (b.run(at, css) for css in (".handle.free:not(.tip)", ".handle.tip"))
    apart = ((middle[0] - tip[0]) ** 2 + (middle[1] - tip[1]) ** 2) ** 0.5
    check(apart > 30, f"the handles of a new plane lie apart: {apart:.0f} pixels")
    b.mouse("mousePressed", *tip)
    seen = []
    for n in range(1, 9):
        b.mouse("mouseMoved", tip[0] + 5 * n, tip[1] + 3 * n)
        time.sleep(0.1)
        seen.append(b.run(at, ".handle.free:not(.tip)"))
    b.mouse("mouseReleased", tip[0] + 40, tip[1] + 24)
    page.rest()
    seen.append(b.run(at, ".handle.free:not(.tip)"))
    most = max(max(abs(p[k] - q[k]) for k in (0, 1)) for p, q in zip(seen, seen[1:]))
    check(most < 12, f"a plane that is turned does not jump: {most:.1f} pixels")
    b.run(press, "Add a plane")
    page.rest()
    check(b.run(count) == "Plane 2 of 2", f"planes are counted: {b.run(count)}")
    b.run(press, "Previous")
    time.sleep(0.1)
    check(b.run(count) == "Plane 1 of 2", f"and chosen: {b.run(count)}")
    second = b.run(DOCUMENT)["clip"][1]
    b.run(press, "Remove this plane")
    page.rest()
    check(b.run(DOCUMENT)["clip"] == [second], "the plane that is chosen is the one that goes")
    b.run(press, "Remove this plane")
    page.rest()
    check(page.bytes() == before, "without planes the picture is what it was")
    if b.run("return document.getElementById('show-handles').checked"):
        b.run("document.getElementById('show-handles').click()")
    check(not b.run("return document.querySelectorAll('[data-handle]').length"), "no handle is left over the picture")


def numbers(page):
    """Fields show what is in force; words go with what they tell of; slices show tissue."""
    b = page.browser
    page.unfold()
    opened = page.bytes()
    check(b.run("return document.querySelectorAll('#sections summary h2').length") > 9, "sections are headings")
    b.run("const i = [...document.querySelectorAll('label')].find((l) => l.innerText.trim() === 'Window centre' || l.innerText.trim().startsWith('Slice along z')).querySelector('input'); i.click()")
    page.rest()
    window, span = b.run(DOCUMENT)["cut"][0].get("window"), b.run("return [...document.querySelectorAll('#data-facts dd')][2].innerText")
    low, high = (float(word) for word in span.split(" to "))
    check(window and window[1] < 0.999 * (high - low), f"a slice shows a window and not all values from {low} to {high}: {window}")
    b.press("Control+z")
    page.rest()
    check(page.bytes() == opened, "undo takes the slice away")
    b.run("const i = [...document.querySelectorAll('label')].find((l) => l.innerText.trim() === 'Elevation').querySelector('input'); i.focus(); i.select()")
    b.press("1", "9", "9", "Enter")
    page.rest()
    check(page.angle("Elevation") == 90 and "Elevation" in page.message(), f"a number that is too large is told: {page.message()}")
    b.run("document.activeElement.blur()")
    b.press("Control+z")
    page.rest()
    b.run("document.querySelector('[data-point=opacity-1]').focus()")
    b.press(" ", "9", "9", "9", "9", "9", "9", "Enter")
    time.sleep(0.2)
    value = float(b.run("return document.activeElement.value"))
    check(abs(value / page.opacity()[1][0] - 1) < 1e-5 and page.opacity()[1][0] == page.opacity()[2][0], f"space marks a point's number, and it shows what is in force: {value}")
    check("neighbours" in page.message(), f"and the page says why: {page.message()}")
    page.rest()
    b.press("Escape")
    b.run("document.getElementById('frame').focus()")
    b.press("Control+z")
    page.rest()
    said = page.message()
    check(said == "" and page.bytes() == opened, "words go when what they tell of is undone")


def methods(page):
    """Choices that need others bring them along, and the page says so."""
    b = page.browser
    page.unfold()
    b.size(480, 420)
    page.rest()
    before = page.bytes()
    choose = "const l = [...document.querySelectorAll('#method-fields label')].find((x) => x.querySelector('span').innerText === arguments[0]), s = l.querySelector('select'); s.value = arguments[1]; s.dispatchEvent(new Event('change'))"
    for label, value, key, told in (("Algorithm", "rays", "algorithm", "number of slices"), ("Algorithm", "shells", "algorithm", ""), ("Blend", "mip", "blend", ""), ("Algorithm", "coin-flips", "algorithm", "")):
        b.run(choose, label, value)
        page.wait(f"return window.slicestack.document().render.{key} === '{value}' || document.getElementById('message').textContent.length > 0", f"{label} {value}", 120)
        said = page.message()
        check(b.run(DOCUMENT)["render"][key] == value and told in said, f"{label} {value} is taken: {said}")
        b.press("Control+z")
        page.rest()
        check(page.bytes() == before, f"one step takes {value} back")
    b.size(1280, 800)
    time.sleep(0.3)
    page.rest()


def reloading(page):
    """A reload keeps what was made, with undo to what was opened."""
    b = page.browser
    opened = page.bytes()
    b.run("document.getElementById('frame').focus()")
    b.press("ArrowRight", "+")
    page.rest()
    made, camera = page.bytes(), b.run("return window.slicestack.camera().eye")
    b.call("POST", "/refresh")
    page.wait("return Boolean(window.slicestack)", "the page opens again")
    page.rest()
    check(page.bytes() == made and b.run("return window.slicestack.camera().eye") == camera, "a reload keeps what was made")
    check("reload" in page.message(), f"and says so: {page.message()}")
    b.press("Control+z")
    page.rest()
    check(page.bytes() == opened and not b.run(CAN_UNDO), "and undo shows the scene as it was opened")


def ended(page, command, process, downloads, own):
    """A view that has ended says so to a page at rest, which still saves its scene."""
    b = page.browser
    b.press("ArrowRight")
    page.rest()
    still, (width, height) = page.bytes(), b.run("return window.slicestack.size()")
    for path in downloads.iterdir():
        path.unlink()
    process.terminate()
    process.wait(10)
    page.wait("return document.getElementById('ended').checkVisibility()", "the end of the view is told", 30)
    check("has ended" in b.run("return document.getElementById('ended-words').innerText"), "a page at rest says that the view has ended")
    b.run("document.getElementById('ended-save').click()")
    for _ in range(200):
        if saved := list(downloads.glob("*.json")):
            break
        time.sleep(0.05)
    check(bool(saved), f"the scene is saved without the view; the page says: {page.message()}")
    if not saved:
        return
    scene = own / "kept.json"
    scene.write_text(json.dumps(json.loads(saved[0].read_text())))
    out = downloads / "kept.png"
    done = subprocess.run([command, "render", scene, "--size", f"{width}x{height}", "--no-metadata", "-o", out], capture_output=True, text=True)
    check(done.returncode == 0 and out.read_bytes() == still, f"and the command makes the same bytes of it {done.stderr.strip() if done.returncode else ''}")
    # The browser notes each request that finds nobody.
    log = [line for line in b.log() if "ERR_CONNECTION" not in line and "Failed to fetch" not in line]
    check(not log, f"nothing else is wrong on the console: {log[:3]}")
