"""Robots that go by name."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from ctr_pvs import RobotFileError
from ctr_pvs import load_robot
from ctr_pvs.robot.shipped import shipped_folder

ROOT = Path(__file__).resolve().parents[2]
NAMES = sorted(path.stem for path in (ROOT / "config").glob("*.yaml") if path.stem != "equilibrium_node")


@pytest.fixture(autouse=True)
def elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_every_shipped_robot_has_a_name():
    assert "renda2021" in NAMES
    for name in NAMES:
        assert load_robot(name) == load_robot(ROOT / "config" / f"{name}.yaml")


@pytest.mark.parametrize("name", ["renda2012", "equilibrium_node", " renda2021"])
def test_an_unknown_name_is_answered_with_those_there_are(name):
    with pytest.raises(RobotFileError) as caught:
        load_robot(name)
    assert ", ".join(NAMES) in str(caught.value) and str(caught.value).startswith(f"{name}: ")


@pytest.mark.parametrize("path", ["renda2021.yaml", "./renda2021", ".", "nul\0l", "a" * 300, ""])
def test_what_is_no_name_is_a_path(path):
    with pytest.raises(RobotFileError):
        load_robot(path)


def test_a_file_comes_before_a_robot_of_its_name(tmp_path):
    shutil.copy(ROOT / "config" / "three_tubes.yaml", tmp_path / "renda2021")
    assert load_robot("renda2021").n_tubes == 3


@pytest.mark.parametrize(
    "site", ["lib/python3.12/site-packages", "local/lib/python3.12/dist-packages", "lib64/python3/site-packages", ""]
)
def test_installed_files_are_found_from_the_code(tmp_path, site):
    code = tmp_path / "prefix" / site / "ctr_pvs" / "robot" / "shipped.py"
    assert shipped_folder(code) is None
    share = tmp_path / "prefix" / "share" / "ctr_pvs"
    share.mkdir(parents=True)
    (share / "package.xml").touch()
    assert shipped_folder(code) == share
