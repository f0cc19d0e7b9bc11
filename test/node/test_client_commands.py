"""ctr_client without ROS: what its words mean, which of them are refused, and what it prints."""

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ctr_pvs.cli.words import UsageError
from ctr_pvs_ros.client import texts as client_texts
from ctr_pvs_ros.client.words import parse

ROOT = Path(__file__).parents[2]
STATUS_FILE = ROOT / "ctr_pvs_interfaces" / "msg" / "EquilibriumStatus.msg"
RESPONSE_FILE = ROOT / "ctr_pvs_interfaces" / "srv" / "SolveEquilibrium.srv"
SEARCH_FILE = ROOT / "ctr_pvs_interfaces" / "srv" / "SolveInverse.srv"
SOLUTION_FILE = ROOT / "ctr_pvs_interfaces" / "msg" / "InverseSolution.msg"
NAN = math.nan


def xyz(x=0.0, y=0.0, z=0.0):
    return SimpleNamespace(x=x, y=y, z=z)


def header():
    return SimpleNamespace(stamp=SimpleNamespace(sec=12, nanosec=345_678_901), frame_id="ctr_base")


def tip():
    pose = SimpleNamespace(position=xyz(0.080948, 0.01457, -0.038895), orientation=SimpleNamespace(x=0, y=0, z=0, w=1))
    return SimpleNamespace(header=header(), pose=pose)


def status(**fields):
    """One like that of an answered command."""
    usual = {
        "header": header(),
        "trigger": 1,
        "outcome": 0,
        "reason": "ok",
        "message": "stable equilibrium",
        "hint": "",
        "stability_margin": 0.75,
        "snap_reserve": 0.5,
        "error_estimate": 1e-7,
        "solve_time": 0.00125,
        "fidelity": "torsion",
        "degrees_of_freedom": 12,
        "applied_wrench": SimpleNamespace(force=xyz(), torque=xyz()),
        "tip_distance": NAN,
    }
    return SimpleNamespace(**{**usual, **fields})


def refused():
    nothing = dict.fromkeys(("stability_margin", "snap_reserve", "error_estimate", "solve_time"), NAN)
    rest = {"fidelity": "", "degrees_of_freedom": 0}
    return status(outcome=1, reason="missing_joint", message="missing joints: 'a'", **nothing, **rest)


def joints():
    return SimpleNamespace(name=["a_rotation", "a_translation"], position=[math.pi / 2, 0.05], effort=[0.25, -1.5])


# --- words ------------------------------------------------------------------------------------------------------------


def test_joints_keep_their_order_and_may_be_named_twice_which_is_the_nodes_to_judge():
    arguments = parse(["send", "b=2", "a=-1e-3", "b=3"])
    assert arguments.joints == [("b", 2.0), ("a", -0.001), ("b", 3.0)]
    assert (arguments.namespace, arguments.node, arguments.wait) == ("", "ctr_equilibrium", 10.0)


def test_options_may_stand_between_joints():
    arguments = parse(["solve", "a=1", "--force", "0", "-1e-3", "2", "b=2", "--namespace", "/left/", "c=3", "--warm"])
    assert arguments.joints == [("a", 1.0), ("b", 2.0), ("c", 3.0)]
    assert arguments.force == [0.0, -0.001, 2.0]
    assert arguments.moment == [0.0, 0.0, 0.0]
    assert arguments.namespace == "left"
    assert arguments.warm


def test_a_place_may_have_a_direction_a_start_and_defaults_of_the_service():
    arguments = parse(["inverse", "a=1", "--position", "0.1", "-2e-3", "0", "b=2"])
    assert (arguments.position, arguments.goal, arguments.orientation) == ([0.1, -0.002, 0.0], "position", None)
    assert arguments.joints == [("a", 1.0), ("b", 2.0)]
    defaults = dict(re.findall(r"^\w+ (\w+) (\S+)$", SEARCH_FILE.read_text(encoding="utf-8"), re.MULTILINE))
    for name in ("within", "within_angle", "margin_floor"):
        assert getattr(arguments, name) == float(defaults[name])
    assert (arguments.all, arguments.time_limit) == (False, 0.0)
    place = ["inverse", "--position", "0", "0", "0"]
    assert parse(place).joints == []
    turned = parse([*place, "--orientation", "0", "0", "0.6", "0.8"])
    assert (turned.goal, turned.orientation) == ("orientation", [0.0, 0.0, 0.6, 0.8])


