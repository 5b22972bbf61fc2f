#!/usr/bin/env python3
"""Records the comparison with splashsurf in runs/DATE/: what was run, where, with what, raw rows, and a summary.

    record.py --compare PATH/compare_splashsurf.py [--tile PATH/tile_scene.py] [--data FOLDER] [--python INTERPRETER]

It builds the release, finds out which frames both programs read, and hands these to the comparison script, which does the
timing and is not part of this repository. Each frame goes through the script twice: with --no-check for time and memory,
then with its checks and one run for the agreement of the surfaces. Not in one go, because the peak memory that Linux
accounts to a child includes its parent's at the moment of the fork, and the checks make the script itself large.

Small frames run at every cell size and number of threads. Large ones, the refined dam break and with --tile a dam break
tiled to ten million particles, run at a cell of 1.0 radii and --large-runs times.

Writes run.json (everything), raw.txt (what the script printed) and summary.md, anew after each frame, so that a recording
that is broken off leaves what it has. Folders are left out of recorded commands and messages. Exit status 1 when a run
failed or surfaces disagree, 2 when it could not start. Standard library only; the interpreter that runs the scripts
(--python) needs numpy, scipy and trimesh.
"""

import argparse
import datetime
import fnmatch
import json
import math
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Particle radius by the beginning of a frame's name; the first that fits counts.
RADII = {"cbd1m": 0.0125, "cbd": 0.025, "drop": 0.02, "hemi": 0.025}
LARGE = "cbd1m*"
# The tiled frame: what it is made of, the simulation's box in x and z, and how many particles at least.
TILED, TILE, BOX, TARGET = "cbd_tiled_10m.xyz", "cbd_t1.10.xyz", ("5.3", "5.3"), "10e6"


@dataclass
class Frame:
    path: Path
    radius: float
    is_large: bool = False
    # The judge of surfaces holds a mesh's edges several times over: tens of millions of triangles do not fit.
    is_checked: bool = True


def main():
    options = parse_arguments()
    try:
        run = prepare(options)
    except (OSError, subprocess.CalledProcessError) as error:
        print(f"record.py: {error}", file=sys.stderr)
        return 2
    with tempfile.TemporaryDirectory() as folder:
        for frame in find_frames(options, Path(folder)):
            record_frame(options, run, frame)
            write_out(options.out, run)
    write_out(options.out, run)
    print(f"\n{summary(run)}\n\nwritten to {options.out}")
    disagree = any(row["agrees"] is False for row in run["rows"])
    return 1 if run["failures"] or disagree or not run["rows"] else 0


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    today = datetime.date.today().isoformat()
    data = os.environ.get("PELLICLE_DATA") or ROOT.parent / "shared" / "data"
    cargo_bin = Path.home() / ".cargo/bin/splashsurf"
    add = parser.add_argument
    add("--compare", type=Path, required=True, help="the comparison script, compare_splashsurf.py")
    add("--tile", type=Path, help="the script that tiles a frame, tile_scene.py; without it no frame of 10 M particles")
    add("--data", type=Path, default=data, help="folder with particles/ in it (default: PELLICLE_DATA)")
    add("--splashsurf", type=Path, default=shutil.which("splashsurf") or cargo_bin, help="default: from PATH or cargo")
    add("--python", default=sys.executable, help="interpreter for the scripts (default: this one)")
    add("--cells", nargs="+", default=["0.5", "1.0"], help="cell sizes in radii (default: 0.5 1.0)")
    add("--threads", nargs="+", default=["1", "2"], help="numbers of threads (default: 1 2)")
    add("--runs", type=int, default=5, help="timed runs of each program (default: 5)")
    add("--large-runs", type=int, default=3, help="the same for large frames (default: 3)")
    add("--only", nargs="+", default=["*"], metavar="PATTERN", help="frames by name, as in 'cbd_t*'")
    add("--out", type=Path, default=Path(__file__).parent / "runs" / today, help="default: runs/DATE beside this file")
    options = parser.parse_args()
    if options.out.exists() and any(options.out.iterdir()):
        parser.error(f"{options.out} is not empty: name another folder with --out")
    for path in filter(None, (options.compare, options.tile, options.data / "particles", options.splashsurf)):
        if not path.exists():
            parser.error(f"{path} does not exist")
    return options


