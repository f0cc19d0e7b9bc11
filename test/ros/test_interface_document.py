"""docs/ros_interface.md says what a running node does: names, types, QoS, parameters, keys, codes, nothing left out."""

import importlib.util
import re
from pathlib import Path

import pytest
from rclpy.qos import DurabilityPolicy
from rclpy.qos import ReliabilityPolicy

from ctr_pvs import InverseStatus
from ctr_pvs import Status
from ctr_pvs_ros.inputs.commands import Reason
from ctr_pvs_ros.inputs.poses import PoseReason
from ctr_pvs_ros.inputs.wrenches import WrenchReason
from ctr_pvs_ros.outputs.outcomes import INTERNAL_ERROR
from ctr_pvs_ros.parameters import PARAMETERS
from ctr_pvs_ros.service.jobs import BAD_INPUT
from ctr_pvs_ros.stream import MARGIN_STOP
from ctr_pvs_ros.stream import SNAP_HELD

DOCUMENT = Path(__file__).parents[2] / "docs" / "ros_interface.md"
JOINTS = ["outer_rotation", "outer_translation", "inner_rotation", "inner_translation"]
GOOD = dict(zip(JOINTS, (0.0, 0.0935, 0.5, 0.2085), strict=True))
ROS_OWN = {"/rosout", "/parameter_events", "/clock"}
PARAMETER_SERVICE = re.compile(r"/(describe|get|list|set)_parameter|/get_type_description")


@pytest.fixture(scope="module")
def peer(start_node):
    peer = start_node(
        "/documented", publish_backbone_s="true", publish_jacobian="true", publish_tf="true", use_external_wrench="true"
    )
    peer.wait(
        lambda: ("ctr_equilibrium", "/documented") in peer.ros.get_node_names_and_namespaces(), "name of the node"
    )
    peer.client.command(GOOD, 5.0)
    return peer


def table(header):
    """The rows under a header line, as lists of cells."""
    lines = DOCUMENT.read_text(encoding="utf-8").splitlines()
    begin = next(index for index, line in enumerate(lines) if line.startswith(f"| {header} |"))
    rows = []
    for line in lines[begin + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.strip("|").split("|")])
    return rows


def code(cell):
    """What stands between backquotes."""
    return re.findall(r"`([^`]+)`", cell)


def full_name(peer, name):
    """A documented name as the graph has it."""
    return name.replace("~", f"{peer.namespace}/ctr_equilibrium") if name[0] in "~/" else f"{peer.namespace}/{name}"


def topics():
    """The rows on topics; without TF where its package is not installed."""
    return [row for row in table("topic") if "tf2_msgs" not in row[1] or importlib.util.find_spec("tf2_msgs")]


def test_topics_and_their_types(peer):
    told = {full_name(peer, code(row[0])[0]): (code(row[1])[0], "(in)" in row[0]) for row in topics()}
    for get, incoming in (
        (peer.ros.get_publisher_names_and_types_by_node, False),
        (peer.ros.get_subscriber_names_and_types_by_node, True),
    ):
        there = {name: types[0] for name, types in get("ctr_equilibrium", peer.namespace) if name not in ROS_OWN}
        assert there == {name: kind for name, (kind, into) in told.items() if into is incoming}


def test_the_qos_of_topics(peer):
    for row in topics():
        name = full_name(peer, code(row[0])[0])
        find = peer.ros.get_subscriptions_info_by_topic if "(in)" in row[0] else peer.ros.get_publishers_info_by_topic
        (qos,) = [end.qos_profile for end in find(name) if end.node_name == "ctr_equilibrium"]
        assert qos.reliability is ReliabilityPolicy.RELIABLE and "reliable" in row[2]
        latched = qos.durability is DurabilityPolicy.TRANSIENT_LOCAL
        assert latched == ("transient local" in row[2]) != ("volatile" in row[2])


def test_services(peer):
    services = peer.ros.get_service_names_and_types()
    there = {name: kinds[0] for name, kinds in services if name.startswith(f"{peer.namespace}/ctr_equilibrium/")}
    own = {name: kind for name, kind in there.items() if not PARAMETER_SERVICE.search(name)}
    assert own == {full_name(peer, code(row[0])[0]): code(row[1])[0] for row in table("service")}


def test_parameters_defaults_and_ranges():
    rows = {code(row[0])[0]: row for row in table("parameter")}
    assert list(rows) == list(PARAMETERS)
    for name, rule in PARAMETERS.items():
        first, _, default, limits, _ = rows[name]
        assert first.endswith(" r") == rule.read_only, name
        if isinstance(rule.default, bool):
            assert default == str(rule.default).lower(), name
        elif isinstance(rule.default, int | float):
            assert float(default) == rule.default, name
        else:
            empty = "required" if name == "robot_file" else "empty"
            assert default == (f"`{rule.default}`" if rule.default != "" else empty), name
        for bound in rule.bounds or ():
            assert f"{bound:g}" in limits, name
        assert all(f"`{choice}`" in limits for choice in rule.choices), name


def test_diagnostics_keys(peer):
    _, values = peer.diagnostics(lambda values: "last status" in values)
    assert list(values) == [key for row in table("key") for key in code(row[0])]


def test_status_codes_and_reasons():
    told = {code(row[0])[0]: row[1] == "yes" for row in table("status")}
    assert told == {**{status.value: status.success for status in Status}, BAD_INPUT: False}
    told = {code(row[0])[0]: row[1] == "yes" for row in table("search")}
    assert told == {**{status.value: status is InverseStatus.REACHED for status in InverseStatus}, BAD_INPUT: False}
    assert [code(row[0])[0] for row in table("reason")] == [reason.value for reason in Reason]
    assert [code(row[0])[0] for row in table("refusal")] == [reason.value for reason in WrenchReason]
    assert [code(row[0])[0] for row in table("pose refused")] == [reason.value for reason in PoseReason]
    assert [code(row[0])[0] for row in table("withheld")] == [SNAP_HELD, MARGIN_STOP, INTERNAL_ERROR]


@pytest.mark.parametrize(
    ("file", "least"),
    [
        ("srv/SolveEquilibrium.srv", 15),
        ("srv/SolveInverse.srv", 15),
        ("msg/EquilibriumStatus.msg", 12),
        ("msg/InverseSolution.msg", 6),
    ],
)
def test_fields_of_our_own_types(file, least):
    text = DOCUMENT.read_text(encoding="utf-8")
    definition = (DOCUMENT.parents[1] / "ctr_pvs_interfaces" / file).read_text(encoding="utf-8")
    fields = re.findall(r"^[\w/]+(?:\[\])? (\w+)(?: = \d+ .*| \S+)?$", definition, re.MULTILINE)
    assert len(fields) > least
    missing = [field for field in fields if f"`{field}`" not in text]
    assert missing in ([], ["header"])
