#!/usr/bin/env python3
"""Drives the page of `slicestack view` in a headless Chromium, as a hand at the mouse and the keyboard would, and checks what comes of it.
One line for each failure, exit status 1 when there is one.

usage: view.py [--command SLICESTACK] [--address URL] [--measure] [--soak FRAMES] [--screens DIR]

  --command   the command (default: target/release/slicestack beside this folder)
  --address   a view that runs already, in the place of one that is started here; the scene that it saves is then rendered by --command
  --measure   count frames a second, the time from input to picture, and the time to the still picture; print them as a table
  --soak      turn the volume for so many frames, and hold the memory of server and page after them against that before
  --screens   write screenshots of the page into DIR: 400 and 1280 pixels wide, light and dark
"""
import argparse
import os
import pathlib
import subprocess
import sys
import tempfile
import time

sys.dont_write_bytecode = True
sys.path.insert(0, str(pathlib.Path(__file__).parent))
import viewhand
from viewmeasure import measure, screens, soak
from viewpage import ROOT, Page, check, failures, scene_in, serve
from webdriver import Browser

# Degrees of a drag across the shorter side of the picture: TURN in pointer.js.
TURN = 200
INTERACTIVE = "a[href], button, input, select, textarea, summary, [tabindex='0']"


def turning(page):
    b = page.browser
    before, azimuth, elevation = page.bytes(), page.angle("Azimuth"), page.angle("Elevation")
    wide, tall = b.run("const f = document.getElementById('frame'); return [f.clientWidth, f.clientHeight]")
    b.drag(b.center("#frame"), (120, -40))
    page.rest()
    per = TURN / min(wide, tall)
    turned = (page.angle("Azimuth") - azimuth + 180) % 360 - 180
    check(abs(turned + 120 * per) < 0.1, f"a drag of 120 pixels to the right turns the eye {120 * per:.2f} degrees to the left: {turned:.2f}")
    check(abs(page.angle("Elevation") - elevation + 40 * per) < 0.1, "a drag upwards lowers the eye by as much")
    check(page.bytes() != before, "a drag changes the picture")
    b.press("Control+z")
    page.rest()
    check(page.bytes() == before, "undo brings the same bytes back")
    b.press("Control+Shift+z")
    page.rest()
    check(page.bytes() != before, "redo turns again")
    b.press("Control+z", "ArrowRight")
    page.rest()
    check(abs(page.angle("Azimuth") - azimuth - 4) < 0.01, "the right arrow key turns by 4 degrees")
    height = "return window.slicestack.camera().height"
    was = b.run(height)
    b.press("+")
    page.rest()
    check(b.run(height) < was, "plus zooms in")
    b.press("Home")
    page.rest()
    check(page.bytes() == before, "Home shows the first view again, to the bit")


def transfer(page):
    b = page.browser
    before, points = page.bytes(), page.opacity()
    middle = len(points) // 2
    spot = b.center(f"[data-point='opacity-{middle}']")
    b.drag(spot, (0, -45))
    page.rest()
    raised = page.opacity()
    check(raised[middle][1] > points[middle][1], "a control point that is dragged upwards has more opacity")
    check(page.bytes() != before, "a dragged control point changes the picture")
    b.press("Control+z")
    page.rest()
    check(page.bytes() == before and page.opacity() == points, "undo puts the control point back, to the bit")
    b.run("document.querySelector(arguments[0]).focus()", f"[data-point='opacity-{middle}']")
    b.press("ArrowRight", "ArrowUp")
    page.rest()
    moved = page.opacity()[middle]
    check(moved[0] > points[middle][0] and moved[1] > points[middle][1], "arrow keys move a control point")
    b.press("Enter")
    check(len(page.opacity()) == len(points) + 1, "Enter adds a control point")
    b.press("Delete")
    page.rest()
    check(len(page.opacity()) == len(points), "Delete takes it away")
    area = b.run("const f = document.querySelector('.transfer rect.field').getBoundingClientRect(); return [f.x + 0.62 * f.width, f.y + 0.3 * f.height]")
    for count in (1, 2):
        b.mouse("mousePressed", *area, clickCount=count)
        b.mouse("mouseReleased", *area, clickCount=count)
    page.rest()
    check(len(page.opacity()) == len(points) + 1, "a double click adds a control point")
    for _ in range(8):
        if page.opacity() != points:
            b.press("Control+z")
    page.rest()
    check(page.bytes() == before, "undo, step by step, brings the first bytes back")


