"""What pip makes of the sources is whole: it works from any folder, without the checkout and without ROS."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import xml.etree.ElementTree as ET
import zipfile
from email.parser import Parser
from importlib.metadata import distributions

import pytest
from checkout import ROOT
from checkout import copy_checkout

# Not by importlib: setuptools puts something of its own in the way of that.
HERE = {distribution.name for distribution in distributions()}
MISSING = sorted({"pip", "setuptools", "wheel"} - HERE)
pytestmark = pytest.mark.skipif(bool(MISSING), reason=f"not installed: {', '.join(MISSING)}")

PIP = (sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", "--no-input")
OFFLINE = ("--no-index", "--no-deps")
SOLVE = """
import ctr_pvs
from ctr_pvs import EquilibriumSolver, load_robot
answer = EquilibriumSolver(load_robot("renda2021"), 1e-6).solve([0.0, 1.0], [0.0935, 0.2085])
assert answer.success, answer.message
print(ctr_pvs.__file__, len(answer.backbone(5)))
"""
VERSION = """
import sys
from ctr_pvs.cli.main import main
try:
    main(["--version"])
finally:
    assert not {"numba", "scipy"} & set(sys.modules)
"""


def run(*command, cwd, environment=None, code=0):
    """Run a command that is to end with this exit code."""
    process = subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=120.0, check=False
    )
    assert process.returncode == code, process.stderr
    return process


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """The folder that the source distribution unpacks to."""
    folder = tmp_path_factory.mktemp("sources")
    checkout = copy_checkout(folder / "checkout")
    run(sys.executable, "setup.py", "-q", "sdist", "--dist-dir", folder, cwd=checkout)
    (archive,) = folder.glob("*.tar.gz")
    with tarfile.open(archive) as tar:
        tar.extractall(folder, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))  # not before 3.11.4
    return folder / archive.name.removesuffix(".tar.gz")


@pytest.fixture(scope="module")
def wheel(unpacked):
    """The wheel, built from the source distribution."""
    run(*PIP, "wheel", *OFFLINE, "--no-build-isolation", "--wheel-dir", "..", ".", cwd=unpacked)
    (path,) = unpacked.parent.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def prefix(wheel, tmp_path_factory):
    """The folder that the wheel is installed into."""
    folder = tmp_path_factory.mktemp("prefix")
    # Also where the same version is on the path, as in a workspace.
    forced = ("--ignore-installed", "--no-warn-script-location")
    run(*PIP, "install", *OFFLINE, *forced, "--prefix", folder, wheel, cwd=folder)
    return folder


@pytest.fixture(scope="module")
def environment(prefix, tmp_path_factory):
    """In which the installed package is found, and no ROS is, though it be in the same venv."""
    without_ros = tmp_path_factory.mktemp("without_ros")
    (without_ros / "sitecustomize.py").write_text("import sys\nsys.modules['rclpy'] = None\n")
    (package,) = prefix.glob("**/ctr_pvs/__init__.py")
    path = os.pathsep.join(map(str, (without_ros, package.parents[1])))
    return {"PYTHONPATH": path, "NUMBA_DISABLE_JIT": "1", "PATH": "/usr/bin:/bin"}


def script(prefix, name):
    (path,) = prefix.glob(f"**/bin/{name}")
    return path


def test_the_sources_have_what_it_takes_to_build_and_to_read_about_it(unpacked):
    files = {str(path.relative_to(unpacked)) for path in unpacked.rglob("*") if path.is_file()}
    shipped = {str(path.relative_to(ROOT)) for folder in ("config", "launch") for path in (ROOT / folder).iterdir()}
    assert files >= shipped | {"README.md", "LICENSE", "package.xml", "pyproject.toml", "setup.cfg", "setup.py"}


def test_the_wheel_tells_what_it_is_and_holds_the_license(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
        told = Parser().parsestr(archive.read(metadata).decode("utf-8"))
        licenses = [archive.read(name) for name in archive.namelist() if name.endswith("LICENSE")]
    assert told["Version"] == ET.parse(ROOT / "package.xml").findtext("version")
    assert told["Description-Content-Type"] == "text/markdown"
    assert told.get_payload().strip() == (ROOT / "README.md").read_text(encoding="utf-8").strip()
    assert set(told.get_all("Provides-Extra")) == {"cluster", "plot", "test", "view"}
    assert licenses == [(ROOT / "LICENSE").read_bytes()]


def test_it_solves_from_where_it_is_installed(prefix, environment):
    process = run(sys.executable, "-c", SOLVE, cwd="/", environment=environment)
    assert str(prefix) in process.stdout and process.stdout.strip().endswith("5")


def test_shipped_robots_go_by_name_from_any_folder(prefix, environment):
    command = [script(prefix, "ctr-pvs"), "solve", "renda2021", "--alpha", "0", "1", "--D", "0.0935", "0.2085"]
    assert run(*command, cwd="/", environment=environment).stdout
    command[2] = "renda2012"
    error = run(*command, cwd="/", environment=environment, code=2).stderr
    assert len(error.splitlines()) == 1
    assert "renda2012: expected" in error and "(renda2021, renda2021_fig2, three_tubes)" in error


def test_the_version_comes_without_what_takes_long_to_load(prefix, environment):
    version = f"ctr_pvs {ET.parse(ROOT / 'package.xml').findtext('version')}\n"
    assert run(sys.executable, "-c", VERSION, cwd="/", environment=environment).stdout == version
    for name in ("ctr-pvs", "equilibrium_node", "ctr_client", "sweep_demo"):
        assert run(script(prefix, name), "--version", cwd="/", environment=environment).stdout == version


@pytest.mark.parametrize("name", ["equilibrium_node", "sweep_demo"])
def test_without_ros_executables_say_how_to_get_it(prefix, environment, name):
    process = run(script(prefix, name), cwd="/", environment=environment, code=2)
    (line,) = process.stderr.splitlines()
    assert line.startswith(f"{name}: needs ROS 2") and "colcon build" in line and process.stdout == ""
    assert f"usage: {name}" in run(script(prefix, name), "--help", cwd="/", environment=environment).stdout
