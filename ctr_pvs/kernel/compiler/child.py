"""How this package starts itself in another process, and how such a process ends with the one that started it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from typing import Any

from ctr_pvs.kernel.compiler.cache import PACKAGE

#: Finds modules where the process that starts it does, whatever that one did to its path.
BOOTSTRAP = """
import sys
sys.path[:] = sys.argv.pop(1).split('\\n')
import runpy
runpy.run_module(sys.argv.pop(1), run_name='__main__', alter_sys=True)
"""
#: How often a process looks whether the one that started it is still there [s].
LOOK = 0.2


def spawn(*words: str, **options: Any) -> subprocess.Popen[str]:
    """Start ``python -m ctr_pvs.kernel words...``, out of reach of a Ctrl-C meant for this process."""
    if not sys.executable:
        raise OSError("no Python interpreter is known that could be started")
    start = [sys.executable, "-c", BOOTSTRAP, "\n".join(sys.path), PACKAGE]
    return subprocess.Popen([*start, *words], text=True, bufsize=1, process_group=0, **options)


def end_with_parent(parent: int) -> None:
    """End this process by SIGTERM, its clean-up included, once process ``parent`` is no longer the one above it."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(LOOK)
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=watch, name="end with parent", daemon=True).start()
