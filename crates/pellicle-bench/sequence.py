#!/usr/bin/env python3
"""How well a sequence overlaps: its wall time beside the sum of the slowest stage of its frames, made one by one.

    sequence.py FRAME [--radius R] [--cell C] [--count N] [--runs K] [--bin PELLICLE]

Copies FRAME under N names (the system's cache keeps them in memory: it is the program that is measured, not the disk), makes
the frame alone twelve times, and the sequence K times. A frame has three stages: reading; meshing (sort to count); emitting and
writing. Prints medians; 1.0 means that everything but the slowest stage is hidden.
"""

import argparse
import json
import shutil
import statistics
import subprocess
import tempfile
from pathlib import Path


def report(*command):
    return json.loads(subprocess.run([*map(str, command), "--json"], check=True, capture_output=True, text=True).stdout)


def stages(frame):
    seconds = {stage["name"]: stage["seconds"] for stage in frame["stages"]}
    read, write = seconds.pop("read"), seconds.pop("write")
    return read, sum(seconds.values()), write


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frame", type=Path)
    parser.add_argument("--radius", default="0.025")
    parser.add_argument("--cell", default="1.0")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--bin", default="pellicle")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        options = ("-r", args.radius, "-c", args.cell)
        single = [stages(report(args.bin, "mesh", args.frame, *options, "-o", folder / "one.ply")) for _ in range(12)]
        read, mesh, write = (statistics.median(times) for times in zip(*single))
        for number in range(args.count):
            shutil.copy(args.frame, folder / f"f_{number:04}{args.frame.suffix}")
        pattern = folder / f"f_####{args.frame.suffix}"
        runs = [report(args.bin, "mesh", pattern, *options, "-o", f"{folder}/out{run}/") for run in range(args.runs)]
    assert all(run["frames_done"] == args.count for run in runs)
    wall = statistics.median(run["seconds"] for run in runs)
    slowest = max(read, mesh, write)
    print(f"one frame: read {1e3 * read:.1f} ms, mesh {1e3 * mesh:.1f} ms, emit and write {1e3 * write:.1f} ms")
    print(f"{args.count} frames: {wall:.2f} s, {args.count / wall:.1f} frames/s, {wall / (args.count * slowest):.3f} times the slowest stage alone")
    print(f"peak memory {max(run['peak_memory_bytes'] for run in runs) / 1e6:.0f} MB")


if __name__ == "__main__":
    main()
