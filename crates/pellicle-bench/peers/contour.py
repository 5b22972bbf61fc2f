#!/usr/bin/env python3
"""Volumes to surfaces: pellicle beside vtkFlyingEdges3D, scikit-image, PyMCubes and the crate fast-surface-nets, in turn.

    contour.py [--volume NAME …] [--tool NAME …] [--threads 1 2] [--repeats 5] [--json] [--record FOLDER] [--bin PELLICLE-BENCH]

The same samples in memory for everybody; only the extraction is timed, from samples to a new indexed mesh, without normals.
Reading files, converting types that a tool does not take, and giving memory back are not timed. Every measurement is a
process of its own; it repeats until `--repeats` runs or 12 seconds are over, and the row holds the median. VTK runs with the
SMP backend that is fastest here, which is named in its version. `read once` sums the bytes of the array with the same
threads, the floor for anything that looks at all samples. What is compared: pellicle and the marching cubes make about the
same triangles; surface nets make one vertex a cell, and close nothing at the border. Tools that know one thread have rows
for one thread only.

Build first: cargo build --release -p pellicle-bench. Packages: numpy vtk scikit-image PyMCubes.
"""

import argparse
import gzip
import importlib.metadata
import json
import os
import platform
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[3]
DATA = Path(os.environ.get("PELLICLE_DATA", ROOT.parent / "shared" / "data")) / "volumes"
ENOUGH = 12.0


def gyroid(n):
    # One period is 32 samples: a dense surface, whatever the size.
    t = np.linspace(0, 2 * np.pi * n / 32, n, dtype=np.float32)
    s, c = np.sin(t), np.cos(t)
    a = s[None, None, :] * c[None, :, None]
    a = a + s[None, :, None] * c[:, None, None]
    return a + s[:, None, None] * c[None, None, :]


def sphere(n):
    x = np.linspace(-1, 1, n, dtype=np.float32) ** 2
    return 0.7 - np.sqrt(x[None, None, :] + x[None, :, None] + x[:, None, None])


def nifti(path):
    raw = gzip.open(path).read() if path.suffix == ".gz" else path.read_bytes()
    order = "<" if struct.unpack("<i", raw[:4])[0] == 348 else ">"
    dims = struct.unpack(order + "8h", raw[40:56])[1:4]
    kind = {2: "u1", 4: "i2"}[struct.unpack(order + "h", raw[70:72])[0]]
    start = int(struct.unpack(order + "f", raw[108:112])[0])
    samples = np.frombuffer(raw, order + kind, int(np.prod(dims)), start).astype(kind)
    return samples.reshape(dims[::-1])


def channels(path):
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    reader = vtk.vtkXMLImageDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    dims = [n - 1 for n in image.GetDimensions()]
    return vtk_to_numpy(image.GetCellData().GetArray(0)).astype(np.int64).reshape(dims[::-1])


VOLUMES = {
    "gyroid256": (lambda: gyroid(256), 0.0),
    "gyroid512": (lambda: gyroid(512), 0.0),
    "sphere512": (lambda: sphere(512), 0.0),
    "mni152": (lambda: nifti(DATA / "mni152_t1_1mm.nii.gz"), 100.5),
    "anatomical": (lambda: nifti(DATA / "nibabel_anatomical.nii"), 2000.5),
    "channels": (lambda: channels(DATA / "pyvista_channels.vti"), 2.5),
}


def repeated(work, repeats):
    """Seconds of every run, and the result of the last."""
    seconds = []
    while len(seconds) < repeats and sum(seconds) < ENOUGH:
        result = None
        start = time.perf_counter()
        result = work()
        seconds.append(time.perf_counter() - start)
    return seconds, result


def run_vtk(samples, iso, threads, repeats):
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk

    image = vtk.vtkImageData()
    image.SetDimensions(*samples.shape[::-1])
    image.GetPointData().SetScalars(numpy_to_vtk(samples.reshape(-1)))
    best = None
    for backend in ["Sequential", "STDThread", "TBB", "OpenMP"]:
        if (threads > 1) == (backend == "Sequential") or not vtk.vtkSMPTools.SetBackend(backend):
            continue
        vtk.vtkSMPTools.Initialize(threads)

        def work():
            edges = vtk.vtkFlyingEdges3D()
            edges.SetInputData(image)
            edges.SetValue(0, iso)
            edges.ComputeNormalsOff()
            edges.ComputeGradientsOff()
            edges.ComputeScalarsOff()
            edges.Update()
            return edges.GetOutput()

        seconds, mesh = repeated(work, repeats)
        if best is None or statistics.median(seconds) < statistics.median(best[0]):
            best = seconds, mesh.GetNumberOfPolys(), f"{vtk.vtkVersion.GetVTKVersion()} {backend}"
    return best


