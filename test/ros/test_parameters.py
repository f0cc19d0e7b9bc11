"""What the parameters change, seen from outside."""

import dataclasses

import pytest
import yaml
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64MultiArray

from ctr_pvs.solve import solver
from ctr_pvs_ros.parameters import PARAMETERS
from ctr_pvs_ros.parameters import Settings
from ctr_pvs_ros.process import NodeProcess
from ctr_pvs_ros.process import share_file

JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
GOOD = dict(zip(JOINTS, (0.0, 0.0935, 0.5, 0.2085), strict=True))
TIMEOUT = 5.0


def other_value(default):
    """A value of the same type that is not the default one."""
    match default:
        case bool():
            return not default
        case float():
            return default / 2.0
        case int():
            return -default
        case str():
            return f"{default}x"
    return [0.0, 0.5, 0.0935, 0.2085]


def test_levels_and_force_models_are_those_of_the_solver():
    assert PARAMETERS["fidelity"].choices == solver.FIDELITIES
    assert PARAMETERS["force_model"].choices == solver.FORCE_MODELS


@pytest.fixture(scope="module")
def lenient(start_node):
    return start_node(
        "/lenient",
        merge_partial="true",
        clamp_to_limits="true",
        accept_nameless="true",
        publish_backbone_s="true",
        backbone_poses="5",
        command_timeout="1.5",
        initial_command="[0.0, 0.5, 0.0935, 0.2085]",
    )


@pytest.fixture(scope="module")
def strict(start_node):
    return start_node("/strict", margin_stop="0.6", margin_warn="0.995")


def test_nothing_is_published_before_the_first_command(strict):
    tips = strict.subscribe(PoseStamped, "setpoint_cp")
    status, values = strict.diagnostics()
    assert tips == []
    assert status.message == "waiting for the first command"
    assert values["commands accepted"] == "0"


def test_the_initial_command_is_answered(lenient):
    positions = lenient.subscribe(JointState, "setpoint_js")
    lenient.wait(lambda: bool(positions), "initial answer")
    assert positions[0].position.tolist() == list(GOOD.values())


def test_arc_lengths_come_beside_the_backbone(lenient):
    arrays = lenient.subscribe(Float64MultiArray, "backbone_s")
    lenient.wait(lambda: bool(arrays), "arc lengths")
    assert arrays[0].data.tolist() == pytest.approx([0.0, 0.02375, 0.0475, 0.07125, 0.095])


def test_a_partial_command_is_merged_with_the_last_one(lenient):
    lenient.client.command(GOOD, TIMEOUT)
    reply = lenient.client.command({"inner_rotation": 0.7}, TIMEOUT)
    assert reply.joints.position.tolist() == [0.0, 0.0935, 0.7, 0.2085]
    assert len(reply.backbone.poses) == 5


def test_a_command_out_of_limits_is_clamped_and_reported(lenient):
    reply = lenient.client.command({**GOOD, "inner_translation": 0.5}, TIMEOUT)
    assert reply.joints.position.tolist() == [0.0, 0.0935, 0.5, 0.3035]
    status, values = lenient.diagnostics()
    assert status.level == DiagnosticStatus.WARN
    assert "inner_translation moved from 0.5 to 0.3035 m" in values["last clamping"]


def test_a_nameless_command_is_taken_in_order(lenient):
    positions = lenient.subscribe(JointState, "setpoint_js")
    lenient.wait(lambda: bool(positions), "last answer")
    positions.clear()
    lenient.send(JointState(position=[0.1, 0.09, 0.2, 0.2]))
    lenient.wait(lambda: bool(positions), "answer")
    assert positions[0].position.tolist() == [0.1, 0.09, 0.2, 0.2]


def test_a_command_that_stays_away_is_stale(lenient):
    lenient.client.command(GOOD, TIMEOUT)
    status, _ = lenient.diagnostics(lambda values: float(values["time without a command [s]"]) > 1.5)
    assert status.level == DiagnosticStatus.STALE
    assert "command_timeout" in status.message


def test_an_answer_near_a_fold_is_withheld(strict):
    full_overlap = {**GOOD, "inner_rotation": 4.5379}  # 260 deg, margin 0.99
    before = strict.client.command(full_overlap, TIMEOUT)
    status, _ = strict.diagnostics(lambda values: values["answers published"] == "1")
    assert status.level == DiagnosticStatus.WARN
    assert "margin_warn" in status.message
    tips = strict.subscribe(PoseStamped, "setpoint_cp")
    strict.wait(lambda: bool(tips), "last answer")
    strict.send(JointState(name=JOINTS, position=[0.0, 0.0935, 4.8869, 0.2085]))  # 280 deg, margin 0.45
    status, values = strict.diagnostics(lambda values: values["commands accepted"] == "2")
    assert status.level == DiagnosticStatus.ERROR
    assert "margin_stop" in status.message
    assert values["answers published"] == "1"
    assert tips == [before.tip]


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("backbone_poses", 1, "out of range"),
        ("compute_budget", float("nan"), "out of range"),
        ("compute_budget", 1, "type"),
        ("on_snap", "jump", "follow, hold, stop"),
        ("margin_stop", 0.999, "margin_warn"),
        ("rotation_limits", [0.0, 1.0], "2 tubes"),
        ("rotation_limits", [0.0, 1.0, 1.0, 0.0], "limits.alpha.inner"),
        ("translation_limits", [0.0, float("inf"), 0.0, 1.0], "finite"),
        ("translation_limits", "none", "array of numbers"),
        ("translation_limits", [True, False], "array of numbers"),
        ("translation_limits", ["0", "1"], "array of numbers"),
        ("translation_limits", 1.0, "array of numbers"),
        *((name, other_value(rule.default), "read-only") for name, rule in PARAMETERS.items() if rule.read_only),
    ],
)
def test_a_wrong_value_is_refused_with_the_reason(strict, name, value, words):
    result = strict.set_parameter(name, value)
    assert not result.successful
    assert words in result.reason


