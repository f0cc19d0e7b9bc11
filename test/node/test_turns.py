"""Callers of one solver: in order, one at a time, and answered in time."""

import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

from ctr_pvs_ros.turns import GRACE
from ctr_pvs_ros.turns import Late
from ctr_pvs_ros.turns import Turns

SLACK = 0.1  # s, for a busy machine


def test_the_result_comes_back_and_so_do_errors():
    turns = Turns()
    assert turns.take(lambda left: 7, 1.0) == 7
    with pytest.raises(ZeroDivisionError):
        turns.take(lambda left: 1 / 0, 1.0)


def test_work_is_done_one_piece_after_the_other():
    turns, at_work = Turns(), threading.Semaphore()

    def work(left):
        assert at_work.acquire(blocking=False)
        time.sleep(0.01)
        at_work.release()
        return left

    with ThreadPoolExecutor(5) as callers:
        lefts = list(callers.map(lambda _: turns.take(work, 1.0), range(5)))
    assert all(0.0 < left <= 1.0 for left in lefts)


def test_waiting_counts_against_the_budget():
    turns, begun = Turns(), threading.Event()

    def slow(left):
        begun.set()
        time.sleep(0.1)

    with ThreadPoolExecutor(1) as caller:
        first = caller.submit(turns.take, slow, 5.0)
        begun.wait()
        assert turns.take(lambda left: left, 5.0) < 4.95
        first.result()


@pytest.mark.parametrize("callers", [1, 4])
def test_nobody_waits_for_work_that_does_not_keep_to_its_budget(callers):
    turns, ended = Turns(), threading.Event()

    def ask(_):
        began = time.monotonic()
        with pytest.raises(Late, match="budget"):
            turns.take(lambda left: ended.wait(5.0), 0.05)
        return time.monotonic() - began

    with ThreadPoolExecutor(callers) as pool:
        waits = list(pool.map(ask, range(callers)))
    assert max(waits) < 0.05 + GRACE + SLACK
    ended.set()
    assert turns.take(lambda left: "again", 1.0) == "again"


def test_those_whose_time_is_over_are_not_worked_for():
    turns, started = Turns(), []

    def slow(left):
        time.sleep(0.1)

    with ThreadPoolExecutor(2) as pool:
        first = pool.submit(turns.take, slow, 1.0)
        time.sleep(0.02)
        with pytest.raises(Late, match="before other requests were done"):
            turns.take(started.append, 0.03)
        first.result()
    assert turns.take(lambda left: None, 1.0) is None
    assert started == []
