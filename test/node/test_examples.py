"""The examples agree with the package's own launch file and interface. Read as data: no ROS needed."""

import ast
import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
OURS = "$(find-pkg-share ctr_pvs)/"


def names(launch):
    """The arguments that a launch file declares."""
    return {argument.get("name") for argument in launch.findall("arg")}


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.launch.xml")), ids=lambda path: path.name)
def test_an_included_launch_file_is_there_and_has_the_arguments_it_is_given(path):
    launch = ET.parse(path).getroot()
    includes = list(launch.iter("include"))
    assert includes
    for include in includes:
        file = ROOT / include.get("file").removeprefix(OURS)
        given = {argument.get("name"): argument.get("value") for argument in include.iter("arg")}
        assert set(given) <= names(ET.parse(file).getroot())
        for value in given.values():
            if value.startswith(OURS):
                assert (ROOT / value.removeprefix(OURS)).is_file()
            if value.startswith("$(var "):
                assert value.removeprefix("$(var ").rstrip(")") in names(launch)
    assert len({include.find("arg[@name='namespace']").get("value") for include in includes}) == len(includes)


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.py")), ids=lambda path: path.name)
def test_an_example_says_what_it_is_for_and_how_to_run_it(path):
    text = path.read_text(encoding="utf-8")
    told = ast.get_docstring(ast.parse(text))
    assert f"python3 examples/{path.name}" in told
    assert "pip install" in told


def test_every_example_is_in_the_document():
    document = (ROOT / "docs" / "ros_interface.md").read_text(encoding="utf-8")
    for path in EXAMPLES.iterdir():
        if path.is_file():
            assert f"`examples/{path.name}`" in document
