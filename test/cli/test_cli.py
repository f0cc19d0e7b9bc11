"""The command line: answers, exit codes, and one clear line for bad input."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Status
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.command import NO_STABLE_EQUILIBRIUM

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "renda2021.yaml")
THREE_TUBES = str(ROOT / "config" / "three_tubes.yaml")
REFERENCE = json.loads((ROOT / "test" / "data" / "reference_values.json").read_text())

KEYS = [
    "success", "status", "message", "tip", "backbone", "twist", "torque", "force", "force_interval", "stability_margin",
    "fidelity", "degrees_of_freedom", "error_estimate", "residual", "iterations", "energy", "potential", "loads",
    "base_wrench", "jacobian", "compliance", "force_interval_reversed", "warnings", "hints",
]  # fmt: skip
FIG4 = ["--D", "0.0935", "0.2085"]  # full overlap; a boundary sits on the orifice


def strict(text: str) -> dict:
    """`text` as JSON, without the NaN and Infinity that Python's reader would let pass."""

    def refuse(word):
        raise AssertionError(f"{word} is not JSON")

    return json.loads(text, parse_constant=refuse)


def solve(capsys, *words: str, code: int = 0) -> str:
    """Standard output of `ctr-pvs solve`, which must end with exit code `code` and complain of nothing."""
    assert cli.main(["solve", *words]) == code
    captured = capsys.readouterr()
    assert captured.err == ""
    return captured.out


# --- answers ----------------------------------------------------------------------------------------------------------


def test_the_json_answer_of_the_reference_case(capsys):
    words = [ROBOT, "--alpha", "0", "100", *FIG4, "--degrees", "--tolerance", "1e-8", "--json", "--poses", "20"]
    text = solve(capsys, *words)
    answer = strict(text)
    (row,) = [row for row in REFERENCE["fig4_full"]["rows"] if row["alpha2_deg"] == 100]
    assert list(answer) == KEYS
    assert (answer["success"], answer["status"]) == (True, "ok")
    assert math.dist(answer["tip"]["position"], row["tip_m"]) < 2e-8
    assert answer["torque"][1] == pytest.approx(row["torque2_Nm"], rel=1e-6)
    assert answer["error_estimate"] <= 1e-8
    assert len(text.splitlines()) == 1


def test_the_json_answer_is_the_solvers(capsys):
    D = [0.05, 0.1, 0.2]
    words = [THREE_TUBES, "--alpha", "0.5", "1", "2", "--D", *map(str, D), "--json", "--poses", "7"]
    answer = strict(solve(capsys, *words))
    equilibrium = EquilibriumSolver(load_robot(THREE_TUBES)).solve([0.5, 1.0, 2.0], D, start="cold")
    backbone = equilibrium.backbone(7)
    for pose, s, position, orientation in zip(
        answer["backbone"], backbone.s, backbone.position, backbone.orientation, strict=True
    ):
        assert list(pose) == ["s", "position", "orientation"]
        assert pose["s"] == s
        assert pose["position"] == position.tolist()
        assert pose["orientation"] == orientation.tolist()
    assert answer["tip"]["position"] == equilibrium.tip.position.tolist()
    assert answer["tip"]["orientation"] == equilibrium.tip.orientation.tolist()
    for key in ("torque", "force", "force_interval"):
        assert answer[key] == getattr(equilibrium, key).tolist()
    for key in ("message", "fidelity", "degrees_of_freedom", "error_estimate", "residual", "iterations", "energy"):
        assert answer[key] == getattr(equilibrium, key)
    assert answer["stability_margin"] == pytest.approx(equilibrium.stability_margin, rel=1e-12)


