"""One solver for many callers: first come, first served, and every caller has an answer in time."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

#: How long [s] past its budget a piece of work is waited for before its caller is told that it is late.
GRACE = 0.01

T = TypeVar("T")


class Late(TimeoutError):
    """The work was not done in time; the message says why."""


class Turns:
    """Does pieces of work one after the other in a thread of its own, for callers in any thread."""

    def __init__(self) -> None:
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="turns")

    def take(self, work: Callable[[float], T], budget: float) -> T:
        """What ``work`` returns when it is its turn; it is called with the rest of the budget [s].

        Raises:
            Late: ``budget`` [s] were over before the turn came, or while work went on that does not keep to it.
        """
        deadline = time.monotonic() + budget

        def in_turn() -> T:
            left = deadline - time.monotonic()
            if left <= 0.0:
                raise Late(f"the budget of {budget:g} s was over before other requests were done")
            return work(left)

        future: Future[T] = self._worker.submit(in_turn)
        try:
            return future.result(timeout=budget + GRACE)
        except Late:
            raise
        except TimeoutError:
            waited = future.cancel()
            why = "before other requests were done" if waited else "while the solve went on"
            raise Late(f"the budget of {budget:g} s was over {why}") from None
