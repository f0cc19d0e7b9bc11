"""Compiling beside a process that lives long: it serves interpreted meanwhile, and switches when all is done."""

from __future__ import annotations

import contextlib
import os
import subprocess
import threading
import time
from collections.abc import Callable

from ctr_pvs.kernel.compiler import switch
from ctr_pvs.kernel.compiler.child import spawn

#: The child cleans up and ends by itself within the first [s]; then it is killed.
PATIENCE = 0.7
LOOK = 0.01


class Background:
    """A child process that compiles, and the thread that waits for it; see ``compile_in_background``."""

    def __init__(self, child: subprocess.Popen[str] | None, on_done: Callable[[str], None]) -> None:
        self._child, self._on_done = child, on_done
        self._stopped = False
        self._watcher: threading.Thread | None = None
        if child is not None:
            self._watcher = threading.Thread(target=self._watch, args=(child,), name="compile kernels", daemon=True)
            self._watcher.start()

    @property
    def running(self) -> bool:
        """Whether the outcome is still to come."""
        return self._watcher is not None and self._watcher.is_alive()

    def wait(self, timeout: float | None = None) -> bool:
        """Wait for the outcome, at most ``timeout`` [s]; whether there is nothing left to wait for."""
        if self._watcher is not None:
            self._watcher.join(timeout)
        return not self.running

    def stop(self) -> None:
        """End the child, within a second; ``on_done`` is not called any more.  Takes no locks: signal handlers may."""
        self._stopped = True
        if self._child is None:
            return
        self._child.terminate()
        deadline = time.monotonic() + PATIENCE
        while self._child.poll() is None and time.monotonic() < deadline:
            time.sleep(LOOK)
        if self._child.poll() is None:
            self._child.kill()

    def _watch(self, child: subprocess.Popen[str]) -> None:
        told = child.communicate()[0].strip().splitlines()
        if self._stopped:
            return
        if child.returncode == 0 and switch.use_compiled():
            line = f"{told[-1]}; from now on they run compiled"
        else:
            line = f"{told[-1] if told else switch.why()}: {switch.SLOWER}"
        if not self._stopped:
            with contextlib.suppress(Exception):  # the caller's log may be closed by now
                self._on_done(line)


def compile_in_background(on_done: Callable[[str], None]) -> Background:
    """Compile the kernels in a child process of low priority, if that is all that keeps them from running compiled.

    When the child has succeeded this process switches to what it compiled.  Then, or when it has failed, ``on_done`` is
    called once with a line for people, in a thread of its own.  It is not called when there is nothing to compile:
    ``mode()`` and ``why()`` tell.  The child also ends when this process does.  Never raises."""
    child = None
    if switch.cold():
        with contextlib.suppress(OSError):
            child = spawn("--beside", str(os.getpid()), stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    return Background(child, on_done)