def run_skimage(samples, iso, _, repeats):
    from skimage.measure import marching_cubes

    seconds, (_, faces, _, _) = repeated(lambda: marching_cubes(samples, iso), repeats)
    return seconds, len(faces), importlib.metadata.version("scikit-image")


def run_mcubes(samples, iso, _, repeats):
    import mcubes

    # It works on doubles; the conversion is left out.
    samples = samples.astype(np.float64)
    seconds, (_, faces) = repeated(lambda: mcubes.marching_cubes(samples, iso), repeats)
    return seconds, len(faces), importlib.metadata.version("PyMCubes")


PYTHON = {"vtkFlyingEdges3D": run_vtk, "scikit-image": run_skimage, "PyMCubes": run_mcubes}
ONE_THREAD = {"scikit-image", "PyMCubes", "fast-surface-nets"}
PELLICLE = {"pellicle": "classic", "pellicle consistent": "consistent", "pellicle topological": "topological"}
TOOLS = [*PELLICLE, *PYTHON, "fast-surface-nets"]


def measure(tool, file, samples, iso, threads, repeats, binary):
    """Seconds of every run, triangles, version, and seconds to read the array once (or none)."""
    dims = [str(n) for n in samples.shape[::-1]]
    if tool in PYTHON:
        command = [sys.executable, __file__, "--one", tool, str(file), str(samples.dtype), *dims, str(iso), str(threads), str(repeats)]
    elif tool == "fast-surface-nets":
        command = [binary, "surface-nets", str(file), str(samples.dtype), *dims, str(iso), str(repeats)]
    else:
        command = [binary, "contour", str(file), str(samples.dtype), *dims, str(iso), str(threads), str(repeats), PELLICLE[tool]]
    report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
    return report["seconds"], report["triangles"], report["version"], report.get("read_seconds")


def one(arguments):
    tool, file, kind, nx, ny, nz, iso, threads, repeats = arguments
    samples = np.fromfile(file, kind).reshape(int(nz), int(ny), int(nx))
    seconds, triangles, version = PYTHON[tool](samples, float(iso), int(threads), int(repeats))
    print(json.dumps({"seconds": seconds, "triangles": triangles, "version": version}))


def rows_of(args):
    with tempfile.TemporaryDirectory() as folder:
        for name in args.volume:
            make, iso = VOLUMES[name]
            try:
                samples = np.ascontiguousarray(make())
            except FileNotFoundError as missing:
                print(f"SKIPPED: {name}: {missing}", file=sys.stderr)
                continue
            file = Path(folder) / name
            samples.tofile(file)
            cells = int(np.prod([n - 1 for n in samples.shape]))
            for threads in args.threads:
                for tool in args.tool:
                    if threads > 1 and tool in ONE_THREAD:
                        continue
                    seconds, triangles, version, read = measure(tool, file, samples, iso, threads, args.repeats, args.bin)
                    median = statistics.median(seconds)
                    row = {"volume": name, "tool": tool, "version": version, "threads": threads, "seconds": median,
                           "cells_per_s": cells / median, "triangles": triangles, "triangles_per_s": triangles / median}
                    yield row, {**row, "all_seconds": seconds}
                    if read and tool == "pellicle":
                        read = statistics.median(read)
                        row = {"volume": name, "tool": "read once", "version": version, "threads": threads, "seconds": read,
                               "cells_per_s": cells / read, "triangles": 0, "triangles_per_s": 0.0}
                        yield row, row
            file.unlink()


def main():
    if sys.argv[1:2] == ["--one"]:
        return one(sys.argv[2:])
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--volume", nargs="+", choices=VOLUMES, default=list(VOLUMES))
    parser.add_argument("--tool", nargs="+", choices=TOOLS, default=TOOLS)
    parser.add_argument("--threads", nargs="+", type=int, default=[1, 2])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--record", type=Path, help="folder to which rows and machine are appended")
    parser.add_argument("--bin", default=str(ROOT / "target" / "release" / "pellicle-bench"))
    args = parser.parse_args()
    rows = []
    for row, raw in rows_of(args):
        rows.append(raw)
        if args.json:
            print(json.dumps(row), flush=True)
        else:
            print(f"{row['volume']:10} {row['tool']:20} {row['version']:18} {row['threads']} threads {1e3 * row['seconds']:9.1f} ms "
                  f"{row['cells_per_s'] / 1e6:8.1f} Mcell/s {row['triangles']:9} triangles", flush=True)
    if args.record:
        args.record.mkdir(parents=True, exist_ok=True)
        cpu = next((line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.machine())
        with open(args.record / "rows.jsonl", "a") as out:
            for row in rows:
                out.write(json.dumps({**row, "cpu": cpu, "cores": os.cpu_count()}) + "\n")


if __name__ == "__main__":
    main()
