"""Cloned into a workspace and built with a plain `colcon build` at its root, the package is all there.

Here it is built with links in place of copies, which asks more of its CMake files; set-up has built it with copies.
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from ament_index_python.packages import get_package_prefix
from ament_index_python.packages import get_package_share_directory
from checkout import ROOT
from checkout import copy_checkout
from checkout import entry_points
from checkout import environment_without

BUILD_TIME = 300.0  # s
PACKAGES = ("ctr_pvs", "ctr_pvs_interfaces")
#: What a shell finds after `source install/setup.bash`.
LOOK = f"""
from ament_index_python.packages import get_package_share_directory
import ctr_pvs, ctr_pvs_ros
from ctr_pvs_interfaces.srv import SolveEquilibrium
for package in {PACKAGES}:
    print(get_package_share_directory(package))
for module in (ctr_pvs, ctr_pvs_ros):
    print(module.__file__)
"""
ENVIRONMENT = environment_without(Path(get_package_prefix("ctr_pvs")).parent)


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """Where colcon installs the package."""
    if shutil.which("colcon") is None:
        pytest.skip("colcon is not installed")
    workspace = tmp_path_factory.mktemp("workspace")
    copy_checkout(workspace / "src" / "ctr_pvs")
    build = ["colcon", "build", "--symlink-install"]
    run = subprocess.run(build, cwd=workspace, env=ENVIRONMENT, capture_output=True, text=True, timeout=BUILD_TIME)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "Summary: 1 package finished" in run.stdout and "stderr output" not in run.stdout
    return workspace / "install" / "ctr_pvs"


def sourced(prefix, command):
    """Run one shell command where the workspace is sourced, from a folder that holds nothing of it."""
    script = f"source {prefix.parent}/setup.bash && {command}"
    return subprocess.run(
        ["bash", "-c", script], cwd=prefix, env=ENVIRONMENT, capture_output=True, text=True, timeout=60.0
    )


def test_both_packages_are_found(prefix):
    run = sourced(prefix, shlex.join([sys.executable, "-c", LOOK]))
    assert run.returncode == 0, run.stderr
    *shares, code, node = map(Path, run.stdout.split())
    assert shares == [prefix / "share" / package for package in PACKAGES]
    assert code.is_relative_to(prefix) and node.is_relative_to(prefix)


def test_executables_run(prefix):
    programs = prefix / "lib" / "ctr_pvs"
    assert {program.name for program in programs.iterdir()} == set(entry_points())
    for program in programs.iterdir():
        run = sourced(prefix, f"{program} --help")
        assert run.returncode == 0 and f"usage: {program.name}" in run.stdout, run.stderr
    node = sourced(prefix, f"{programs}/equilibrium_node --ros-args -p robot_file:=no_such.yaml")
    assert node.returncode == 2 and "no_such.yaml" in node.stderr, node.stderr
    solve = sourced(prefix, f"{programs}/ctr-pvs solve renda2021 --alpha 0 1 --D 0.0935 0.2085")
    assert solve.returncode == 0, solve.stderr


@pytest.mark.parametrize("package", PACKAGES)
def test_set_up_has_built_both_packages(package):
    assert Path(get_package_share_directory(package), "package.xml").is_file()


def test_shipped_files_are_installed(prefix):
    for share in (prefix / "share" / "ctr_pvs", Path(get_package_share_directory("ctr_pvs"))):
        for folder in ("config", "launch"):
            for file in (ROOT / folder).iterdir():
                assert (share / folder / file.name).read_bytes() == file.read_bytes()
        assert (share / "data" / "reference_values.json").is_file()