def prepare(options):
    """Builds pellicle, makes sure that nothing is missing, and begins the record."""
    # Now, before the build adds its own.
    load = os.getloadavg()[0]
    if load > 0.5:
        print(f"the machine is busy (load {load:.1f}): times will be off", file=sys.stderr)
    # What the checks import must be there before an hour of runs, not after.
    output([options.python, "-c", "import numpy, scipy, trimesh"])
    subprocess.run(["cargo", "build", "--release", "--package", "pellicle-cli"], cwd=ROOT, check=True)
    metadata = output(["cargo", "metadata", "--no-deps", "--format-version", "1"])
    options.ours = Path(json.loads(metadata)["target_directory"]) / "release/pellicle"
    options.out.mkdir(parents=True, exist_ok=True)
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "command": without_folders(shlex.join(["python3", *sys.argv])),
        "machine": {**machine(), "load_before": load},
        "versions": versions(options),
        "left_out": {},
        "failures": {},
        "rows": [],
        "raw": [],
    }


def output(command):
    return subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout.strip()


def machine():
    info = Path("/proc/cpuinfo")
    lines = dict(line.split(":", 1) for line in info.read_text().splitlines() if ":" in line) if info.exists() else {}
    lines = {key.strip(): value.strip() for key, value in lines.items()}
    flags = lines.get("flags", "").split()
    return {
        "cpu": lines.get("model name") or platform.processor() or "unknown",
        "vector_units": [flag for flag in ("avx2", "fma", "avx512f") if flag in flags],
        "cores": os.cpu_count(),
        "memory_bytes": os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"),
        "kernel": f"{platform.system()} {platform.release()} {platform.machine()}",
    }


def versions(options):
    has_changes = bool(output(["git", "status", "--porcelain", "--untracked-files=no"]))
    return {
        "pellicle": output([options.ours, "--version"]),
        "pellicle_commit": output(["git", "rev-parse", "HEAD"]) + (" with changes" if has_changes else ""),
        "splashsurf": output([options.splashsurf, "--version"]),
        "rustc": output(["rustc", "--version"]),
        "python": platform.python_version(),
    }


def find_frames(options, folder):
    """The frames asked for, small ones first; the tiled one is made in `folder`."""

    def is_wanted(name):
        return any(fnmatch.fnmatch(name, pattern) for pattern in options.only)

    particles = options.data / "particles"
    frames = []
    for path in sorted(particles.iterdir()):
        radius = next((radius for beginning, radius in RADII.items() if path.name.startswith(beginning)), None)
        if radius and is_wanted(path.name):
            frames.append(Frame(path, radius, is_large=fnmatch.fnmatch(path.name, LARGE)))
    yield from sorted(frames, key=lambda frame: frame.is_large)
    if options.tile and is_wanted(TILED):
        path = folder / TILED
        output([options.python, options.tile, particles / TILE, path, "--box", *BOX, "--target", TARGET])
        yield Frame(path, RADII["cbd"], is_large=True, is_checked=False)


def record_frame(options, run, frame):
    """Adds the rows of a frame to the record, or why there are none."""
    name = frame.path.name
    print(f"\n{name}", flush=True)
    for program in (options.ours, options.splashsurf):
        if reason := unreadable(program, frame):
            run["left_out"][name] = f"{program.name} does not read it: {reason}"
            print(run["left_out"][name])
            return
    times = ["--runs", options.large_runs if frame.is_large else options.runs, "--no-check"]
    rows = compare(options, run, frame, times, options.threads)
    # True, False, or None where it was not looked at.
    # One number of threads tells for all: pellicle's bytes do not depend on it.
    judged = compare(options, run, frame, ["--runs", 1], options.threads[-1:]) if frame.is_checked else []
    verdicts = {row["cell"]: row for row in judged}
    for row in rows:
        verdict = verdicts.get(row["cell"], {"agrees": None, "agreement": "not checked"})
        row.update(agrees=verdict["agrees"], agreement=verdict["agreement"], is_large=frame.is_large)
        run["rows"].append(row)


