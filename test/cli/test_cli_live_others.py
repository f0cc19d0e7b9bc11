"""Beside the live page's sliders: other equilibria, searched for in a process of their own, and whose turn it is."""

from __future__ import annotations

import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest
from live_scenes import ROBOT
from live_scenes import SEED
from live_scenes import TURNED

from ctr_pvs import equilibria
from ctr_pvs import load_robot
from ctr_pvs.cli.live.others import Others
from ctr_pvs.cli.live.others import Question
from ctr_pvs.cli.live.others import find_others
from ctr_pvs.cli.live.searcher import Searcher
from ctr_pvs.cli.live.state import LiveRobot
from ctr_pvs.cli.live.turns import Turns


def live(name=ROBOT) -> LiveRobot:
    return LiveRobot(load_robot(name), 1e-5)


# --- other equilibria -------------------------------------------------------------------------------------------------


def test_others_are_those_of_the_solver_beside_that_which_is_shown():
    robot = live(SEED)
    shown = robot.move(TURNED.alpha, TURNED.D, TURNED.tip_force)
    others = find_others(robot.robot, 1e-5, TURNED)
    every = equilibria(robot.robot, TURNED.alpha, TURNED.D).found
    assert [ghost.stable for ghost in others.ghosts] == [one.stability_margin > 0.0 for one in every]
    assert sorted(ghost.stable for ghost in others.ghosts) == [False, True, True]
    for ghost, one in zip(others.ghosts, every, strict=True):
        assert ghost.tubes[1].position[-1] == pytest.approx(one.tip.position, abs=1e-9)
    beside = others.beside(shown.tubes, 1e-5)
    assert sorted(ghost.stable for ghost in beside) == [False, True]
    assert min(np.linalg.norm(ghost.tubes[1].position[-1] - shown.tip.position) for ghost in beside) > 0.01
    pushed = find_others(robot.robot, 1e-5, replace(TURNED, tip_force=np.array([0.0, 0.05, 0.0])))
    assert all(ghost.stable for ghost in pushed.ghosts) and "the loads put on" in pushed.told


class Heard:
    """What a searcher has found."""

    def __init__(self) -> None:
        self.answers: list[tuple[Question, Others]] = []
        self.came = threading.Semaphore(0)

    def __call__(self, question, others):
        self.answers.append((question, others))
        self.came.release()


@pytest.fixture
def searching():
    heard = Heard()
    searcher = Searcher(load_robot(SEED), 1e-5, heard)
    yield searcher, heard
    searcher.stop()


def test_a_search_answers_the_newest_question_from_a_process_of_its_own(searching):
    searcher, heard = searching
    older = [replace(TURNED, alpha=np.array([0.0, 0.01 * i])) for i in range(20)]
    for question in (*older, TURNED):
        searcher.ask(question)
    assert heard.came.acquire(timeout=60)
    question, others = heard.answers[-1]
    assert question is TURNED and len(heard.answers) == 1
    assert len(others.ghosts) == 3 and "integration from the tip" in others.told
    assert searcher._process.pid != os.getpid()
    process = searcher._process
    searcher.ask(older[0])
    searcher.ask(None)  # not wanted any more
    assert not heard.came.acquire(timeout=1.0)
    searcher.ask(older[1])
    assert heard.came.acquire(timeout=60) and len(heard.answers[-1][1].ghosts) == 1
    assert searcher._process is process


def test_a_search_that_takes_too_long_or_dies_is_given_up_and_the_next_one_works(searching, monkeypatch):
    searcher, heard = searching
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60)
    process = searcher._process
    process.send_signal(signal.SIGSTOP)
    monkeypatch.setattr("ctr_pvs.cli.live.searcher.BUDGET", 0.2)
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60)
    assert heard.answers[-1][1].told == "given up after 0.2 s" and process.poll() is not None
    monkeypatch.undo()
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60) and len(heard.answers[-1][1].ghosts) == 3
    searcher._process.kill()
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60) and "ended unexpectedly" in heard.answers[-1][1].told


def test_the_end_of_a_searcher_ends_its_process_in_mid_search(searching):
    searcher, heard = searching
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60)
    process = searcher._process
    process.send_signal(signal.SIGSTOP)
    searcher.ask(TURNED)
    searcher.stop()
    assert process.poll() is not None and len(heard.answers) == 1


# --- turns ------------------------------------------------------------------------------------------------------------


def test_who_holds_the_turn_hears_at_once_that_somebody_waits():
    turns, order = Turns(), []

    def other():
        with turns.mine():
            order.append("other")

    with turns.mine():
        assert not turns.pause(0.01)
        thread = threading.Thread(target=other)
        thread.start()
        assert turns.pause(60.0)
        assert turns.pause(60.0)  # as long as it waits
        order.append("mine")
    thread.join(timeout=60)
    assert order == ["mine", "other"]
    with turns.mine():
        assert not turns.pause(0.01)