@pytest.mark.parametrize(
    "direction", [(0.0, 0.0, 3.0), (-1.0, 1e-3, 0.0), (0.2, -0.5, 0.1), (1.0, 0.0, 0.0), (-2.0, 0.0, 0.0)]
)
def test_a_direction_becomes_an_orientation_whose_x_axis_it_is(direction):
    words = [str(part) for part in direction]
    arguments = parse(["inverse", "--position", "0", "0", "0", "--tangent", *words])
    assert arguments.goal == "tangent"
    turned = Rotation.from_quat(arguments.orientation).apply([1.0, 0.0, 0.0])
    assert turned == pytest.approx(np.array(direction) / np.linalg.norm(direction), abs=1e-12)


@pytest.mark.parametrize("command", ["send", "solve"])
def test_degrees_are_for_rotations_only(command):
    arguments = parse([command, "--degrees", "a_rotation=180", "a_translation=0.1", "rotation=90"])
    assert arguments.joints == [("a_rotation", math.pi), ("a_translation", 0.1), ("rotation", 90.0)]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["send", "foo"], "expected JOINT=POSITION, such as inner_rotation=1.0, got 'foo'"),
        (["send", "=1"], "expected JOINT=POSITION"),
        (["send", "a=b=c"], "a: expected a finite number, got 'b=c'"),
        (["send", "a="], "a: expected a finite number, got ''"),
        (["send", "a=nan"], "a: expected a finite number, got 'nan'"),
        (["send"], "required: JOINT=POSITION"),
        (["send", "a=1", "--wait", "soon"], "--wait: expected a finite number"),
        (["send", "a=1", "--warm"], "unrecognized arguments: --warm"),
        (["solve", "a=1", "--force", "0", "1"], "--force: expected 3 arguments"),
        (["inverse", "a=1"], "required: --position"),
        (["inverse", "--position", "0", "0"], "--position: expected 3 arguments"),
        (
            ["inverse", "--position", "0", "0", "0", "--tangent", "1", "0", "0", "--orientation", "0", "0", "0", "1"],
            "not allowed with",
        ),
        (["inverse", "--position", "0", "0", "0", "--tangent", "0", "0", "0"], "--tangent: expected a direction"),
        (["watch", "--count", "0"], "--count: expected a whole number from 1"),
        (["watch", "a=1"], "unrecognized arguments: a=1"),
        (["stop"], "invalid choice: 'stop'"),
        ([], "required: SUBCOMMAND"),
    ],
)
def test_words_that_cannot_be_meant_are_told_of_in_one_line(words, told):
    with pytest.raises(UsageError) as error:
        parse(words)
    assert told in str(error.value)
    assert "--help" in str(error.value)
    assert "\n" not in str(error.value)


def test_help_tells_the_exit_codes(capsys):
    for words in (["--help"], ["send", "--help"], ["watch", "--help"], ["solve", "--help"], ["inverse", "--help"]):
        with pytest.raises(SystemExit) as end:
            parse(words)
        assert end.value.code == 0
        assert "Exit codes: 0 answered, 1 refused" in capsys.readouterr().out


# --- what is printed --------------------------------------------------------------------------------------------------


def test_outcomes_and_triggers_are_those_of_the_message():
    numbers = dict(re.findall(r"^uint8 ([A-Z]+) = (\d)", STATUS_FILE.read_text(encoding="utf-8"), re.MULTILINE))
    ours = [*enumerate(client_texts.OUTCOMES), *client_texts.TRIGGERS.items()]
    assert numbers == {name.upper(): str(number) for number, name in ours}


