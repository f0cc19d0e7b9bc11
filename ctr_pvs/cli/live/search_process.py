"""The process that looks for other equilibria; ``searcher`` starts it."""

from __future__ import annotations

import os
import sys
from contextlib import suppress
from multiprocessing.connection import Connection

from ctr_pvs.cli.live.others import Others
from ctr_pvs.cli.live.others import find_others

#: How much it stands back behind the page's process.
NICE = 5


def main() -> None:
    """Answers questions on the connection whose file descriptor is the first argument, until it is closed."""
    os.nice(NICE)
    connection = Connection(int(sys.argv[1]))
    with suppress(EOFError, OSError):
        robot, tolerance = connection.recv()
        while True:
            question = connection.recv()
            try:
                answer = find_others(robot, tolerance, question)
            except (ValueError, ArithmeticError) as error:
                answer = Others((), f"the search failed: {error}")
            connection.send(answer)


if __name__ == "__main__":
    main()