def test_twists_are_null_exactly_past_a_tubes_tip(capsys):
    twist = strict(solve(capsys, ROBOT, "--alpha", "0", "1", "--D", "0.1", "0.2", "--json", "--poses", "50"))["twist"]
    outer_ends = 0.1858 - 0.1
    assert len(twist["s"]) == len(twist["psi"]) == 50
    for s, (outer, inner) in zip(twist["s"], twist["psi"], strict=True):
        assert (outer is None) == (s > outer_ends)
        assert isinstance(inner, float)
    assert twist["psi"][-1][0] is None
    assert isinstance(twist["psi"][0][0], float)


def test_the_number_of_poses_has_a_default(capsys):
    answer = strict(solve(capsys, ROBOT, "--alpha", "0", "1", *FIG4, "--json"))
    assert len(answer["backbone"]) == len(answer["twist"]["s"]) == 51


@pytest.mark.parametrize(
    ("words", "alpha"),
    [
        (["--alpha", "-1e-3", "1"], [-1e-3, 1.0]),
        (["--alpha", "-1", "-2.5E-1"], [-1.0, -0.25]),
        (["--alpha", "-.5", "-5e-1"], [-0.5, -0.5]),
        (["--alpha=-1", "0"], [-1.0, 0.0]),
        (["--alpha=-1e-3", "-1e-3"], [-1e-3, -1e-3]),
        (["--alpha", "+1", "1e0"], [1.0, 1.0]),
        (["--alpha", "-60", "30", "--degrees"], [-math.pi / 3, math.pi / 6]),
    ],
)
def test_numbers_may_be_negative_and_have_exponents(capsys, words, alpha):
    answer = strict(solve(capsys, ROBOT, *words, "--D=1e-1", "200e-3", "--json"))
    equilibrium = EquilibriumSolver(load_robot(ROBOT)).solve(alpha, [0.1, 0.2], start="cold")
    np.testing.assert_allclose(answer["tip"]["position"], equilibrium.tip.position, rtol=0, atol=1e-12)


def test_the_text_answer_shows_tip_loads_and_the_limits_of_the_model(capsys):
    text = solve(capsys, ROBOT, "--alpha", "0", "100", "--D", "0.1", "0.2085", "--degrees")
    equilibrium = EquilibriumSolver(load_robot(ROBOT)).solve(np.radians([0.0, 100.0]), [0.1, 0.2085], start="cold")
    assert text.startswith("renda2021: ok: ")
    lines = text.splitlines()
    (tip,) = [line for line in lines if line.startswith("tip position")]
    assert tip.endswith(" mm")
    numbers = [float(number) for number in re.findall(r"-?\d+\.\d+", tip)]
    np.testing.assert_allclose(numbers, 1e3 * equilibrium.tip.position, atol=6e-5)
    (inner,) = [line.split() for line in lines if line.startswith("inner")]
    assert inner[1:3] == ["100.0000", "208.5000"]
    np.testing.assert_allclose(float(inner[3]), equilibrium.torque[1], atol=6e-7)
    np.testing.assert_allclose(float(inner[4]), equilibrium.force[1], atol=6e-5)
    assert len(inner) == 5
    assert "alpha [deg]  D [mm]  torque [N m]  force [N]" in re.sub(r"  +", "  ", text)
    assert "no friction and no clearance, and is quasi-static" in text
    assert "stability margin" in text


def test_the_text_answer_shows_the_interval_of_forces_at_a_kink(capsys):
    text = solve(capsys, ROBOT, "--alpha", "0", "100", *FIG4, "--degrees")
    (outer,) = [line.split() for line in text.splitlines() if line.startswith("outer")]
    assert outer[4:] == ["2.0081", "0.3853", "2.0081"]
    assert "interval" in text


def test_the_text_answer_is_in_radians_unless_asked(capsys):
    text = solve(capsys, ROBOT, "--alpha", "0", "1.5", "--D", "0.1", "0.2")
    assert "alpha [rad]" in text
    assert "1.500000" in text


