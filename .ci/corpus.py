#!/usr/bin/env python3
"""Makes the seeds of the fuzz targets, fuzz/corpus/TARGET/*: small files of every format, written by the command itself or by hand, and bytes that random
scenes are drawn from. Inputs that once failed stay beside them, under names of their own.

usage: corpus.py SLICESTACK
"""
import gzip
import hashlib
import io
import pathlib
import struct
import subprocess
import sys
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
CORPUS = ROOT / "fuzz" / "corpus"
# As in fuzz/src/readers.rs.
NAMES = ["nrrd", "nhdr", "nii", "nii.gz", "hdr", "img", "mha", "mhd", "vtk", "vti", "vtr", "mrc", "npy", "npz", "dcm", "tif", "ome.tif", "png", "jpg", "bmp", "zip", "tar", "dat", "zarr.zip"]
# As in transfer_io/mod.rs.
KINDS = ["vp", "xml", "json", "csv"]


def put(target, name, data):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data)


def volumes(command, folder):
    """Bytes by file name."""
    voxels = bytes(range(60)) * 2
    all = {"a.nrrd": b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 6\nspace: left-posterior-superior\nspace directions: (1,0,0) (0,1,0) (0,0,2)\nencoding: raw\n\n" + voxels}
    source = folder / "a.nrrd"
    source.write_bytes(all["a.nrrd"])
    for name in ("b.nii", "b.nii.gz", "b.mha", "b.npy", "c.nrrd"):
        extra = ["--compress"] if name == "c.nrrd" else []
        subprocess.run([command, "convert", source, folder / name, "--force", *extra], check=True, capture_output=True)
        all[name] = (folder / name).read_bytes()
    text = " ".join(map(str, voxels[:24])).encode()
    all["a.nrrd-ascii.nrrd"] = b"NRRD0005\ntype: short\ndimension: 3\nsizes: 2 3 4\nencoding: ascii\nkinds: space space space\n\n" + text
    all["a.nrrd-list.nrrd"] = b"NRRD0004\ntype: ushort\ndimension: 4\nsizes: 2 2 2 3\nendian: big\nkinds: space space space list\nencoding: raw\n\n" + voxels[:48]
    all["a.vtk"] = b"# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 3 4\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 24\nSCALARS s short 1\nLOOKUP_TABLE default\n" + text + b"\n"
    all["a.vti"] = b'<?xml version="1.0"?>\n<VTKFile type="ImageData" version="0.1" byte_order="LittleEndian"><ImageData WholeExtent="0 1 0 2 0 3" Origin="0 0 0" Spacing="1 1 1"><Piece Extent="0 1 0 2 0 3"><PointData Scalars="s"><DataArray type="Int16" Name="s" format="ascii">' + text + b"</DataArray></PointData></Piece></ImageData></VTKFile>"
    head = bytearray(1024)
    struct.pack_into("<10i", head, 0, 4, 5, 6, 0, 0, 0, 0, 4, 5, 6)
    struct.pack_into("<3f", head, 40, 4, 5, 6)
    struct.pack_into("<3i", head, 64, 1, 2, 3)
    head[208:212], head[212:216] = b"MAP ", b"DD\0\0"
    all["a.mrc"] = bytes(head) + voxels
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as z:
        z.writestr(zipfile.ZipInfo("a.npy"), all["b.npy"])
    all["a.npz"] = packed.getvalue()
    element = lambda tag, kind, value: struct.pack("<HH", *tag) + kind + struct.pack("<H", len(value)) + value
    us = lambda tag, n: element(tag, b"US", struct.pack("<H", n))
    image = b"".join([element((8, 0x60), b"CS", b"CT"), element((0x18, 0x50), b"DS", b"1 "), element((0x20, 0x32), b"DS", b"0\\\\0\\\\0 "), element((0x20, 0x37), b"DS", b"1\\\\0\\\\0\\\\0\\\\1\\\\0 "), us((0x28, 2), 1), element((0x28, 4), b"CS", b"MONOCHROME2 "), us((0x28, 0x10), 5), us((0x28, 0x11), 4), element((0x28, 0x30), b"DS", b"1\\\\1 "), us((0x28, 0x100), 8), us((0x28, 0x101), 8), us((0x28, 0x102), 7), us((0x28, 0x103), 0), struct.pack("<HH2sHI", 0x7FE0, 0x10, b"OB", 0, 20) + voxels[:20]])
    meta = element((2, 0x10), b"UI", b"1.2.840.10008.1.2.1\0")
    all["a.dcm"] = bytes(128) + b"DICM" + element((2, 0), b"UL", struct.pack("<I", len(meta))) + meta + image
    for name in ("a.png", "a.tif", "a.jpg", "a.exr", "a.webp", "p.npy"):
        more = ["--background", "black"] if name == "a.jpg" else []
        subprocess.run([command, "render", "--volume.phantom", "cloud", "--volume.size", "8", "--size", "8x8", "--count", "8", "--no-metadata", "-o", folder / name, *more], check=True, capture_output=True)
        all[name] = (folder / name).read_bytes()
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as z:
        z.writestr(zipfile.ZipInfo(".zarray"), '{"zarr_format":2,"shape":[4,3,2],"chunks":[2,3,2],"dtype":"|u1","compressor":null,"fill_value":0,"order":"C","filters":null}')
        z.writestr(zipfile.ZipInfo("0.0.0"), voxels[:12])
        z.writestr(zipfile.ZipInfo("1.0.0"), voxels[12:24])
    all["a.zarr.zip"] = packed.getvalue()
    all["a.dat"] = struct.pack("<3H", 4, 5, 6) + b"".join(struct.pack("<H", v) for v in voxels)
    all["gz.nrrd"] = b"NRRD0004\ntype: uchar\ndimension: 3\nsizes: 4 5 6\nencoding: gzip\n\n" + gzip.compress(voxels, mtime=0)
    return all


def main():
    command = pathlib.Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        made = volumes(command, pathlib.Path(folder))
        for name, data in made.items():
            ending = next((e for e in sorted(NAMES, key=len, reverse=True) if name.endswith("." + e)), None)
            if ending:
                put("readers", f"{name}", bytes([NAMES.index(ending)]) + data)
            if name.endswith((".png", ".tif", ".jpg", ".exr", ".webp")) or name == "p.npy":
                put("pictures", name, data)
        for kind, ending in enumerate(KINDS):
            out = pathlib.Path(folder) / f"t.{ending}"
            subprocess.run([command, "tf", "ct-bone", "-o", out], check=True, capture_output=True)
            put("transfer_files", out.name, bytes([kind]) + out.read_bytes())
        for scene in sorted([*(ROOT / "examples" / "scenes" / "notes").glob("*.toml"), *(ROOT / ".ci" / "scenes").glob("*.toml")]):
            if scene.stat().st_size < 4096:
                put("scene_files", scene.name, scene.read_bytes())
        saved = pathlib.Path(folder) / "s.json"
        subprocess.run([command, "render", "--volume.phantom", "cloud", "--volume.size", "8", "--size", "8x8", "-o", pathlib.Path(folder) / "s.png", "--save-scene", saved], check=True, capture_output=True)
        put("scene_files", "saved.json", saved.read_bytes())
    # Bytes that look random, the same every time.
    for target, count, length in (("geometry", 12, 90), ("blending", 16, 160), ("levels", 16, 160), ("tolerance", 8, 120)):
        for n in range(count):
            data = b"".join(hashlib.sha256(f"{target} {n} {i}".encode()).digest() for i in range(8))[:length]
            put(target, f"{n:02}", data)
    for target in sorted(CORPUS.iterdir()):
        files = list(target.iterdir())
        print(f"{target.name}: {len(files)} inputs, {sum(f.stat().st_size for f in files)} bytes")


if __name__ == "__main__":
    main()
