"""What the executables say before ROS is loaded."""

from __future__ import annotations

import sys

import pytest

from ctr_pvs_ros import front

BOTH = [front.equilibrium_node, front.sweep_demo]


@pytest.fixture(params=BOTH, ids=lambda door: door.__name__)
def called(request, monkeypatch, capsys):
    """Call an executable that must not come as far as ROS; its exit code and what it printed."""

    def call(*words):
        monkeypatch.setattr(sys, "argv", [request.param.__name__, *words])
        try:
            code = request.param()
        except SystemExit as end:
            code = end.code
        return code, capsys.readouterr()

    return call


@pytest.mark.parametrize("word", ["config/renda2021.yaml", "--robot", "--hel"])
def test_a_word_that_means_nothing_is_refused_in_one_line(called, word):
    code, said = called(word)
    assert code == 2 and said.out == ""
    assert len(said.err.splitlines()) == 1 and word in said.err and "--help" in said.err


def test_help_and_version(called):
    code, said = called("--help")
    assert code == 0 and said.out.startswith("usage: ") and said.err == ""
    code, said = called("--version")
    assert code == 0 and said.out.startswith("ctr_pvs ") and len(said.out.splitlines()) == 1


def test_without_ros_how_to_get_it(called, monkeypatch):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    code, said = called()
    assert code == 2 and said.out == ""
    assert len(said.err.splitlines()) == 1 and "no Python package rclpy" in said.err and "colcon build" in said.err


def test_words_for_ros_are_left_to_ros():
    words = ["a", "--ros-args", "--help", "-p", "x:=y", "--", "b", "--ros-args", "--version"]
    assert front.without_ros_arguments(words) == ["a", "b"]


def test_a_folder_that_was_only_asked_for_stays_as_it_is(tmp_path):
    front.try_to_write(tmp_path / "new" / "fig4.png")
    assert list((tmp_path / "new").iterdir()) == []
    (tmp_path / "fig4.png").write_text("the last one")
    front.try_to_write(tmp_path / "fig4.png")
    assert (tmp_path / "fig4.png").read_text() == "the last one"


def test_the_client_reads_its_words_before_it_asks_for_ros(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "rclpy", None)
    for words, told in ((["send", "foo"], "expected JOINT=POSITION"), (["watch"], "no Python package rclpy")):
        monkeypatch.setattr(sys, "argv", ["ctr_client", *words])
        assert front.ctr_client() == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("ctr_client: ") and told in line