def test_the_text_table_has_straight_columns_and_no_signed_zeros(capsys):
    text = solve(capsys, ROBOT, "--alpha", "-1e-9", "-1e-9", "--D", "0.1", "0.2")
    table = [line for line in text.splitlines() if line.startswith(("tube ", "outer", "inner"))]
    assert len(table) == 3
    assert len(set(map(len, table))) == 1
    assert re.search(r"-0\.0+(?!\d)", text) is None


# --- no answer --------------------------------------------------------------------------------------------------------

UNSTABLE = [ROBOT, "--alpha", "0", "200", *FIG4, "--degrees", "--fidelity", "torsionless"]  # untwisted: unstable


def test_without_equilibrium_the_json_says_no_and_leaves_the_rest_null(capsys):
    answer = strict(solve(capsys, *UNSTABLE, "--json", code=NO_STABLE_EQUILIBRIUM))
    assert list(answer) == KEYS
    assert (answer["success"], answer["status"]) == (False, "no_stable_equilibrium")
    assert answer["message"]
    unknown = set(KEYS) - {"success", "status", "message", "fidelity", "iterations", "warnings", "hints"}
    assert {key for key in KEYS if answer[key] is None} == unknown


def test_without_equilibrium_the_text_is_one_line_without_numbers_to_trust(capsys):
    text = solve(capsys, *UNSTABLE, code=NO_STABLE_EQUILIBRIUM)
    assert text.startswith("renda2021: no_stable_equilibrium: ")
    assert len(text.splitlines()) == 1


@pytest.mark.parametrize(
    ("status", "code"),
    [
        (Status.OK, 0),
        (Status.SNAP, 0),
        (Status.NO_STABLE_EQUILIBRIUM, 3),
        (Status.NOT_CONVERGED, 4),
        (Status.TOLERANCE_MISSED, 4),
        (Status.TIMEOUT, 4),
    ],
)
@pytest.mark.parametrize("output", [["--json"], []])
def test_exit_codes(capsys, monkeypatch, status, code, output):
    """Not every outcome can be had at will, so here the solver's answer has its status changed."""
    true_solve = EquilibriumSolver.solve

    def changed_solve(self, *arguments, **options):
        answer = true_solve(self, *arguments, **options)
        answer.status = status
        return answer

    monkeypatch.setattr(EquilibriumSolver, "solve", changed_solve)
    text = solve(capsys, ROBOT, "--alpha", "0", "1", *FIG4, *output, code=code)
    assert status.value in text
    if output:
        assert strict(text)["success"] == (code == 0)


def test_a_fault_of_the_solver_is_not_blamed_on_the_user(monkeypatch):
    def faulty_solve(self, *arguments, **options):
        raise np.linalg.LinAlgError("Singular matrix")

    monkeypatch.setattr(EquilibriumSolver, "solve", faulty_solve)
    with pytest.raises(np.linalg.LinAlgError):
        cli.main(["solve", ROBOT, "--alpha", "0", "1", *FIG4])


# --- bad input --------------------------------------------------------------------------------------------------------