def unreadable(program, frame):
    """Why a program cannot read a frame, in its own words, or None. Found by trying, at a cell that takes no time."""
    verb = "mesh" if program.name.startswith("pellicle") else "reconstruct"
    with tempfile.TemporaryDirectory() as folder:
        surface = Path(folder) / "surface.ply"
        command = [program, verb, frame.path, "-r", str(frame.radius), "-l", "2", "-c", "4", "-t", "0.6", "-o", surface]
        tried = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
        if tried.returncode == 0 and surface.exists():
            return None
    lines = [line for line in tried.stdout.splitlines() if line.strip()] or [f"exit status {tried.returncode}"]
    return without_folders(re.sub(r"^(\[[^\]]*\])+\s*(caused by:)?\s*", "", lines[-1]))


def compare(options, run, frame, arguments, threads):
    """Runs the comparison script on a frame, shows and keeps what it prints, and returns its rows."""
    cells = ["1.0"] if frame.is_large else options.cells
    command = [options.python, options.compare, frame.path, "-r", frame.radius, "-c", *cells, "-n", *threads]
    command += [*arguments, "--ours", options.ours, "--splashsurf", options.splashsurf]
    command = [str(word) for word in command]
    lines = []
    if "--no-check" not in command:
        run["raw"].append("# For the agreement only: memory is that of the script, which holds the judge.")
    run["raw"].append("$ " + without_folders(shlex.join(command)))
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True) as script:
        for line in script.stdout:
            print(line, end="", flush=True)
            lines.append(line.rstrip())
    rows = [row for row in map(parse_row, lines) if row]
    run["raw"] += [line if parse_row(line) else without_folders(line) for line in lines]
    # The script ends with 1 when surfaces disagree, too; their rows say so themselves.
    if len(rows) < len(cells) * len(threads):
        run["failures"][frame.path.name] = without_folders("\n".join(lines[-5:]))
    return rows


def parse_row(line):
    """A row of the comparison script's table, or None for any other line."""
    number = r"\s+([\d.]+)"
    match = re.match(rf"(\S+){number * 5}x{number * 3}x\s+(ok|DISAGREE):\s*(.*)", line)
    if not match:
        return None
    frame, cell, threads, ours, theirs, ratio, our_mb, their_mb, memory, verdict, agreement = match.groups()
    return {
        "frame": frame,
        "cell": float(cell),
        "threads": int(threads),
        "pellicle_s": float(ours),
        "splashsurf_s": float(theirs),
        "time_ratio": float(ratio),
        "pellicle_mb": float(our_mb),
        "splashsurf_mb": float(their_mb),
        "memory_ratio": float(memory),
        "agrees": verdict == "ok",
        "agreement": agreement,
    }


def without_folders(text):
    """Paths become names: where a folder lies on the machine says nothing about the run."""
    return re.sub(r"[^\s=\"'(]*/(?=[^\s/])", "", text)


def summarize(rows):
    """Geometric mean and least of the ratios, for each cell size and number of threads, then over all."""
    groups = {}
    for row in rows:
        groups.setdefault((row["cell"], row["threads"]), []).append(row)
    if len(groups) > 1:
        groups["all", "all"] = rows
    lines = []
    for (cell, threads), members in groups.items():
        line = {"cell": cell, "threads": threads, "rows": len(members)}
        for what in ("time", "memory"):
            ratios = [row[f"{what}_ratio"] for row in members]
            worst = min(members, key=lambda row: row[f"{what}_ratio"])
            line[f"{what}_mean"] = round(geometric_mean(ratios), 2)
            line[f"{what}_least"] = min(ratios)
            line[f"{what}_least_frame"] = worst["frame"]
        lines.append(line)
    return lines


