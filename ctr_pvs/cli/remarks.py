"""What a command line says beside its answer, on standard error: warnings of the robot, and hints."""

from __future__ import annotations

import math
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING
from typing import TextIO

import numpy as np

from ctr_pvs.errors import CommandError
from ctr_pvs.errors import RobotWarning
from ctr_pvs.robot.loads import Loads

if TYPE_CHECKING:
    from ctr_pvs.answer.equilibrium import Equilibrium
    from ctr_pvs.solve.solver import EquilibriumSolver

TURN = 2.0 * math.pi
#: Tips closer than this [m], or than the tolerance allows for, are one.
SAME_TIP = 1e-4


@contextmanager
def robot_warnings_told() -> Iterator[None]:
    """Warnings of robots are one line each on standard error, whatever filters there are; others go their own way."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", RobotWarning)
        before = warnings.showwarning

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            if issubclass(category, RobotWarning):
                tell("warning", str(message))
            else:
                before(message, category, filename, lineno, file, line)

        warnings.showwarning = show
        yield


def tell(kind: str, text: str) -> None:
    """One line."""
    print(f"ctr-pvs: {kind}: {' '.join(text.splitlines())}", file=sys.stderr)


def turn_hints(
    solver: EquilibriumSolver, equilibrium: Equilibrium, tolerance: float, loads: Loads | None, degrees: bool
) -> list[str]:
    """A line where the command without its whole turns has another stable equilibrium; mostly none.

    Whole turns are those between a tube and the outermost: without them no two bases are more than half a turn apart
    from it. That is one more cold solve, and none where the command has no turns. Other equilibria may exist besides:
    `ctr_pvs.equilibria` lists them.
    """
    if not equilibrium.success:
        return []
    alpha = equilibrium.alpha
    unwound = alpha - TURN * np.round((alpha - alpha[0]) / TURN)
    if np.array_equal(unwound, alpha):
        return []
    try:
        other = solver.solve(unwound, equilibrium.D, loads=loads, start="cold")
    except CommandError:  # out of the robot's limits
        return []
    apart = math.dist(equilibrium.tip.position, other.tip.position) if other.success else 0.0
    if apart <= max(SAME_TIP, 10.0 * tolerance):
        return []
    shown = np.degrees(unwound) if degrees else unwound
    angles = " ".join(f"{angle + 0.0:.6g}" for angle in np.round(shown, 9))
    return [f"without whole turns, at --alpha {angles}, the same bases have another stable equilibrium, the tip "
            f"{1e3 * apart:.3g} mm from here: angles are not wrapped, docs/conventions.md says why"]  # fmt: skip
