"""The files for RViz and Foxglove show topics that the node has, with displays for their types. Needs no ROS."""

import ast
import json
import re
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]
RVIZ = ROOT / "config" / "ctr_pvs.rviz"
FOXGLOVE = ROOT / "config" / "ctr_pvs.foxglove.json"
NODE = "/ctr_equilibrium"
#: What the displays of RViz, and Foxglove's 3D panel, can draw of what the node has.
RVIZ_TYPES = {"MarkerArray": "MarkerArray", "Pose": "PoseStamped", "PoseArray": "PoseArray"}
FOXGLOVE_TYPES = set(RVIZ_TYPES.values())
FIELDS = {"Float64": {"data"}, "JointState": {"name", "position", "velocity", "effort"}}


def topics():
    """Topic -> type of what the node publishes, as ctr_pvs_ros/outputs/publishers.py creates it."""
    tree = ast.parse((ROOT / "ctr_pvs_ros" / "outputs" / "publishers.py").read_text(encoding="utf-8"))
    found = {}
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and isinstance(call.func, ast.Attribute) and len(call.args) >= 2:
            kind, topic = call.args[:2]
            if call.func.attr in ("_output", "create_publisher") and isinstance(topic, ast.Constant):
                found[f"/{topic.value}".replace("/~", NODE)] = ast.unparse(kind)
    return found


def own_fields():
    """Of the project's own message."""
    text = (ROOT / "ctr_pvs_interfaces" / "msg" / "EquilibriumStatus.msg").read_text(encoding="utf-8")
    return set(re.findall(r"^[\w/]+ (\w+)$", text, re.MULTILINE))


def displays():
    return yaml.safe_load(RVIZ.read_text(encoding="utf-8"))["Visualization Manager"]["Displays"]


def panels():
    return json.loads(FOXGLOVE.read_text(encoding="utf-8"))["configById"]


def default_frame():
    """Of the parameter frame_id."""
    text = (ROOT / "ctr_pvs_ros" / "parameters.py").read_text(encoding="utf-8")
    return re.search(r'"frame_id": ParameterRule\(\s*"(\w+)"', text).group(1)


def leaves(layout):
    """The panels of a layout."""
    return [layout] if isinstance(layout, str) else leaves(layout["first"]) + leaves(layout["second"])


def test_topics_are_found_in_the_source_and_most_of_them_in_the_document():
    document = (ROOT / "docs" / "ros_interface.md").read_text(encoding="utf-8")
    assert topics()[f"{NODE}/status"] == "EquilibriumStatus"
    for topic in ("/markers", "/setpoint_cp", "/backbone", "/stability_margin", "/setpoint_js"):
        assert re.search(rf"^\| `{topic[1:]}` \| `\w+/msg/{topics()[topic]}` \|", document, re.MULTILINE), topic


def test_rviz_shows_topics_of_the_node_with_displays_for_their_types():
    shown = {display["Topic"]["Value"]: display for display in displays() if "Topic" in display}
    assert set(shown) == {"/markers", "/setpoint_cp", "/backbone"}
    for topic, display in shown.items():
        assert RVIZ_TYPES[display["Class"].removeprefix("rviz_default_plugins/")] == topics()[topic]
        # Else a viewer that comes after the last answer would stay empty.
        assert display["Topic"]["Durability Policy"] == "Transient Local"
        assert display["Topic"]["Reliability Policy"] == "Reliable"


def test_rviz_has_a_grid_of_a_centimetre_in_the_nodes_frame_and_shows_tf():
    manager = yaml.safe_load(RVIZ.read_text(encoding="utf-8"))["Visualization Manager"]
    assert manager["Global Options"]["Fixed Frame"] == default_frame()
    by_class = {display["Class"].rpartition("/")[2]: display for display in manager["Displays"]}
    assert by_class["Grid"]["Cell Size"] == 0.01
    assert by_class["TF"]["Enabled"]
    assert all(display["Enabled"] and display["Value"] for display in manager["Displays"])


def test_every_panel_of_foxglove_has_its_place_and_its_settings():
    content = json.loads(FOXGLOVE.read_text(encoding="utf-8"))
    places = leaves(content["layout"])
    assert sorted(places) == sorted(content["configById"])
    assert {panel.partition("!")[0] for panel in places} == {"3D", "Plot", "RawMessages"}


def test_foxglove_draws_topics_of_the_node_that_can_be_drawn_in_its_frame():
    (space,) = (panel for name, panel in panels().items() if name.startswith("3D!"))
    assert set(space["topics"]) == {"/markers", "/setpoint_cp", "/backbone"}
    assert {topics()[topic] for topic in space["topics"]} <= FOXGLOVE_TYPES
    (grid,) = space["layers"].values()
    assert space["followTf"] == grid["frameId"] == default_frame()
    assert grid["size"] / grid["divisions"] == pytest.approx(0.01)


def test_foxglove_plots_fields_that_the_messages_have():
    fields = {**FIELDS, "EquilibriumStatus": own_fields()}
    values = {path["value"] for name, panel in panels().items() if name.startswith("Plot!") for path in panel["paths"]}
    for value in values:
        topic, _, field = value.partition(".")
        assert re.sub(r"\[\d+\]$", "", field) in fields[topics()[topic]], value
    asked_for = {"/stability_margin.data", f"{NODE}/status.snap_reserve", f"{NODE}/status.stability_margin"}
    assert asked_for < values
    assert {f"/setpoint_js.effort[{joint}]" for joint in range(4)} < values


def test_foxglove_tells_the_status():
    (raw,) = (panel for name, panel in panels().items() if name.startswith("RawMessages!"))
    assert topics()[raw["topicPath"]] == "EquilibriumStatus"


@pytest.mark.parametrize("path", [RVIZ, FOXGLOVE], ids=lambda path: path.name)
def test_they_are_installed(path):
    setup = (ROOT / "setup.py").read_text(encoding="utf-8")
    (line,) = (line for line in setup.splitlines() if "share/{PACKAGE}/config" in line)
    assert f'glob("config/*{path.suffix}")' in line
