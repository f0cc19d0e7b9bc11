"""The scripts behind make: where they refuse, what they take for set up, and which folders they use."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

import pytest
from checkout import ROOT

SHOW = "source scripts/ros_env.sh && echo $ROS $VENV $WORKSPACE"
SET_UP = "source scripts/ros_env.sh && mkdir -p $VENV $WORKSPACE/install && venv_key >$VENV/made_from"
#: What set-up calls that would reach beyond the folder. It installs system packages for root only.
HARMLESS = {"id": "echo 1000", "apt-get": "exit 1"}


def write_program(path: Path, text: str) -> None:
    path.write_text(f"#!/bin/sh\n{text}\n")
    path.chmod(0o755)


@pytest.fixture
def terminal(tmp_path):
    """Variables of a terminal where no ROS is sourced. Set-up ends there where wheels would be loaded."""
    programs = tmp_path / "programs"
    programs.mkdir()
    for name, text in HARMLESS.items():
        write_program(programs / name, text)
    return {"PATH": os.pathsep.join((str(programs), os.environ["PATH"])), "HOME": str(tmp_path), "PIP_NO_INDEX": "1"}


@pytest.fixture
def terminal_with_ros(tmp_path, terminal):
    """Variables of a terminal that looks as if ROS 2 Jazzy were sourced."""
    places = tmp_path / "ros"
    (places / "rclpy").mkdir(parents=True)
    (places / "rclpy" / "__init__.py").touch()
    write_program(places / "colcon", "exit 1")
    path = os.pathsep.join((str(places), terminal["PATH"]))
    return terminal | {"ROS_DISTRO": "jazzy", "PATH": path, "PYTHONPATH": str(places)}


@pytest.fixture
def folder(tmp_path):
    return checkout(tmp_path / "here")


def checkout(folder: Path) -> Path:
    """What make needs to see of the checkout, in another folder."""
    shutil.copytree(ROOT / "scripts", folder / "scripts")
    shutil.copy(ROOT / "Makefile", folder)
    return folder


def run(folder, variables, *command):
    """Run a command in a terminal."""
    return subprocess.run(command, cwd=folder, env=variables, capture_output=True, text=True, timeout=60.0, check=False)


@pytest.mark.parametrize("name", ["a b", "a:b", "a;b", "a#b", "a$b", "a'b", 'a"b', "a\\b"])
def test_a_folder_that_colcon_cannot_take_is_refused_at_once(tmp_path, terminal, name):
    folder = checkout(tmp_path / name)
    process = run(folder, terminal, "make", "setup")
    assert process.returncode != 0 and process.stdout == ""
    assert "a space or one of" in process.stderr and f"move it: {folder}" in process.stderr
    assert not (folder / ".venv").exists()


def test_a_moved_checkout_is_set_up_anew(folder, terminal):
    assert run(folder, terminal, "scripts/in_env.sh", "true").returncode == 1
    run(folder, terminal, "bash", "-c", SET_UP)
    (folder / ".ws" / "install" / "local_setup.bash").touch()
    (folder / ".venv" / "made_before").touch()
    assert run(folder, terminal, "scripts/in_env.sh", "true").returncode == 0

    moved = folder.rename(folder.with_name("there"))
    process = run(moved, terminal, "scripts/in_env.sh", "true")
    assert process.returncode == 1 and "call make setup" in process.stderr
    process = run(moved, terminal, "make", "setup")
    assert "making everything anew" in process.stdout
    assert not (moved / ".venv" / "made_before").exists() and not (moved / ".ws").exists()


def test_terminals_with_and_without_ros_use_different_folders(folder, terminal, terminal_with_ros):
    without = run(folder, terminal, "bash", "-c", SHOW).stdout.split()
    assert without == ["wheels", f"{folder}/.venv", f"{folder}/.ws"]
    sourced = run(folder, terminal_with_ros, "bash", "-c", SHOW).stdout.split()
    assert sourced == ["sourced", f"{folder}/.venv-sourced", f"{folder}/.ws-sourced"]
    ignored = (ROOT / ".gitignore").read_text(encoding="utf-8").split()
    assert {f"/{Path(path).name}/" for path in (*without[1:], *sourced[1:])} <= set(ignored)


def test_set_up_says_which_ros_it_uses(folder, terminal, terminal_with_ros):
    assert "wheels, in .venv and .ws\n" in run(folder, terminal, "make", "setup").stdout
    (folder / ".venv" / "mine").touch()
    said = run(folder, terminal_with_ros, "make", "setup").stdout
    assert "sourced ROS 2 Jazzy, in .venv-sourced and .ws-sourced\n" in said
    assert (folder / ".venv" / "mine").exists()
    said = run(folder, terminal | {"ROS_DISTRO": "humble"}, "make", "setup").stdout
    assert "ROS_DISTRO is humble, but Jazzy" in said and "wheels" in said


def test_clean_removes_the_folders_of_both(folder, terminal):
    made = [folder / name for name in (".venv", ".ws", ".venv-sourced", ".ws-sourced")]
    for path in made:
        path.mkdir()
    run(folder, terminal, "make", "clean")
    assert not any(path.exists() for path in made)


@pytest.mark.parametrize("robot", ["config/no such.yaml", "a#b: c.yaml", "$HOME.yaml"])
def test_the_name_of_the_robot_file_reaches_the_node_whole(folder, terminal, robot):
    write_program(folder / "show", 'printf "%s\\n" "$@"')
    call = ("make", "-o", "setup", f"IN_ENV={folder}/show", "run", f"ROBOT={robot.replace('$', '$$')}")
    assert run(folder, terminal, *call).stdout.splitlines()[-2:] == ["-p", f"robot_file:='{robot}'"]
