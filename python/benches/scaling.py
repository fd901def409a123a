"""How rendering in parts scales: measured with 1, 2, 4 and 8 workers on this machine, modelled for more.

python3 python/benches/scaling.py FOLDER [--side 384]     writes scaling.json, scaling.md and scaling.svg into FOLDER

Strong: one array, more workers. Weak: as many voxels a worker. Each worker is a process of one thread. The constants of the model are measured
one by one: fragments a second, combining a pixel, a task's way through the scheduler, a byte's way between two workers.
"""

import json
import math
import os
import pathlib
import sys
import time

import dask
import dask.array as da
import numpy as np
from distributed import Client, LocalCluster, wait

import slicestack.dask as sdask
from slicestack import _slicestack

WORKERS = [1, 2, 4, 8]
MODELLED = [16, 32, 64, 128, 256, 512, 1024]
SIZE = 384
TRANSFER = {"color": [[20000, 1, 0.6, 0.2], [60000, 0.3, 0.5, 1]], "opacity": [[15000, 0], [60000, 0.02]], "opacity_unit": 1.0}


def chunk(block_info=None):
    """A chunk of waves, made where it is needed."""
    (z0, z1), (y0, y1), (x0, x1) = block_info[None]["array-location"]
    z, y, x = np.ogrid[z0:z1, y0:y1, x0:x1]
    wave = np.sin(0.05 * x) * np.cos(0.04 * y) + np.sin(0.03 * z)
    return ((wave + 2) * 16000).astype(np.uint16)


def waves(shape, chunks):
    return da.map_blocks(chunk, chunks=da.core.normalize_chunks(chunks, shape), dtype=np.uint16)


def timed(work):
    begun = time.perf_counter()
    found = work()
    return time.perf_counter() - begun, found


def worked(work):
    """Seconds of the processor: what others do meanwhile does not count."""
    begun = time.process_time()
    found = work()
    return time.process_time() - begun, found


def cluster(n):
    return LocalCluster(n_workers=n, threads_per_worker=1, dashboard_address=":0", memory_limit=0)


def picture(client, shape, side, slices):
    """Seconds to look at an array that lies in the workers' memory, and to render it; its parts."""
    array = waves(shape, (side,) * 3).persist()
    wait(array)
    looked, parts = timed(lambda: sdask.Parts(array))
    scene = parts.scene(transfer=TRANSFER, size=SIZE, count=slices, azimuth=30, elevation=20)
    rendered = min(timed(lambda: parts.render(scene))[0] for _ in range(2))
    return looked, rendered, int(np.prod(array.numblocks))


