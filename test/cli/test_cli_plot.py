"""ctr-pvs plot: pictures of known shapes, curvature against closed form, and one clear line for bad input."""

from __future__ import annotations

import json
import re
import subprocess
import sys
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.seeing.drawn import drawn
from ctr_pvs.cli.seeing.plot_figure import _scale

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "renda2021.yaml")
COMMAND = ["--alpha", "0", "60", "--D", "0.0935", "0.1705", "--degrees"]


def plot(capsys, path: Path, *words: str, code: int = 0) -> str:
    assert cli.main(["plot", ROBOT, *COMMAND, "--output", str(path), *words]) == code
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


def test_a_png(capsys, tmp_path):
    path = tmp_path / "shape.png"
    assert plot(capsys, path) == f"{path}\n"
    image = pytest.importorskip("matplotlib.image").imread(path)
    assert min(image.shape[:2]) > 600
    colours = {(round(r, 1), round(g, 1), round(b, 1)) for r, g, b in image[..., :3].reshape(-1, 3).tolist()}
    assert {(0.3, 0.5, 0.7), (0.9, 0.6, 0.2)} <= colours  # both tubes


def test_an_svg_tells_the_command_and_the_loads(capsys, tmp_path, monkeypatch):
    matplotlib = pytest.importorskip("matplotlib")
    monkeypatch.setitem(matplotlib.rcParams, "svg.fonttype", "none")
    path = tmp_path / "shape.svg"
    plot(capsys, path, "--tip-force", "0", "-1", "0.3", "--line-force", "inner", "0", "0", "-2")
    text = " ".join(ET.parse(path).getroot().itertext())
    assert "loads: tip force (0, -1, 0.3) N; (0, 0, -2) N/m along inner" in text
    assert "α = 0, 60°" in text and "D = 93.5, 170.5 mm" in text and "force on the tip" in text


def test_the_page_is_whole_and_holds_the_answer(capsys, tmp_path):
    path = tmp_path / "shape.html"
    plot(capsys, path)
    page = path.read_text(encoding="utf-8")
    assert not re.search(r"(https?:)?//[a-z]|src=|href=", page)  # loads nothing
    data = json.loads(re.search(r"const data = (\{.*\});\n", page)[1])
    answer = EquilibriumSolver(load_robot(ROBOT)).solve(np.radians([0.0, 60.0]), [0.0935, 0.1705])
    assert data["tip"] == pytest.approx(1e3 * answer.tip.position, abs=1e-3)
    assert data["tubes"][1]["points"][-1] == pytest.approx(data["tip"], abs=1e-3)
    assert data["tubes"][0]["diameter"] == pytest.approx(2.39)
    outer, inner = (np.array(tube["twisting"], dtype=float) for tube in data["tubes"])
    assert np.nansum([outer, inner], axis=0) == pytest.approx(data["twisting"], abs=2e-3)  # N mm, with three decimals
    assert data["tubes"][0]["twist"][-1] is None and data["tubes"][1]["twist"][-1] is not None


@pytest.mark.parametrize("level", ["auto", "full"])
def test_curvature_of_tubes_in_one_plane(level, seed_robot):
    """Aligned tubes share the curvature sum K kappa / sum K: exact, piece by piece, at every level."""
    answer = EquilibriumSolver(seed_robot, 1e-8, level).solve([0.0, 0.0], [0.0935, 0.2185])
    shown = drawn(seed_robot, answer)
    outer, inner = (tube.segments[1] for tube in seed_robot.tubes)
    K = np.array([outer.bending_stiffness, inner.bending_stiffness])
    together = K @ [9.9, 13.8] / K.sum()
    middle = 0.5 * (shown.s[1:] + shown.s[:-1])
    ends = np.abs(middle - 0.085) > 1e-3
    expected = np.where(middle < 0.085, together, 9.9)
    assert shown.curvature[ends] == pytest.approx(expected[ends], rel=1e-6)


def test_curvature_under_a_tip_force_is_that_of_a_cantilever():
    """A small force F on a straight rod: k(s) = F (L - s) / K, which the pre-curvature alone would not tell."""
    rod = Robot("rod", (Tube("rod", (Segment(0.1, 0.02, 0.015),)),))
    answer = EquilibriumSolver(rod, 1e-9).solve([0.0], [0.0], loads=Loads(tip_force=(0.0, 1e-3, 0.0)))
    shown = drawn(rod, answer)
    middle = 0.5 * (shown.s[1:] + shown.s[:-1])
    assert shown.curvature == pytest.approx(1e-3 * (0.1 - middle) / 0.02, abs=2e-5)
    assert shown.tubes[0].diameter == pytest.approx(5e-4)
    assert "made up: rod" in shown.told[-1]