@pytest.mark.parametrize(
    ("names", "file"),
    [
        ("OF_STATUS", STATUS_FILE),
        ("OF_RESPONSE", RESPONSE_FILE),
        ("OF_SEARCH", SEARCH_FILE),
        ("OF_SOLUTION", SOLUTION_FILE),
    ],
)
def test_json_has_every_field_of_the_message_that_needs_no_form_of_its_own(names, file):
    fields = re.findall(r"^\w+(?:\[\])? (\w+)$", file.read_text(encoding="utf-8").rpartition("---")[2], re.MULTILINE)
    own = {"trigger", "outcome", "backbone_s", "solution", "others", "way"}
    assert set(getattr(client_texts, names)) == set(fields) - own


def test_a_status_as_text():
    assert client_texts.status_as_text(status(hint="look here"), tip(), joints(), degrees=True).splitlines() == [
        "accepted        ok: stable equilibrium",
        "hint            look here",
        "margin          0.7500 (1 far from a snap, 0 at it)",
        "snap reserve    0.5000 (1 relaxed, 0 at a snap)",
        "error estimate  1.0e-07 m, of the tip",
        "solve time      1.25 ms, torsion with 12 unknowns",
        "tip               80.948   14.570  -38.895 mm in ctr_base",
        "a_rotation          90.000 deg      0.2500 N m",
        "a_translation     0.050000 m       -1.5000 N",
    ]
    assert "1.570796 rad" in client_texts.status_as_text(status(), tip(), joints())


def test_a_load_is_told_where_there_is_one():
    loaded = status(applied_wrench=SimpleNamespace(force=xyz(z=0.5), torque=xyz(x=-0.01)))
    assert re.search(r"^load +0 0 0.5 N, -0.01 0 0 N m$", client_texts.status_as_text(loaded, None, None), re.MULTILINE)
    assert "load" not in client_texts.status_as_text(status(), None, None)


def test_a_refusal_as_text_is_its_reason_and_nothing_that_is_not_known():
    assert client_texts.status_as_text(refused(), None, None) == "refused  missing_joint: missing joints: 'a'"
    late = status(outcome=2, reason="timeout", message="timeout: out of time", stability_margin=NAN)
    assert client_texts.status_as_text(late, None, None).splitlines()[0].split(maxsplit=1)[1] == "timeout: out of time"


def test_statuses_as_lines():
    line = client_texts.status_as_line
    numbers = "margin 0.7500 reserve 0.5000 tip   80.948   14.570  -38.895 mm"
    assert line(status(), tip()) == f"12.345 accepted ok             {numbers}"
    assert line(status(hint="look"), tip()) == f"12.345 accepted ok             {numbers}  look"
    assert line(refused(), None) == "12.345 refused  missing_joint  missing joints: 'a'"
    snap = status(outcome=3, reason="snap", message="snapped", snap_reserve=NAN)
    assert line(snap, None) == "12.345 snap     snap           margin 0.7500 reserve unknown tip not heard  snapped"


def test_a_status_as_json():
    told = json.loads(client_texts.status_as_json(status(trigger=3), tip(), joints()))
    assert told["stamp"] == {"sec": 12, "nanosec": 345_678_901}
    assert (told["outcome"], told["trigger"], told["reason"]) == ("accepted", ["command", "wrench"], "ok")
    assert (told["stability_margin"], told["tip_distance"]) == (0.75, None)
    assert told["tip"] == {"position": [0.080948, 0.01457, -0.038895], "orientation": [0, 0, 0, 1]}
    assert told["joints"] == vars(joints())
    told = json.loads(client_texts.status_as_json(refused(), None))
    assert (told["outcome"], told["tip"], told["solve_time"]) == ("refused", None, None)
    assert "joints" not in told


