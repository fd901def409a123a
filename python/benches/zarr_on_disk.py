"""A Zarr of 8 GiB on disk, rendered by two workers of 2 GiB each.

python3 python/benches/zarr_on_disk.py FOLDER [--size 2048,2048,1024]      makes FOLDER/waves.zarr unless it is there; tells times and memory
"""

import pathlib
import resource
import sys
import threading
import time

import dask.array as da
import numpy as np
import zarr
from distributed import Client, LocalCluster

import slicestack.dask as sdask

CHUNK = 256
LIMIT = 2 << 30


def make(path, shape):
    """A shell of waves, chunk by chunk."""
    store = zarr.create_array(str(path), shape=shape, chunks=(CHUNK,) * 3, dtype="u2")
    axes = [np.linspace(-1, 1, n, dtype=np.float32) for n in shape]
    for z in range(0, shape[0], CHUNK):
        for y in range(0, shape[1], CHUNK):
            for x in range(0, shape[2], CHUNK):
                part = np.ix_(*(axis[at : at + CHUNK] for axis, at in zip(axes, (z, y, x))))
                radius = np.sqrt(part[0] ** 2 + part[1] ** 2 + part[2] ** 2)
                values = 30000 * np.exp(-40 * (radius - 0.7) ** 2) * (1 + 0.5 * np.sin(25 * part[2]) * np.cos(20 * part[1]))
                store[z : z + CHUNK, y : y + CHUNK, x : x + CHUNK] = values.astype(np.uint16)


def main():
    folder = pathlib.Path(sys.argv[1])
    shape = tuple(int(n) for n in sys.argv[sys.argv.index("--size") + 1].split(",")) if "--size" in sys.argv else (1024, 2048, 2048)
    path = folder / "waves.zarr"
    begun = time.perf_counter()
    if not path.exists():
        make(path, shape)
        print(f"made in {time.perf_counter() - begun:.0f} s", flush=True)
    peak = {}

    with LocalCluster(n_workers=2, threads_per_worker=1, memory_limit=LIMIT, dashboard_address=":0") as cluster, Client(cluster) as client:

        def watch():
            while not done.wait(0.5):
                for name, worker in client.scheduler_info()["workers"].items():
                    peak[name] = max(peak.get(name, 0), worker["metrics"]["memory"])

        done = threading.Event()
        thread = threading.Thread(target=watch, daemon=True)
        thread.start()
        array = da.from_zarr(str(path))
        begun = time.perf_counter()
        parts = sdask.Parts(array)
        looked = time.perf_counter() - begun
        print(f"{array.nbytes / 2**30:.2f} GiB in {array.npartitions} chunks of {array.chunksize}: looked at in {looked:.1f} s", flush=True)
        begun = time.perf_counter()
        transfer = {"color": [[0, 0.2, 0.3, 0.9], [30000, 1, 0.7, 0.3], [45000, 1, 1, 1]], "opacity": [[15000, 0], [45000, 0.05]]}
        image = parts.render(transfer=transfer, size=1024, azimuth=35, elevation=25, background="black", light={"ambient": 0.3})
        print(f"rendered in {time.perf_counter() - begun:.1f} s, {image.width} x {image.height} pixels", flush=True)
        done.set()
        thread.join()
    image.save(folder / "waves.png")
    told = ", ".join(f"{bytes / 2**30:.2f}" for bytes in peak.values())
    print(f"memory of the workers at the most: {told} GiB; of this process: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.2f} GiB")


if __name__ == "__main__":
    main()