def geometric_mean(values):
    # A ratio that was printed as 0.00 is a failure that no mean can hold.
    return math.exp(sum(map(math.log, values)) / len(values)) if min(values) > 0 else 0.0


def scaling(rows):
    """How many times sooner pellicle ends with more threads than the fewest of the same frame and cell size."""
    lines = []
    for row in rows:
        peers = [peer for peer in rows if (peer["frame"], peer["cell"]) == (row["frame"], row["cell"])]
        base = min(peers, key=lambda peer: peer["threads"])
        if row is not base and row["pellicle_s"] > 0:
            ratio = base["pellicle_s"] / row["pellicle_s"]
            threads = f"{row['threads']} threads over {base['threads']}"
            lines.append(f"- {row['frame']}, cell {row['cell']}, {threads}: {ratio:.2f}")
    return lines


def write_out(folder, run):
    sets = {"small": [r for r in run["rows"] if not r["is_large"]], "large": [r for r in run["rows"] if r["is_large"]]}
    run["summary"] = {name: summarize(rows) for name, rows in sets.items() if rows}
    everything = {name: value for name, value in run.items() if name != "raw"}
    (folder / "run.json").write_text(json.dumps(everything, indent=1) + "\n")
    (folder / "raw.txt").write_text("\n".join(run["raw"]) + "\n")
    (folder / "summary.md").write_text(summary(run) + "\n")


def summary(run):
    """The record for people."""
    at, of = run["machine"], run["versions"]
    lines = [
        f"# pellicle and splashsurf, {run['date'][:10]}",
        "",
        "Ratios are splashsurf over pellicle: more is better for pellicle. Time is wall time from file to file, memory the",
        "peak resident set. Raw rows: `raw.txt`, `run.json`.",
        "",
        f"- command: `{run['command']}`",
        f"- machine: {at['cpu']}, {at['cores']} cores, {at['memory_bytes'] / 2**30:.0f} GiB, {at['kernel']}; "
        f"{' '.join(at['vector_units'])}; load before {at['load_before']:.2f}",
        f"- {of['pellicle']} at commit {of['pellicle_commit']}, {of['splashsurf']}, {of['rustc']}",
    ]
    titles = {"small": "Frames of 20 to 150 thousand particles", "large": "Frames of 1 and 10 million particles"}
    for name, means in run.get("summary", {}).items():
        head = "cell | threads | rows | time, geometric mean | least | memory, geometric mean | least"
        lines += ["", f"## {titles[name]}", "", *table(head, [summary_cells(line) for line in means])]
    if scaled := scaling([row for row in run["rows"] if row["is_large"]]):
        lines += ["", "### pellicle against itself", "", *scaled]
    head = "frame | cell | threads | pellicle s | splashsurf s | ratio | pellicle MB | splashsurf MB | ratio | surfaces"
    lines += ["", "## Rows", "", *table(head, [row_cells(row) for row in run["rows"]])]
    for title, notes in (("Left out", run["left_out"]), ("Failed", run["failures"])):
        if notes:
            lines += ["", f"## {title}", "", *(f"- {name}: {' '.join(text.split())}" for name, text in notes.items())]
    return "\n".join(lines)


def summary_cells(line):
    cells = [line["cell"], line["threads"], line["rows"]]
    for what in ("time", "memory"):
        cells += [f"{line[f'{what}_mean']:.2f}", f"{line[f'{what}_least']:.2f} ({line[f'{what}_least_frame']})"]
    return cells


def row_cells(row):
    verdict = {True: "agree", False: f"DISAGREE: {row['agreement']}", None: "not checked"}[row["agrees"]]
    numbers = ("pellicle_s", "splashsurf_s", "time_ratio", "pellicle_mb", "splashsurf_mb", "memory_ratio")
    return [row["frame"], row["cell"], row["threads"], *(f"{row[name]:g}" for name in numbers), verdict]


def table(head, rows):
    head = head.split(" | ")
    return ["| " + " | ".join(map(str, cells)) + " |" for cells in (head, ["---"] * len(head), *rows)]


if __name__ == "__main__":
    sys.exit(main())
