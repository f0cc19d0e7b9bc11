"""Cloned into a workspace and built with a plain `colcon build`, the package is all there."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix
from checkout import copy_checkout
from checkout import environment_without

BUILD_TIME = 300.0  # s
#: What a shell finds after `source install/setup.bash`.
LOOK = """
from ament_index_python.packages import get_package_share_directory
import ctr_pvs, ctr_pvs_ros
from ctr_pvs_interfaces.srv import SolveEquilibrium
for package in ("ctr_pvs", "ctr_pvs_interfaces"):
    print(get_package_share_directory(package))
for module in (ctr_pvs, ctr_pvs_ros):
    print(module.__file__)
"""
ENVIRONMENT = environment_without(Path(get_package_prefix("ctr_pvs")).parent)

pytestmark = pytest.mark.skipif(shutil.which("colcon") is None, reason="colcon is not installed")


@pytest.fixture(scope="module")
def workspace(tmp_path_factory):
    folder = tmp_path_factory.mktemp("workspace")
    copy_checkout(folder / "src" / "ctr_pvs")
    return folder


@pytest.fixture(scope="module", params=[(), ("--symlink-install",)], ids=["copied", "linked"])
def installed(request, workspace):
    """The install folder. The second one finds the messages compiled by the first."""
    install = workspace / ("linked" if request.param else "install")
    # ament cannot put a link where it has put a folder.
    shutil.rmtree(workspace / "build" / "ctr_pvs" / "ament_cmake_python", ignore_errors=True)
    build = ["colcon", "build", "--install-base", install, *request.param]
    run = subprocess.run(build, cwd=workspace, env=ENVIRONMENT, capture_output=True, text=True, timeout=BUILD_TIME)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "Summary: 1 package finished" in run.stdout and "stderr output" not in run.stdout
    return install


def in_workspace(install, command):
    """Run one shell command where the workspace is sourced, from a folder that holds nothing."""
    script = f"source {install}/setup.bash && {command}"
    return subprocess.run(
        ["bash", "-c", script], cwd=install / "ctr_pvs", env=ENVIRONMENT, capture_output=True, text=True, timeout=60.0
    )


def test_both_packages_are_found(installed):
    run = in_workspace(installed, f"{sys.executable} -c '{LOOK}'")
    assert run.returncode == 0, run.stderr
    prefix = installed / "ctr_pvs"
    share, interfaces, *modules = map(Path, run.stdout.split())
    assert (share, interfaces) == (prefix / "share" / "ctr_pvs", prefix / "share" / "ctr_pvs_interfaces")
    assert all(module.is_relative_to(prefix) for module in modules)


def test_executables_run(installed):
    programs = installed / "ctr_pvs" / "lib" / "ctr_pvs"
    node = in_workspace(installed, f"{programs}/equilibrium_node --ros-args -p robot_file:=no_such.yaml")
    assert node.returncode == 2 and "no_such.yaml" in node.stderr, node.stderr
    command = in_workspace(installed, f"{programs}/ctr-pvs --help")
    assert command.returncode == 0 and "usage: ctr-pvs" in command.stdout, command.stderr
    assert {program.name for program in programs.iterdir()} == {"ctr-pvs", "equilibrium_node", "sweep_demo"}