ALPHA = ["--alpha", "0", "1"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], ["SUBCOMMAND"]),
        (["frobnicate"], ["frobnicate", "solve"]),
        (["solve"], ["ROBOT", "--alpha", "--D"]),
        (["solve", ROBOT, *ALPHA], ["--D"]),
        (["solve", ROBOT, *FIG4], ["--alpha"]),
        (["solve", ROBOT, "--alpha", *FIG4], ["--alpha", "at least one"]),
        (["solve", ROBOT, "--alpha", "0", "x", *FIG4], ["--alpha", "'x'", "finite number"]),
        (["solve", ROBOT, "--alpha", "0", "nan", *FIG4], ["--alpha", "'nan'", "finite number"]),
        (["solve", ROBOT, "--alpha", "0", "-inf", *FIG4], ["--alpha", "'-inf'", "finite number"]),
        (["solve", ROBOT, "--alpha", "0", "-nan", *FIG4], ["--alpha", "'-nan'", "finite number"]),
        (["solve", ROBOT, "--alpha", "0", "1e999", *FIG4], ["--alpha", "'1e999'", "finite number"]),
        (["solve", ROBOT, "--alpha", "0", "1e300", *FIG4], ["alpha[1]", "1000000 rad", "1e+300"]),
        (["solve", ROBOT, "--alpha", "0", "1e300", *FIG4, "--degrees"], ["alpha[1]", "1000000 rad"]),
        (["solve", ROBOT, "--alpha", "0", *FIG4], ["alpha", "2 real numbers", "[0.0]"]),
        (["solve", ROBOT, *ALPHA, "--D", "0", "0.1", "0.2"], ["D", "2 real numbers"]),
        (["solve", ROBOT, *ALPHA, "--D", "93.5", "208.5"], ["D[0]", "0.1858 m", "93.5"]),
        (["solve", ROBOT, *ALPHA, "--D", "-1e-3", "0.1"], ["D[0]", "0 <= D", "-0.001"]),
        (["solve", ROBOT, *ALPHA, "--D", "0.1", "0.05"], ["D[1]", "D >= 0.1 m", "0.05"]),
        (["solve", ROBOT, *ALPHA, "--D", "0.1", "1e308"], ["D[1]", "1e+308"]),
        (["solve", THREE_TUBES, "--alpha", "0", "0", "15", "--D", "0", "0.1", "0.2"], ["alpha[2]", "12.6", "15"]),
        (["solve", "missing.yaml", *ALPHA, *FIG4], ["missing.yaml", "No such file"]),
        (["solve", str(ROOT), *ALPHA, *FIG4], ["directory"]),
        (["solve", __file__, *ALPHA, *FIG4], [__file__, "YAML"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--tolerance", "0"], ["tolerance", "0"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--tolerance", "-1e-5"], ["tolerance", "-1e-05"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--tolerance", "1e-300"], ["tolerance", "1e-300"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--tolerance", "tight"], ["--tolerance", "'tight'"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--fidelity", "best"], ["--fidelity", "best", "torsion"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--start", "warm"], ["--start", "warm", "cold"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--force-model", "eq41"], ["--force-model", "eq41", "renda2021"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--poses", "1"], ["--poses", "'1'", "from 2"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--poses", "2.5"], ["--poses", "'2.5'", "whole number"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--poses", "1e9"], ["--poses", "'1e9'"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--deg"], ["--deg"]),
        (["solve", ROBOT, *ALPHA, *FIG4, "--colour\nred"], ["--colour red"]),
    ],
)
@pytest.mark.parametrize("output", [[], ["--json"]])
def test_bad_input_is_one_line_and_exit_code_2(capsys, words, said, output):
    assert cli.main([*words, *output] if words[:1] == ["solve"] else words) == cli.BAD_INPUT
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("ctr-pvs: ")
    assert len(captured.err.splitlines()) == 1
    missing = [word for word in said if word not in captured.err]
    assert not missing, captured.err


# --- the process ------------------------------------------------------------------------------------------------------


def run_module(*words: str) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "ctr_pvs", *words], cwd=ROOT, capture_output=True, text=True, timeout=60, check=False
    )


def test_the_module_runs_as_a_program():
    done = run_module("solve", ROBOT, "--alpha", "-1e-3", "1", *FIG4, "--json")
    assert (done.returncode, done.stderr) == (0, "")
    assert strict(done.stdout)["success"] is True


def test_bad_input_leaves_no_traceback():
    done = run_module("solve", ROBOT, "--alpha", "0", "1", "--D", "0.0935", "-inf")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "ctr-pvs: argument --D: expected a finite number, got '-inf' (see ctr-pvs solve --help)\n"


@pytest.mark.parametrize("words", [["--help"], ["solve", "--help"]])
def test_help_is_no_error(words):
    done = run_module(*words)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: ctr-pvs")
