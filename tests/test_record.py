"""The recorder of the comparison with splashsurf: what it reads from the script's table, and what it makes of it."""

import importlib.util
from pathlib import Path

PATH = Path(__file__).resolve().parent.parent / "crates/pellicle-bench/record.py"
SPEC = importlib.util.spec_from_file_location("record", PATH)
record = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(record)

ROW = "hemi_t0.60.ply                     0.50  2      0.019        0.410  21.58x      21     104   4.95x  ok: "
OTHER = (
    "hemi_t0.60.ply                     1.00  1      0.020        0.100   5.00x      10      80   8.00x  "
    "DISAGREE: components 3/4; area 1.0e-02"
)


def test_rows_of_the_script_are_read():
    row = record.parse_row(ROW)
    assert (row["frame"], row["cell"], row["threads"]) == ("hemi_t0.60.ply", 0.5, 2)
    assert (row["pellicle_s"], row["splashsurf_s"], row["time_ratio"]) == (0.019, 0.41, 21.58)
    assert (row["pellicle_mb"], row["splashsurf_mb"], row["memory_ratio"]) == (21, 104, 4.95)
    assert row["agrees"] is True
    other = record.parse_row(OTHER)
    assert (other["agrees"], other["agreement"]) == (False, "components 3/4; area 1.0e-02")


def test_other_lines_are_not_taken_for_rows():
    head = "file   c  n pellicle s splashsurf s   ratio      MB      MB  memory  agreement"
    for line in ("", head, "Traceback (most recent call last):", ROW[:60]):
        assert record.parse_row(line) is None


def test_summary_has_geometric_means_and_the_least_with_its_frame():
    rows = [record.parse_row(line) for line in (ROW.replace("21.58x", "20.00x"), OTHER)]
    every = record.summarize(rows)[-1]
    assert (every["cell"], every["rows"]) == ("all", 2)
    assert every["time_mean"] == 10.0
    assert (every["time_least"], every["time_least_frame"]) == (5.0, "hemi_t0.60.ply")
    assert every["memory_least"] == 4.95


def test_threads_are_compared_within_one_frame_and_cell():
    rows = [dict(record.parse_row(ROW), threads=threads, pellicle_s=time) for threads, time in ((2, 1.0), (1, 1.9))]
    assert record.scaling([*rows, record.parse_row(OTHER)]) == ["- hemi_t0.60.ply, cell 0.5, 2 threads over 1: 1.90"]


def test_folders_are_not_recorded():
    command = "python3 some/record.py --compare=/home/me/compare.py --only 'cbd_t*' -o ~/out/surface.ply"
    assert record.without_folders(command) == "python3 record.py --compare=compare.py --only 'cbd_t*' -o surface.ply"
    assert record.without_folders('file "/data/a.npy" (/b/c)') == 'file "a.npy" (c)'
