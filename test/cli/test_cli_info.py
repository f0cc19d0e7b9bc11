"""ctr-pvs info: the sheet of a robot and its picture."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.robots.picture import at_rest
from ctr_pvs.cli.robots.sheet import sheet
from ctr_pvs.cli.robots.sheet_text import sheet_as_text
from ctr_pvs.oracles.two_tubes import two_tube_parameters

ROOT = Path(__file__).parents[2]


def info(capsys, *words, code=0):
    assert cli.main(["info", *words]) == code
    return capsys.readouterr()


def test_the_json_of_the_seeds_robot(capsys):
    found = json.loads(info(capsys, "renda2021", "--json").out)
    assert list(found) == ["robot", "tubes", "clearances", "pairs", "limits", "warnings"]
    outer, inner = found["tubes"]
    assert (outer["name"], outer["length"], outer["outer_diameter"]) == ("outer", pytest.approx(0.1858), 2.39e-3)
    assert outer["largest_strain"] == pytest.approx(9.9 * 2.39e-3 / 2)
    assert [segment["curvature_at_tip"] for segment in inner["segments"]] == [[0.0, 0.0], [13.8, 0.0]]
    assert found["clearances"] == [{"outer": "outer", "inner": "inner", "diametral": pytest.approx(0.41e-3)}]
    assert found["limits"][1] == {"name": "inner", "alpha": None, "D": [0.0, pytest.approx(0.3035)]}
    assert found["warnings"] == []


def test_a_pair_has_the_lambda_of_its_closed_form(capsys):
    (pair,) = json.loads(info(capsys, "renda2021", "--json").out)["pairs"]
    assert pair["D"] == [0.0935, 0.2185]
    two = two_tube_parameters(load_robot("renda2021"), pair["D"])
    assert (pair["lambda"], pair["b"], pair["snap_free"]) == (two.lam, two.b, False)
    assert pair["lambda"] > pair["critical_lambda"]


def test_pairs_without_a_closed_form_are_told_by_their_folds():
    pairs = sheet(load_robot("three_tubes"))["pairs"]
    assert [(pair["lambda"], pair["snap_free"]) for pair in pairs] == [(None, True)] * 3
    stiff = (0.02, 0.015)
    strong = [Tube(name, (Segment(0.3, *stiff, (25.0, 10.0)),)) for name in ("a", "b")]
    (pair,) = sheet(Robot("r", tuple(strong)))["pairs"]
    assert (pair["lambda"], pair["snap_free"]) == (None, False)


def test_what_is_not_known_is_null_in_json_and_said_in_text():
    tubes = (Tube("a", (Segment(0.1, 0.02, 0.015),)), Tube("b", (Segment(0.2, 0.01, 0.008, (8.0,)),)))
    found = sheet(Robot("r", tubes))
    assert found["clearances"][0]["diametral"] is None
    assert found["tubes"][1]["largest_strain"] is None
    (pair,) = found["pairs"]
    assert (pair["D"], pair["lambda"], pair["snap_free"]) == (None, None, True)  # a straight tube pulls nothing around
    text = sheet_as_text(found)
    assert "not known, for want of diameters" in text
    assert "never snaps" in text


def test_the_text_has_every_tube_segment_pair_and_limit(capsys):
    text = info(capsys, "three_tubes").out
    lines = text.splitlines()
    assert lines[0] == "three_tubes: 3 tubes, outermost first"
    (middle,) = [line.split() for line in lines if line.startswith("middle 2")]
    assert middle == ["middle", "2", "140", "180", "0.0206", "0.0222", "1.078", "0", "6", "0"]
    (limits,) = [line for line in lines if line.startswith("inner ") and "12.6" in line]
    assert limits.split()[1:] == ["-12.6", "..", "12.6", "20", "..", "300"]
    assert sum("never snaps" in line for line in lines) == 3
    assert "Clearance of inner in middle: 0.3 mm" in text


def test_warnings_are_on_the_sheet(capsys, tmp_path):
    path = tmp_path / "odd.yaml"
    path.write_text((ROOT / "config" / "renda2021.yaml").read_text(encoding="utf-8").replace("[13.8]", "[588]"))
    captured = info(capsys, str(path))
    assert "Warning: tube 'inner': segment 2: its pre-curvature 588 1/m" in captured.out
    assert captured.err.startswith("ctr-pvs: warning: ")


def test_the_picture_is_drawn_only_when_asked_for(capsys, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / "tubes.png"
    assert str(path) in info(capsys, "three_tubes", "--output", str(path)).out
    assert path.read_bytes().startswith(b"\x89PNG")
    program = "import sys; from ctr_pvs.cli.main import main; main(['info', 'renda2021']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=60)
    assert not {"matplotlib", "ctr_pvs.solve.solver"} & set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize("name", ["no/such/folder.png", "tubes.nonsense"])
def test_a_picture_that_cannot_be_written_is_named(capsys, tmp_path, name):
    pytest.importorskip("matplotlib")
    captured = info(capsys, "renda2021", "--output", str(tmp_path / name), code=cli.BAD_INPUT)
    assert captured.err.startswith("ctr-pvs: --output: cannot write ")
    assert len(captured.err.splitlines()) == 1


def test_a_tube_at_rest_is_an_arc_of_its_radius_towards_minus_z():
    tube = Tube("a", (Segment(0.1, 0.02, 0.015), Segment(0.1, 0.02, 0.015, (10.0,))))
    tip = at_rest(tube)[-1]
    np.testing.assert_allclose(tip, [0.1 + 0.1 * np.sin(1.0), 0.0, -0.1 * (1.0 - np.cos(1.0))], atol=1e-7)
