"""Jobs in a process of their own, which knows nothing of ROS: they come in and what came of them goes out.

The node starts it. It does one job after the other, in the order in which they come, each within its deadline. The end
of the connection to the node is its end, whatever it is doing.
"""

from __future__ import annotations

import os
import queue
import sys
import threading
from multiprocessing.connection import Connection

from ctr_pvs_ros.service.jobs import Job
from ctr_pvs_ros.service.jobs import LookForKernels
from ctr_pvs_ros.service.jobs import Ready
from ctr_pvs_ros.service.jobs import SolverOptions
from ctr_pvs_ros.service.jobs import do


def _listen(connection: Connection, waiting: queue.SimpleQueue[Job | LookForKernels]) -> None:
    """Line up what comes; end the process, even in mid-solve, with the connection."""
    try:
        while True:
            waiting.put(connection.recv())
    except (EOFError, OSError):
        os._exit(0)


def main() -> None:
    """Serve the connection whose file descriptor is the first argument."""
    connection = Connection(int(sys.argv[1]))
    options: SolverOptions = connection.recv()
    waiting: queue.SimpleQueue[Job | LookForKernels] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(connection, waiting), daemon=True).start()
    solver = options.new_solver()
    from ctr_pvs.kernel import compiler

    connection.send(Ready())
    while True:
        job = waiting.get()
        if isinstance(job, LookForKernels):
            compiler.use_compiled()
        else:
            connection.send(do(solver, job))


if __name__ == "__main__":
    main()
