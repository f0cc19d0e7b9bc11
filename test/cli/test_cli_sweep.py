"""ctr-pvs sweep: tables of every kind, Ctrl-C and --resume, and one clear line for bad input."""

from __future__ import annotations

import csv
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.seeing import sweep as subcommand
from ctr_pvs.tasks.sweep import Grid

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "renda2021.yaml")
GRID = ["--alpha-range", "0", "-60:120:4", "--D-range", "0.05:0.0935:2", "0.1:0.2085:3", "--degrees"]
ENDINGS = ["csv", "npz", "parquet"]


def sweep(capsys, *words, code: int = 0) -> str:
    assert cli.main(["sweep", ROBOT, *map(str, words)]) == code
    captured = capsys.readouterr()
    if code != 2:
        assert "Traceback" not in captured.err
        return captured.out
    assert captured.out == "" and len(captured.err.splitlines()) == 1
    return captured.err


def rows_in(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def needs(ending: str) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow")


def test_a_grid_as_csv(capsys, tmp_path):
    path = tmp_path / "grid.csv"
    assert sweep(capsys, *GRID, "--output", path) == f"{path}: 24 of 24 rows; new: 24 ok\n"
    rows = rows_in(path)
    angles = np.radians([-60.0, 0.0, 60.0, 120.0])
    assert [float(row["alpha_inner"]) for row in rows] == pytest.approx(np.repeat(angles, 6), abs=1e-12)
    assert [float(row["D_inner"]) for row in rows[:3]] == [0.1, 0.15425, 0.2085]
    row = rows[13]
    command = [[float(row[f"{kind}_{name}"]) for name in ("outer", "inner")] for kind in ("alpha", "D")]
    answer = EquilibriumSolver(load_robot(ROBOT)).solve(*command)
    assert [float(row[f"tip_{axis}"]) for axis in "xyz"] == pytest.approx(answer.tip.position, abs=1e-10)
    assert float(row["force_inner"]) == pytest.approx(answer.force[1], abs=1e-7)
    assert float(row["stability_margin"]) == pytest.approx(answer.stability_margin, abs=1e-7)


def test_every_kind_of_table_holds_the_same_bits(capsys, tmp_path):
    sweep(capsys, *GRID, "--output", tmp_path / "t.csv")
    sweep(capsys, *GRID, "--output", tmp_path / "t.npz")
    rows = rows_in(tmp_path / "t.csv")
    with np.load(tmp_path / "t.npz") as file:
        names = file["status_names"][file["status"]].tolist()
        assert names == [row["status"] for row in rows]
        for key, columns in (
            ("D", ["D_outer", "D_inner"]),
            ("tip_position", ["tip_x", "tip_y", "tip_z"]),
            ("tip_orientation", ["tip_qx", "tip_qy", "tip_qz", "tip_qw"]),
            ("torque", ["torque_outer", "torque_inner"]),
        ):
            assert file[key].tolist() == [[float(row[name]) for name in columns] for row in rows]
        assert file["stability_margin"].tolist() == [float(row["stability_margin"]) for row in rows]
    parquet = pytest.importorskip("pyarrow.parquet")
    sweep(capsys, *GRID, "--output", tmp_path / "t.parquet")
    table = parquet.read_table(tmp_path / "t.parquet")
    assert table["tip_y"].to_pylist() == [float(row["tip_y"]) for row in rows]


def test_a_table_of_answers_is_a_list_of_commands(capsys, tmp_path):
    grid, again = tmp_path / "grid.csv", tmp_path / "again.csv"
    sweep(capsys, *GRID, "--tip-force", "0", "-0.1", "0", "--output", grid)
    assert {row["tip_force_y"] for row in rows_in(grid)} == {"-0.1"}
    sweep(capsys, "--commands", grid, "--output", again)
    assert again.read_bytes() == grid.read_bytes()


@pytest.mark.parametrize("ending", ENDINGS)
def test_ctrl_c_keeps_what_is_done_and_resume_ends_with_the_same_file(capsys, tmp_path, monkeypatch, ending):
    needs(ending)
    whole, path = tmp_path / f"whole.{ending}", tmp_path / f"part.{ending}"
    sweep(capsys, *GRID, "--output", whole)
    plain = Grid.rows

    def interrupted(grid, start, stop):
        if start == 5:  # once, though more is asked for ahead
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.05)  # for the handler
        return plain(grid, start, min(stop, start + 5))

    with monkeypatch.context() as patch:
        patch.setattr(Grid, "rows", interrupted)
        assert "10 of 24 rows" in sweep(capsys, *GRID, "--output", path, code=130)
    handler = signal.getsignal(signal.SIGINT)
    assert handler is signal.default_int_handler
    assert "24 of 24 rows; new: 14 ok" in sweep(capsys, *GRID, "--output", path, "--resume")
    if ending == "csv":
        assert path.read_bytes() == whole.read_bytes()
    if ending == "npz":
        with np.load(path) as one, np.load(whole) as other:
            assert all(one[key].tobytes() == other[key].tobytes() for key in other.files)
    assert "24 of 24 rows\n" in sweep(capsys, *GRID, "--output", path, "--resume")  # nothing left to do
    assert sorted(file.name for file in tmp_path.iterdir()) == sorted([path.name, whole.name])


