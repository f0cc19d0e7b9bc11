"""One of the processes that compile: it takes names of entry points from its input and answers each with a line.

A line is a JSON object: ``name``, ``seconds``, and ``error``, the text of what went wrong or null.  The end of the
input ends the process at once, whatever it is doing: so it also ends when the process that feeds it dies.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
import warnings
from pathlib import Path
from queue import SimpleQueue

from ctr_pvs.kernel.compiler import dispatchers
from ctr_pvs.kernel.compiler.registry import entries


def work(folder: Path) -> None:
    """Compile into ``folder`` what the input names, until it ends.  Does not return."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what libraries print must not come between the answers
    from numba.core.errors import NumbaPerformanceWarning

    warnings.simplefilter("error", NumbaPerformanceWarning)
    names: SimpleQueue[str] = SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            names.put(line.strip())
        os._exit(0)  # compiling in another thread is not worth a clean end: files appear whole or not at all

    threading.Thread(target=read, name="read", daemon=True).start()
    made = dispatchers.make(folder)
    known = {entry.name: entry for entry in entries()}
    while True:
        name = names.get()
        began, error = time.perf_counter(), None
        try:
            dispatchers.prepare(known[name], made[known[name].function])
        except Exception as problem:  # Numba's, of any kind
            error = f"{type(problem).__name__}: {problem}"
        answer = {"name": name, "seconds": time.perf_counter() - began, "error": error}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()