def crop_and_probe(page):
    b = page.browser
    before = page.bytes()
    page.unfold()
    b.run("const h = document.getElementById('show-handles'); if (!h.checked) h.click()")
    b.run("document.querySelector(\"[aria-label='Crop, high x']\").focus()")
    b.press(*["PageDown"] * 6)
    page.rest()
    clips = b.run("return window.slicestack.document().clip")
    check(bool(clips) and len(clips) == 1, f"keys on a handle crop the box: {clips}")
    check(page.bytes() != before, "the crop changes the picture")
    b.drag(b.center("[aria-label='Crop, high z']"), (0, 60))
    page.rest()
    check(len(b.run("return window.slicestack.document().clip")) == 2, "a dragged handle crops too")
    while b.run("return Boolean(window.slicestack.document().clip)"):
        b.press("Control+z")
    page.rest()
    b.run("document.getElementById('show-handles').click()")
    b.run("document.getElementById('frame').focus()")
    b.press("p")
    page.wait("return document.querySelector('#probe-plot svg')", "the probe's plot")
    place = b.run("return document.querySelector('#probe-facts dd').textContent")
    b.press("Shift+ArrowLeft")
    page.wait(f"return document.querySelector('#probe-facts dd').textContent !== '{place}'", "the probe follows the arrow keys")
    check(True, "the probe follows the arrow keys and shows its plot")
    b.press("Escape")
    page.rest()


def saving(page, command, downloads, own):
    b = page.browser
    still = page.bytes()
    width, height = b.run("return window.slicestack.size()")
    for path in downloads.iterdir():
        path.unlink()
    b.run("document.getElementById('save-json').click()")
    for _ in range(200):
        saved = [p for p in downloads.iterdir() if p.suffix == ".json"]
        if saved:
            break
        time.sleep(0.05)
    check(bool(saved), f"a scene is saved; the page says: {page.message()}")
    if not saved:
        return
    scene = own / saved[0].name
    scene.write_bytes(saved[0].read_bytes())
    out = downloads / "again.png"
    done = subprocess.run([command, "render", scene, "--size", f"{width}x{height}", "--no-metadata", "-o", out], capture_output=True, text=True)
    check(done.returncode == 0, f"the saved scene is rendered by the command {done.stderr.strip() if done.returncode else ''}")
    check(done.returncode == 0 and out.read_bytes() == still, "the saved scene rendered by the command gives the bytes of the still frame")


def keyboard(page):
    """Tab goes to every control, and each has a name."""
    b = page.browser
    page.unfold()
    b.run("const h = document.getElementById('show-handles'); if (!h.checked) h.click()")
    wanted = b.run(
        f"""const all = [...document.querySelectorAll("{INTERACTIVE}")].filter((e) => !e.disabled && e.checkVisibility({{visibilityProperty: true}}) && !e.closest("dialog:not([open])"));
        all.forEach((e, n) => (e.dataset.walk = n)); document.activeElement.blur(); window.scrollTo(0, 0); return all.length"""
    )
    seen, nameless = set(), []
    for _ in range(wanted + 8):
        b.press("Tab")
        at = b.run("return document.activeElement.dataset.walk ?? null")
        if at is not None and at not in seen:
            seen.add(at)
            if not b.label(f"[data-walk='{at}']").strip():
                nameless.append(b.run("return document.activeElement.outerHTML.slice(0, 120)"))
    missed = b.run("return [...document.querySelectorAll('[data-walk]')].filter((e) => !arguments[0].includes(e.dataset.walk)).map((e) => e.outerHTML.slice(0, 100))", sorted(seen))
    # What a focused point of colour hides, numbers of opacity, is reached from a point of opacity.
    b.run("document.querySelector('[data-point=opacity-0]').focus()")
    b.press(" ", "Tab")
    at = b.run("return document.activeElement.closest('label')?.innerText.trim()")
    check(at == "Opacity", f"space leads from a point to its numbers: {at}")
    missed = [e for e in missed if f'data-walk="{b.run("return document.activeElement.dataset.walk")}"' not in e]
    check(wanted > 40 and not missed, f"Tab reaches all {wanted} controls; missed: {missed[:3]}")
    check(not nameless, f"each control has a name for screen readers; without: {nameless[:3]}")
    b.run("document.getElementById('show-handles').click(); document.getElementById('frame').focus()")
    b.press("?")
    check(b.run("return document.getElementById('help').open"), "? shows the keys")
    b.press("Escape")
    page.rest()


def refusals(page):
    """What the server refuses is told, and the picture stays."""
    b = page.browser
    before, was = page.bytes(), b.run("return JSON.stringify(window.slicestack.document())")
    b.run("const d = window.slicestack.document(); window.slicestack.show({ ...d, render: { ...d.render, filter: 'cubic', profile: 'opengl' } })")
    page.wait("return document.getElementById('message').textContent.length > 0", "the page tells what is refused")
    page.rest()
    check(page.bytes() == before and b.run("return JSON.stringify(window.slicestack.document())") == was, f"a refused scene leaves the picture as it was: {page.message()}")
    # The browser itself notes the refusal on its console.
    refused = [line for line in b.log() if "400" not in line]
    check(not refused, f"a refusal is all that the console tells: {refused[:3]}")


