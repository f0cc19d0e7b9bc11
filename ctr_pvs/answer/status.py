"""What came of a solve: a status and a message travel with every answer."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """Outcome of a solve; the value is its name in messages and files."""

    OK = "ok"
    SNAP = "snap"
    NO_STABLE_EQUILIBRIUM = "no_stable_equilibrium"
    NOT_CONVERGED = "not_converged"
    TOLERANCE_MISSED = "tolerance_missed"
    TIMEOUT = "timeout"

    @property
    def success(self) -> bool:
        """True if the answer is a stable equilibrium within tolerance."""
        return self is Status.OK or self is Status.SNAP


class NoEquilibriumError(RuntimeError):
    """Asked an answer without an equilibrium for a shape or a load."""