def test_a_right_value_takes_effect(strict):
    assert strict.set_parameter("backbone_poses", 3).successful
    assert len(strict.client.command(GOOD, TIMEOUT).backbone.poses) == 3


def test_limits_may_be_narrowed_while_running(strict):
    assert strict.set_parameter("rotation_limits", [-1.0, 1.0, -0.4, 0.4]).successful
    _, counts = strict.diagnostics()
    strict.send(JointState(name=JOINTS, position=list(GOOD.values())))
    _, values = strict.diagnostics(lambda values: values["commands rejected"] != counts["commands rejected"])
    assert values["last rejection"].startswith("out_of_limits: inner_rotation: ")
    assert "the parameter rotation_limits" in values["last rejection"]
    assert strict.set_parameter("rotation_limits", [-7.0, 7.0, -7.0, 7.0]).successful
    assert strict.client.command(GOOD, TIMEOUT).joints.position[2] == GOOD["inner_rotation"]


def test_limits_may_be_whole_numbers_and_taken_back(strict):
    assert strict.set_parameter("rotation_limits", [-1, 1, 0, 1]).successful
    assert strict.get_parameter("rotation_limits") == [-1, 1, 0, 1]
    strict.send(JointState(name=JOINTS, position=[0.0, 0.0935, -0.5, 0.2085]))
    strict.diagnostics(lambda values: "inner_rotation: expected 0 <= alpha <= 1 rad" in values["last rejection"])
    assert strict.set_parameter("rotation_limits", []).successful
    assert strict.client.command({**GOOD, "inner_rotation": -0.5}, TIMEOUT).joints.position[2] == -0.5


def test_every_parameter_has_a_value_also_the_empty_ones(strict, lenient):
    """One without a value empties the whole of `ros2 param dump`."""
    for peer in (strict, lenient):
        for name in PARAMETERS:
            assert peer.get_parameter(name) is not None, name


def test_every_parameter_is_described(strict):
    future = strict.describe_parameters(list(PARAMETERS))
    for descriptor, (name, rule) in zip(future, PARAMETERS.items(), strict=True):
        assert descriptor.name == name
        assert descriptor.description
        assert descriptor.read_only == rule.read_only
        ranges = [*descriptor.integer_range, *descriptor.floating_point_range]
        assert [(bounds.from_value, bounds.to_value) for bounds in ranges] == [rule.bounds] * (rule.bounds is not None)


def test_nodes_in_two_namespaces_do_not_hear_each_other(strict, lenient):
    first = strict.client.command(GOOD, TIMEOUT)
    second = lenient.client.command({**GOOD, "inner_rotation": -0.5}, TIMEOUT)
    assert first.tip.pose.position.y == pytest.approx(-second.tip.pose.position.y, abs=1e-7)
    again = strict.subscribe(PoseStamped, "setpoint_cp")
    strict.wait(lambda: bool(again), "last answer")
    assert again == [first.tip]


def test_the_table_and_the_settings_have_the_same_names():
    assert list(PARAMETERS) == [field.name for field in dataclasses.fields(Settings)]


def test_whole_numbers_and_none_at_all_are_taken_at_start_up(start_node):
    peer = start_node("/whole_numbers", initial_command="[0, 1, 0, 0]", rotation_limits="[]", tolerance="1e-6")
    positions = peer.subscribe(JointState, "setpoint_js")
    peer.wait(lambda: bool(positions), "initial answer")
    assert positions[0].position.tolist() == [0.0, 0.0, 1.0, 0.0]
    assert peer.get_parameter("rotation_limits") == []
    assert peer.get_parameter("tolerance") == 1e-6


def test_unknown_parameters_are_warned_of(start_node):
    peer = start_node("/misspelt", tolerence="1e-9")
    told = "no such parameters, passed over: tolerence"
    peer.wait(lambda: told in peer.log.read_text(encoding="utf-8"), "warning")


@pytest.fixture
def refused(graph, tmp_path):
    """Start a node that does not start; its exit code and what it says."""

    def refused(content, **parameters):
        file, log = tmp_path / "parameters.yaml", tmp_path / "log.txt"
        file.write_text(yaml.safe_dump({"/**": {"ros__parameters": content}}), encoding="utf-8")
        with log.open("wb") as output:
            process = NodeProcess(share_file("config", "renda2021.yaml"), parameters, log=output, parameter_file=file)
        with process:
            code = process.wait(20.0)
        return code, log.read_text(encoding="utf-8")

    return refused


@pytest.mark.parametrize(
    ("in_file", "name", "given"),
    [
        ({}, "tolerance", "abc"),
        ({"tolerance": 1e-4}, "tolerance", "abc"),
        ({"backbone_poses": 5}, "backbone_poses", "7.5"),
        ({"publish_tf": True}, "publish_tf", "3"),
        ({"rotation_limits": [-1, 1, -1, 1]}, "rotation_limits", "[-1.5, 1.5, -2.5, 2.5]"),
        ({"rotation_limits": [-1.0, 1.0, -1.0, 1.0]}, "rotation_limits", "[a, b]"),
    ],
)
def test_what_the_command_line_says_is_never_passed_over(refused, in_file, name, given):
    code, log = refused(in_file, **{name: given})
    assert code == 2
    assert name in log and "not started" in log and "Traceback" not in log


def test_a_parameter_file_may_be_overruled(start_node):
    """With values of the same type."""
    peer = start_node("/overruled", use_sim_time="false", margin_warn="0.2")
    assert peer.get_parameter("margin_warn") == 0.2