def export(browser, command, own):
    """A page of pictures made beforehand turns from a file, without a server."""
    folder = own / "turns"
    making = [command, "view", "--export", folder, "--views", "8x3", "--size", "96x96", *scene_in(own)]
    done = subprocess.run(making, capture_output=True, text=True)
    check(done.returncode == 0 and len(list(folder.iterdir())) == 25, f"an export writes 24 pictures and a page: {done.stderr.strip()}")
    again = subprocess.run(making, capture_output=True, text=True)
    check(again.returncode == 0, "an export replaces its own")
    (folder / "view-99-999.webp").write_text("mine")
    fewer = subprocess.run([*making[:5], "4x1", *making[6:]], capture_output=True, text=True)
    check(fewer.returncode == 0 and len(list(folder.iterdir())) == 6, f"one of fewer pictures leaves none of those before it, and all others: {len(list(folder.iterdir()))} files")
    subprocess.run(making, capture_output=True)
    alone = subprocess.run([command, "view", "--views", "8x3", "--no-browser"], capture_output=True, text=True, timeout=60)
    check(alone.returncode == 2 and "--views" in alone.stderr, f"--views without --export is refused: {alone.stderr.strip()}")
    other = own / "other"
    other.mkdir()
    (other / "letter.txt").write_text("mine")
    refused = subprocess.run([*making[:3], other, *making[4:]], capture_output=True, text=True)
    check(refused.returncode == 2 and [p.name for p in other.iterdir()] == ["letter.txt"], f"an export spares a folder of others: {refused.stderr.strip()}")
    browser.log()
    browser.open((folder / "index.html").as_uri())
    shown = "const i = document.getElementById('picture'); return i.complete && i.naturalWidth === 96 ? [i.src, i.alt] : null"
    seen = [browser.run(shown)]
    for act in (lambda: browser.press("Tab", "ArrowRight"), lambda: browser.press("ArrowUp"), lambda: browser.drag(browser.center("#view"), (120, 0)), lambda: browser.press("Home")):
        act()
        time.sleep(0.3)
        seen.append(browser.run(shown))
    check(all(seen) and len({tuple(s) for s in seen[:4]}) == 4 and seen[4] == seen[0], f"keys and a drag turn it, Home brings the first view back: {[s and s[1] for s in seen]}")
    log = browser.log()
    check(not log, f"nothing is wrong on its console: {log[:3]}")


def two_pages(page, address):
    b = page.browser
    first, before = b.call("GET", "/window"), page.bytes()
    second = b.call("POST", "/window/new", {"type": "window"})["handle"]
    b.call("POST", "/window", {"handle": second})
    b.size(1280, 800)
    other = Page(b, address)
    b.drag(b.center("#frame"), (80, 30))
    other.rest()
    check(other.bytes() != before, "a second page turns its own view")
    b.call("DELETE", "/window")
    b.call("POST", "/window", {"handle": first})
    check(page.bytes() == before, "the first page keeps its own")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--command", default=os.fspath(ROOT / "target/release/slicestack"))
    parser.add_argument("--address")
    parser.add_argument("--measure", action="store_true")
    parser.add_argument("--soak", type=int)
    parser.add_argument("--screens", type=pathlib.Path)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        own, downloads = pathlib.Path(temporary), pathlib.Path(temporary) / "downloads"
        downloads.mkdir()
        process, address = (None, args.address) if args.address else serve(args.command, own)
        try:
            with Browser(downloads=downloads) as b:
                b.size(1280, 800)
                page = Page(b, address)
                parts = (turning, viewhand.steps, viewhand.gestures, transfer, viewhand.numbers, crop_and_probe, viewhand.planes, viewhand.probing, viewhand.methods, keyboard, viewhand.reloading)
                for part in parts:
                    part(page)
                saving(page, args.command, downloads, own)
                refusals(page)
                two_pages(page, address)
                if args.screens:
                    screens(page, args.screens)
                    b.size(1280, 800)
                    page.rest()
                if args.measure:
                    measure(page)
                if args.soak:
                    soak(page, args.soak, process)
                log = b.log()
                check(not log, f"nothing is wrong on the console: {log[:3]}")
                if process:
                    viewhand.ended(page, args.command, process, downloads, own)
                export(b, args.command, own)
        finally:
            if process:
                process.terminate()
                process.wait(10)
    for line in failures:
        print(f"view.py: {line}")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
