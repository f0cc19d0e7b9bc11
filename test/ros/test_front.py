"""What the executables say where ROS is there."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix

from ctr_pvs_ros.parameters import PARAMETERS

PROGRAMS = Path(get_package_prefix("ctr_pvs"), "lib", "ctr_pvs")


def run(program, *words):
    """An executable that ends by itself, soon."""
    return subprocess.run([PROGRAMS / program, *words], capture_output=True, text=True, timeout=10.0, check=False)


def test_help_of_the_node_tells_every_parameter_and_how_to_set_it():
    process = run("equilibrium_node", "--help")
    assert process.returncode == 0 and process.stderr == ""
    assert "--ros-args" in process.stdout and "-p robot_file:=" in process.stdout
    said = " ".join(process.stdout.split())
    for name, rule in PARAMETERS.items():
        assert f"{name}: {' '.join(rule.description.split())}" in said


@pytest.mark.parametrize("there", ["file", "file/deeper", "folder"])
def test_the_demo_asks_whether_it_may_write_before_it_starts(tmp_path, there):
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "folder" / "fig4.png").mkdir(parents=True)
    process = run("sweep_demo", "--output", tmp_path / there)
    assert process.returncode == 2 and process.stdout == ""
    (line,) = process.stderr.splitlines()
    assert "--output" in line and str(tmp_path / there / "fig4.png") in line