def test_a_line_written_in_part_is_written_anew(capsys, tmp_path):
    path = tmp_path / "t.csv"
    sweep(capsys, *GRID, "--output", path)
    whole = path.read_bytes()
    for cut in (len(whole) - 1, len(whole) - 30, len(whole.split(b"\n")[0]) + 1):
        path.write_bytes(whole[:cut])
        sweep(capsys, *GRID, "--output", path, "--resume")
        assert path.read_bytes() == whole


def test_resume_refuses_what_is_not_its_own(capsys, tmp_path):
    path = tmp_path / "t.csv"
    sweep(capsys, *GRID, "--output", path)
    kept = path.read_bytes()
    others = {
        "is there already": GRID,
        "holds other commands": [*GRID[:-1], "--resume"],
        "holds no rows of this robot": [*GRID, "--tip-force", "0", "0", "0.1", "--resume"],
    }
    for said, words in others.items():
        assert said in sweep(capsys, *words, "--output", path, code=2)
    text = (ROOT / "config" / "renda2021.yaml").read_text().replace("58.0e9", "29.0e9", 1)
    other = tmp_path / "softer.yaml"
    other.write_text(text)
    assert cli.main(["sweep", str(other), *GRID, "--output", str(path), "--resume"]) == 2
    assert "another robot" in capsys.readouterr().err
    assert path.read_bytes() == kept
    for name in ("junk.csv", "junk.npz"):
        (tmp_path / name).write_bytes(b"no table\n")
        assert "holds no rows" in sweep(capsys, *GRID, "--output", tmp_path / name, "--resume", code=2)


def test_ctrl_c_from_outside(tmp_path):
    """The process as a shell runs it: SIGINT, exit code 130, a valid file, and progress on standard error."""
    path = tmp_path / "long.csv"
    words = ["sweep", ROBOT, "--alpha-range", "0", "0:6:100000", "--D-range", "0.0935", "0.2085", "--output", str(path)]
    process = subprocess.Popen([sys.executable, "-m", "ctr_pvs", *words], stdout=-1, stderr=-1, text=True, cwd=ROOT)
    try:
        until = time.monotonic() + 120.0
        while time.monotonic() < until and not (path.exists() and path.stat().st_size > 20_000):
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        out, error = process.communicate(timeout=60)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == 130, error
    rows = rows_in(path)
    assert f"{path}: {len(rows)} of 100000 rows" in out and rows[-1]["status"] in ("ok", "snap")
    assert error.splitlines()[-1] == "ctr-pvs: stopped; --resume goes on"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--output", "t.csv"], "--alpha-range and --D-range, or --commands"),
        ([*GRID, "--output", "t.txt"], ".csv or .npz or .parquet"),
        (["--alpha-range", "0", "0:1", "--D-range", "0.1", "0.2", "--output", "t.csv"], "low:high:count"),
        (["--alpha-range", "0", "0:1:1.5", "--D-range", "0.1", "0.2", "--output", "t.csv"], "a count from 2"),
        (["--alpha-range", "0", "0:x:3", "--D-range", "0.1", "0.2", "--output", "t.csv"], "a finite number"),
        (["--alpha-range", "0", "--D-range", "0.1", "0.2", "--output", "t.csv"], "2 tubes"),
        (["--commands", "list.csv", *GRID, "--output", "t.csv"], "no grid beside a list"),
        (["--commands", "none.csv", "--output", "t.csv"], "cannot read none.csv"),
        (["--commands", "short.csv", "--output", "t.csv"], "D_inner is missing"),
        (["--commands", "bad.csv", "--output", "t.csv"], "bad.csv, line 3, D_inner: expected a finite number, got 'x'"),
        (["--commands", "empty.csv", "--output", "t.csv"], "at least one row"),
    ],
)
def test_bad_input_is_one_line(capsys, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    header = "alpha_outer,alpha_inner,D_outer,D_inner\n"
    Path("short.csv").write_text("alpha_outer,alpha_inner,D_outer\n0,0,0\n")
    Path("bad.csv").write_text(header + "0,0,0.1,0.2\n0,0,0.1,x\n")
    Path("empty.csv").write_text(header)
    assert said in sweep(capsys, *words, code=2)
    assert not Path("t.csv").exists()


def test_parquet_without_pyarrow(capsys, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert "needs pyarrow" in sweep(capsys, *GRID, "--output", tmp_path / "t.parquet", code=2)


def test_progress_tells_rate_and_time_left(capsys, monkeypatch):
    from ctr_pvs.cli.seeing import progress

    now = iter([0.0, 5.0, 20.0, 100.0])
    monkeypatch.setattr(progress.time, "monotonic", lambda: next(now))
    told = progress.Progress(100, 1100)
    for done in (200, 300, 1100):
        told.tell(done)
    assert capsys.readouterr().err.splitlines() == [
        "300 of 1100 rows, 10 rows/s, 80 s left",
        "1100 of 1100 rows, 10 rows/s, 100 s",
    ]


def test_values_of_a_range():
    assert subcommand._values(" -1:1:5").tolist() == [-1.0, -0.5, 0.0, 0.5, 1.0]
    assert subcommand._values("0.25").tolist() == [0.25]