LOADS = (
    Loads(tip_force=(0.1, -0.8, 0.3)),
    Loads(tip_force=(0.0, 0.3, 0.0), tip_moment=(0.01, 0.0, -0.02)),
    Loads(),
)


@pytest.mark.parametrize("loads", LOADS, ids=["force", "moment too", "none"])
def test_moments_balance_the_loads_beyond(seed_robot, loads):
    """Statics of the part beyond a cut, whatever the tubes inside it do: M(s) = M_tip + (p_tip - p(s)) x F."""
    answer = EquilibriumSolver(seed_robot, 1e-8).solve([0.3, 2.0], [0.0935, 0.1705], loads=loads)
    shown = drawn(seed_robot, answer)
    middle = answer.backbone_at(0.5 * (shown.s[1:] + shown.s[:-1]))
    tangent = Rotation.from_quat(middle.orientation).as_matrix()[:, :, 0]
    expected = np.cross(answer.tip.position - middle.position, loads.tip_force) + loads.tip_moment
    along = np.einsum("gi,gi->g", expected, tangent)
    across = np.linalg.norm(expected - along[:, None] * tangent, axis=1)
    own = np.nanmax(shown.moments.bending)
    assert own > 0.05  # N m in the tubes, also where they need not hold anything together
    assert shown.moments.all_bending == pytest.approx(across, abs=2e-4 * own)
    assert shown.moments.all_twisting == pytest.approx(along, abs=2e-4 * own)
    force, moment = answer.base_wrench
    assert force == pytest.approx(loads.tip_force, abs=1e-9)
    assert shown.moments.all_twisting[0] == pytest.approx(moment[0], abs=1e-2 * own)  # half an interval beyond
    assert np.isnan(shown.moments.bending[-1]).tolist() == [True, False]


def test_the_moment_of_one_rod_is_that_of_a_cantilever():
    rod = Robot("rod", (Tube("rod", (Segment(0.1, 0.02, 0.015),)),))
    answer = EquilibriumSolver(rod, 1e-9).solve([0.0], [0.0], loads=Loads(tip_force=(0.0, 1e-3, 0.0)))
    shown = drawn(rod, answer)
    middle = 0.5 * (shown.s[1:] + shown.s[:-1])
    assert shown.moments.bending[:, 0] == pytest.approx(1e-3 * (0.1 - middle), abs=4e-7)


def test_all_of_the_shape_is_in_the_picture_and_nothing_shrinks_to_a_line():
    robot = load_robot(ROBOT)
    for loads in (None, Loads(tip_force=(0.0, 0.5, 0.0))):
        shown = drawn(robot, EquilibriumSolver(robot).solve([0.0, 0.0], [0.0935, 0.2085], loads=loads))
        scale = _scale(shown)
        points = 1e3 * np.concatenate([tube.position for tube in shown.tubes])
        assert (points > scale.low).all() and (points < scale.high).all()
        assert scale.size.min() >= 1.3 - 1e-9 and scale.size.max() == pytest.approx(5.6)


@pytest.mark.parametrize("ending", ["png", "html"])
def test_a_robot_all_in_its_guide(capsys, tmp_path, ending):
    words = ["--alpha", "0", "0", "--D", "0.1858", "0.3035"]
    assert cli.main(["plot", ROBOT, *words, "--output", str(tmp_path / f"in.{ending}")]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--output", "shape.pdf"], "ends in .png or .svg or .html"),
        (["--output", "nowhere/shape.png"], "its folder is not there"),
        ([], "--output"),
        (["--output", "a.png", "--tip-force", "1", "2"], "--tip-force"),
        (["--output", "a.png", "--point-force", "inner", "0.01", "0", "0", "1"], "behind the orifice"),
    ],
)
def test_bad_input_is_one_line(capsys, tmp_path, monkeypatch, words, said):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["plot", ROBOT, *COMMAND, *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and said in captured.err and len(captured.err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


def test_without_matplotlib_pages_are_drawn_and_pictures_refused_in_one_line(tmp_path):
    program = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from ctr_pvs.cli.main import main\n"
        "codes = [main(['plot', *sys.argv[1:], '--output', f]) for f in ('a.html', 'a.png')]\n"
        "print(codes)"
    )
    command = [sys.executable, "-c", program, ROBOT, *COMMAND]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert done.stdout.splitlines() == ["a.html", "[0, 2]"]
    assert done.stderr == "ctr-pvs: pictures need matplotlib (pip install 'ctr_pvs[plot]')\n"
