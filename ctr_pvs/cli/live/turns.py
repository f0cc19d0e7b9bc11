"""Who may work on the page: one at a time, while others may wait."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager


class Turns:
    """A lock whose holder is told that somebody waits, so that what can be cut short is."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._taken = False
        self._waiting = 0

    @contextmanager
    def mine(self) -> Iterator[None]:
        """Waits for the turn, and holds it."""
        with self._changed:
            self._waiting += 1
            self._changed.notify_all()
            self._changed.wait_for(lambda: not self._taken)
            self._waiting -= 1
            self._taken = True
        try:
            yield
        finally:
            with self._changed:
                self._taken = False
                self._changed.notify_all()

    def pause(self, seconds: float) -> bool:
        """Waits, for the holder; true, and at once, where somebody else wants the turn."""
        with self._changed:
            return self._changed.wait_for(lambda: self._waiting > 0, seconds)