def constants(side):
    """What one of everything costs here, in seconds."""
    shape, slices = (side,) * 3, 2 * side
    array = waves(shape, (side // 2,) * 3).compute(scheduler="synchronous")
    parts = sdask.Parts(da.from_array(array, chunks=shape))

    def cost(count):
        scene = parts.scene(transfer=TRANSFER, size=SIZE, count=count, azimuth=30, elevation=20)
        return worked(lambda: dask.compute(*parts.partials([scene]), scheduler="synchronous")[0])

    # What a part's voxels cost before the first fragment: bricks, packing.
    once, _ = cost(1)
    seconds, partial = cost(slices)
    width, height, fragments = _slicestack.partial_size(partial)
    combine = worked(lambda: [_slicestack.combine([partial, partial]) for _ in range(10)])[0] / 10
    with cluster(2) as c, Client(c) as client:
        noop = lambda n: n  # noqa: E731
        client.gather(client.map(noop, range(50), pure=False))
        task = min(timed(lambda: client.gather(client.map(noop, range(500), pure=False)))[0] for _ in range(3)) / 500
        one, two = list(client.scheduler_info()["workers"])
        lump = client.submit(lambda: np.ones(32 << 20, np.uint8), workers=[one], pure=False)
        wait(lump)
        byte = timed(lambda: client.submit(len, lump, workers=[two], pure=False).result())[0] / (32 << 20)
    return {
        "voxel": once / side**3,
        "fragment": (seconds - once) / fragments,
        # Of the pixels in the picture's rectangle times slices, those that are fragments.
        "covered": fragments / (width * height * slices),
        "combined_pixel": combine / (width * height),
        "task": task,
        "byte": byte,
    }


def model(c, workers, side, pixels, slices):
    """Seconds for `side`^3 voxels in so many pixels and slices, in 64 parts, or one a worker where there are more workers."""
    parts = max(64, workers)
    part_side = side / parts ** (1 / 3)
    compute = (c["voxel"] * side**3 + c["fragment"] * c["covered"] * pixels * slices) / workers
    # Two layers of u16 voxels on each of six faces, about half of them from other workers.
    halo = 0.5 * parts / workers * 6 * 2 * part_side**2 * 2 * c["byte"]
    # A part covers about parts^(-2/3) of the picture; four become one, level by level, each of them fetched and combined. Late levels run on few workers.
    compositing, covered, left = 0.0, pixels * parts ** (-2 / 3), parts
    while left > 1:
        compositing += max(1.0, left / 4 / workers) * 4 * covered * (16 * c["byte"] + c["combined_pixel"])
        left, covered = math.ceil(left / 4), min(pixels, covered * 4 ** (2 / 3))
    # Slices with their halo (about 27 a part), the part itself, a pick, the tree: all through one scheduler, which works beside the workers.
    scheduling = c["task"] * parts * (27 + 3 + 1 / 3)
    return {"compute": compute, "halo": halo, "compositing": compositing, "scheduling": scheduling}


def svg(rows, path):
    """Seconds against workers, both axes logarithmic: strong scaling, measured and modelled, and modelled of the large volume."""
    width, height, left, bottom = 640, 400, 60, 40
    points = [(w, t) for kind in rows for w, t in rows[kind]]
    low, high = min(t for _, t in points) / 1.5, max(t for _, t in points) * 1.5
    x = lambda w: left + (width - left - 20) * math.log2(w) / 10  # noqa: E731
    y = lambda t: 10 + (height - bottom - 10) * math.log(high / t) / math.log(high / low)  # noqa: E731
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">']
    parts.append(f'<rect width="{width}" height="{height}" fill="white"/>')
    for n in range(11):
        parts.append(f'<line x1="{x(2**n):.1f}" y1="10" x2="{x(2**n):.1f}" y2="{height - bottom}" stroke="#ddd"/>')
        parts.append(f'<text x="{x(2**n):.1f}" y="{height - bottom + 16}" text-anchor="middle">{2**n}</text>')
    for power in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1):
        for t in (10.0**power, 3 * 10.0**power):
            if low < t < high:
                parts.append(f'<line x1="{left}" y1="{y(t):.1f}" x2="{width - 20}" y2="{y(t):.1f}" stroke="#ddd"/>')
                parts.append(f'<text x="{left - 6}" y="{y(t) + 4:.1f}" text-anchor="end">{t:g}</text>')
    for kind, color in (("large", "#383"), ("modelled", "#c60"), ("measured", "#06c")):
        line = " ".join(f"{x(w):.1f},{y(t):.1f}" for w, t in rows[kind])
        parts.append(f'<polyline points="{line}" fill="none" stroke="{color}" stroke-width="2"/>')
        parts += [f'<circle cx="{x(w):.1f}" cy="{y(t):.1f}" r="4" fill="{color}"/>' for w, t in rows[kind]]
    told = [("#06c", "small volume, measured on 2 busy cores"), ("#c60", "small volume, model, a core a worker"), ("#383", "2048 voxels a side, model")]
    parts += [f'<text x="{left + 150}" y="{28 + 18 * n}" fill="{color}">{text}</text>' for n, (color, text) in enumerate(told)]
    parts.append(f'<text x="{width / 2}" y="{height - 6}" text-anchor="middle">workers</text><text x="14" y="{height / 2}" transform="rotate(-90 14 {height / 2})" text-anchor="middle">seconds a picture</text></svg>')
    path.write_text("\n".join(parts) + "\n")


def main():
    folder = pathlib.Path(sys.argv[1])
    side = int(sys.argv[sys.argv.index("--side") + 1]) if "--side" in sys.argv else 384
    found = {"cores": os.cpu_count(), "side": side, "load": [os.getloadavg()[0]], "strong": [], "weak": []}
    for n in WORKERS:
        with cluster(n) as c, Client(c) as client:
            looked, rendered, parts = picture(client, (side,) * 3, side // 4, 2 * side)
            found["strong"].append({"workers": n, "parts": parts, "look": looked, "render": rendered})
            half = side // 2
            looked, rendered, parts = picture(client, (half * n, half, half), half // 2, 2 * half)
            found["weak"].append({"workers": n, "parts": parts, "voxels": n * half**3, "look": looked, "render": rendered})
        print(found["strong"][-1], found["weak"][-1], flush=True)
    found["load"].append(os.getloadavg()[0])
    write(found, constants(side // 2), folder)


def write(found, c, folder):
    """The measurements, the model and its plot, into `folder`."""
    found["constants"] = c
    workers = [1, 2, 4, 8, *MODELLED]
    found["model"] = [{"workers": n, **model(c, n, 2048, 1024**2, 4096)} for n in workers]
    (folder / "scaling.json").write_text(json.dumps(found, indent=1) + "\n")
    side = found["side"]
    small = [(n, sum(model(c, n, side, SIZE**2, 2 * side).values())) for n in workers]
    large = [(row["workers"], sum(row[k] for k in ("compute", "halo", "compositing", "scheduling"))) for row in found["model"]]
    svg({"measured": [(r["workers"], r["render"]) for r in found["strong"]], "modelled": small, "large": large}, folder / "scaling.svg")
    rows = ["| workers | strong: s | weak: voxels | weak: s |", "|---|---|---|---|"]
    rows += [f"| {s['workers']} | {s['render']:.2f} | {w['voxels']:,} | {w['render']:.2f} |".replace(",", " ") for s, w in zip(found["strong"], found["weak"])]
    rows += ["", "| workers | compute s | halo s | compositing s | scheduling s | all s |", "|---|---|---|---|---|---|"]
    for row in found["model"]:
        parts = [row[k] for k in ("compute", "halo", "compositing", "scheduling")]
        rows.append(f"| {row['workers']} | " + " | ".join(f"{p:.3g}" for p in [*parts, sum(parts)]) + " |")
    (folder / "scaling.md").write_text("\n".join(rows) + "\n")
    print("\n".join(rows))
    print("load of the machine before and after:", found["load"])


if __name__ == "__main__":
    main()