def response(**fields):
    usual = dict.fromkeys(client_texts.OF_RESPONSE, 0.0)
    ours = {
        "success": True,
        "status": "ok",
        "message": "stable equilibrium",
        "tip": tip(),
        "backbone": SimpleNamespace(poses=[tip().pose]),
        "backbone_s": [0.095],
        "torque": [-0.25, 0.25],
        "force": [2.0, -0.5],
        "force_lower": [0.5, -0.5],
        "force_upper": [2.0, -0.5],
        "fidelity": "torsion",
        "degrees_of_freedom": 12,
        "solve_time": 0.001,
    }
    return SimpleNamespace(**{**usual, **ours, **fields})


def test_a_response_as_text():
    lines = client_texts.response_as_text(response()).splitlines()
    assert lines[0] == "ok              stable equilibrium"
    assert lines[-3:] == [
        "tip               80.948   14.570  -38.895 mm in ctr_base",
        "tube 1 of 2        -0.2500 N m     2.0000 N, from 0.5000 to 2.0000 N",
        "tube 2 of 2         0.2500 N m    -0.5000 N",
    ]
    bad = response(success=False, status="bad_input", message="no")
    assert client_texts.response_as_text(bad) == "bad_input  no"


def test_a_response_as_json():
    told = json.loads(client_texts.response_as_json(response(energy=NAN)))
    assert (told["status"], told["force_upper"], told["energy"]) == ("ok", [2.0, -0.5], None)
    assert told["backbone"] == {"s": [0.095], "position": [told["tip"]["position"]], "orientation": [[0, 0, 0, 1]]}
    assert json.loads(client_texts.response_as_json(response(success=False)))["tip"] is None


def solution(**fields):
    usual = {
        "command": joints(),
        "tip": tip(),
        "distance": 2e-7,
        "angle": 0.0,
        "stability_margin": 0.75,
        "way": [0.0, 0.1, 1.0, 0.06, math.pi / 2, 0.05],
        "way_stability_margin": [1.0, 0.5, 0.75],
    }
    return SimpleNamespace(**{**usual, **fields})


def search(**fields):
    usual = {"success": True, "status": "reached", "message": "there", "iterations": 9, "solve_time": 0.0125}
    return SimpleNamespace(**{**usual, "solution": solution(), "others": [], **fields})


def nothing_found():
    nowhere = SimpleNamespace(name=[], position=[], effort=[])
    return search(success=False, status="bad_input", message="no", solution=solution(command=nowhere))


def test_a_search_as_text():
    assert client_texts.search_as_text(search(), degrees=True).splitlines() == [
        "reached        there",
        "solve time     12.50 ms, 9 steps tried",
        "margin         0.7500 (1 far from a snap, 0 at it)",
        "tip              80.948   14.570  -38.895 mm in ctr_base",
        "a_rotation         90.000 deg      0.2500 N m",
        "a_translation    0.050000 m       -1.5000 N",
        "way            3 commands, least margin 0.5000 (--json: all)",
    ]
    several = client_texts.search_as_text(search(others=[solution(way=[], way_stability_margin=[])]))
    assert re.findall(r"^(?:solution|way) +(.*)$", several, re.MULTILINE) == [
        "1 of 2",
        "3 commands, least margin 0.5000 (--json: all)",
        "2 of 2",
        "none known",
    ]
    assert client_texts.search_as_text(nothing_found()) == "bad_input  no"


def test_a_search_as_json():
    told = json.loads(client_texts.search_as_json(search(others=[solution(distance=NAN)])))
    assert (told["status"], told["success"], told["iterations"]) == ("reached", True, 9)
    first, second = told["solutions"]
    assert first["way"] == [[0.0, 0.1], [1.0, 0.06], [math.pi / 2, 0.05]]
    assert first["way_stability_margin"] == [1.0, 0.5, 0.75]
    assert first["joints"] == vars(joints()) and first["tip"]["orientation"] == [0, 0, 0, 1]
    assert second["distance"] is None
    assert json.loads(client_texts.search_as_json(nothing_found()))["solutions"] == []
