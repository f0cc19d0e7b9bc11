"""ctr-pvs workspace: what it tells is what is in the table, pictures, Ctrl-C, and one clear line for bad input."""

from __future__ import annotations

import os
import re
import signal
import sys
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.seeing.workspace import summary
from ctr_pvs.tasks.sweep import REJECTED
from ctr_pvs.tasks.sweep import Layout
from ctr_pvs.tasks.sweep import Listed
from ctr_pvs.tasks.sweep import Rows

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "three_tubes.yaml")


def workspace(capsys, *words, code: int = 0) -> str:
    assert cli.main(["workspace", ROBOT, *map(str, words)]) == code
    captured = capsys.readouterr()
    if code != 2:
        return captured.out
    assert captured.out == "" and len(captured.err.splitlines()) == 1
    return captured.err


def test_what_is_told_is_what_is_in_the_table(capsys, tmp_path):
    pytest.importorskip("matplotlib")
    table, picture = tmp_path / "w.npz", tmp_path / "w.png"
    words = ["--count", "60", "--seed", "5", "--voxel", "0.02", "--output", table, "--picture", picture]
    out = workspace(capsys, *words)
    with np.load(table) as file:
        rows = {key: file[key] for key in file.files}
    assert len(rows["alpha"]) == 60
    good = np.isin(rows["status_names"][rows["status"]], ("ok", "snap"))
    tips = rows["tip_position"][good]
    cubes = {tuple(place) for place in np.floor(tips / 0.02).astype(int).tolist()}
    assert f"{8.0 * len(cubes):.4g} cm^3: {len(cubes)} cubes of 20 mm" in out
    assert f"least {rows['stability_margin'][good].min():.4f}" in out
    assert f"x {1e3 * tips[:, 0].min():.1f} to {1e3 * tips[:, 0].max():.1f}" in out
    assert out.splitlines()[-2:] == [str(table), str(picture)]
    assert picture.stat().st_size > 10_000
    answer = EquilibriumSolver(load_robot(ROBOT)).solve(rows["alpha"][7], rows["D"][7])
    assert rows["tip_position"][7] == pytest.approx(answer.tip.position, abs=1e-9)
    other = tmp_path / "w.csv"
    workspace(capsys, *words[:4], "--output", other)
    assert other.read_text().splitlines()[8].split(",")[6:9] == [repr(x) for x in rows["tip_position"][7].tolist()]


def test_failures_are_told_by_reason_and_left_out_of_the_rest():
    layout = Layout(["tube"], False)
    numbers = np.zeros((4, len(layout.names)))
    numbers[:, layout.groups["tip_position"]] = [[0.1, 0, 0], [0.2, 0, 0], [9.0, 0, 0], [np.nan] * 3]
    lines = summary("robot", Rows(layout, numbers, np.array([0, 1, 4, REJECTED], dtype=np.int8)), 9, 3, 0.01)
    assert lines[0] == "robot: 4 random commands of 9, stopped, seed 3: 1 ok, 1 snap, 1 tolerance_missed, 1 rejected"
    assert "x 100.0 to 200.0" in lines[1] and "2 cubes of 10 mm" in lines[3]
    nothing = Rows(layout, numbers[3:], np.array([REJECTED], dtype=np.int8))
    assert summary("robot", nothing, 1, 0, None) == ["robot: 1 random commands, seed 0: 1 rejected"]


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_resume_tells_what_one_run_tells(capsys, tmp_path, monkeypatch, ending):
    whole, path = tmp_path / f"whole.{ending}", tmp_path / f"parts.{ending}"
    words, plain = ["--count", "90", "--seed", "2"], Listed.rows
    told = workspace(capsys, *words, "--output", whole)

    def interrupted(commands, start, stop):
        os.kill(os.getpid(), signal.SIGINT)
        return plain(commands, start, min(stop, start + 20))

    with monkeypatch.context() as patched:
        patched.setattr(Listed, "rows", interrupted)
        assert "20 random commands of 90, stopped" in workspace(capsys, *words, "--output", path, code=130)
    assert workspace(capsys, *words, "--output", path, "--resume") == told.replace(str(whole), str(path))
    assert path.suffix != ".csv" or path.read_bytes() == whole.read_bytes()
    assert workspace(capsys, *words, "--output", path, "--resume") == told.replace(str(whole), str(path))
    assert "is there already" in workspace(capsys, *words, "--output", path, code=2)
    assert "holds other commands" in workspace(capsys, *words[:3], "3", "--output", path, "--resume", code=2)
    assert "expected --output" in workspace(capsys, *words, "--resume", code=2)


def test_ctrl_c_ends_with_what_is_done(capsys, tmp_path, monkeypatch):
    plain = Listed.rows

    def interrupted(commands, start, stop):
        os.kill(os.getpid(), signal.SIGINT)
        return plain(commands, start, min(stop, start + 6))

    monkeypatch.setattr(Listed, "rows", interrupted)
    out = workspace(capsys, "--count", "100", "--output", tmp_path / "w.npz", code=130)
    assert re.match("three_tubes: 6 random commands of 100, stopped, seed 0: ", out)
    assert len(np.load(tmp_path / "w.npz")["alpha"]) == 6


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--count", "0"], "from 1 to"),
        (["--seed", "-1"], "from 0 to"),
        (["--voxel", "0"], "--voxel"),
        (["--output", "w.parquet"], ".npz or .csv"),
        (["--picture", "w.pdf"], ".png or .svg"),
    ],
)
def test_bad_input_is_one_line(capsys, words, said):
    assert said in workspace(capsys, *words, code=2)


def test_a_picture_without_matplotlib_is_refused_before_the_work(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    assert "pictures need matplotlib" in workspace(capsys, "--picture", "w.png", code=2)
