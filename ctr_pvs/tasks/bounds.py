"""Which commands a search may try: limits, lengths and order as linear inequalities, and the damped least-squares step
that keeps them.

Commands are searched as x = (alpha, D / unit), (2 N,): one step of x is a radian, or ``unit`` metres of sliding.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.errors import FieldError
from ctr_pvs.robot.command import LARGEST_ALPHA
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.tasks.kinks import Kinks

Array = NDArray[np.float64]

#: One step of sliding, as a share of the longest tube.
SLIDE = 0.1
#: Of the active set: rounds before it is given up, and what counts as no step.
ROUNDS, NOTHING = 40, 1e-13
#: Closer to a bound than this is on it.
ON_BOUND = 1e-9


class Bounds:
    """A x <= b for the commands of ``robot`` within its limits and, if given, ``limits``.

    low, high : (2 N,) what each entry of (alpha, D) can reach [rad], [m], order counted; rows, right : A and b.
    """

    def __init__(self, robot: Robot, limits: Limits | None) -> None:
        own = _ranges(robot, robot.limits)
        asked = own if limits is None else _ranges(robot, Robot(robot.name, robot.tubes, limits).limits)
        N = robot.n_tubes
        low, high = np.maximum(own[0], asked[0]), np.minimum(own[1], asked[1])
        low[N:] = np.maximum.accumulate(low[N:])
        high[N:] = np.minimum.accumulate(high[N:][::-1])[::-1]
        if (low > high).any():
            raise FieldError("limits", limits, "limits that leave a command beside those of the robot")
        self.robot, self.low, self.high, self.tubes = robot, low, high, N
        self.unit = SLIDE * max(tube.length for tube in robot.tubes)
        self.scale = np.concatenate([np.ones(N), np.full(N, self.unit)])
        eye = np.eye(2 * N)
        order = eye[N : 2 * N - 1] - eye[N + 1 :]
        rows = np.concatenate([eye, -eye, order])
        right = np.concatenate([high / self.scale, -low / self.scale, np.zeros(N - 1)])
        self.kinks = Kinks(robot, self.unit)
        self._actuator = self._of_actuators()
        kept = np.abs(right) < LARGEST_ALPHA
        self.rows, self.right, self._actuator = rows[kept], right[kept], self._actuator[kept]

    def _of_actuators(self) -> NDArray[np.bool_]:
        """(5 N - 1,) true for rows that the actuators' limits are the reason of, not the tubes' lengths and order."""
        N = self.tubes
        lengths = np.array([tube.length for tube in self.robot.tubes])
        free_low, free_high = np.zeros(N), np.minimum.accumulate(lengths[::-1])[::-1]
        turns = np.ones(N, dtype=bool)
        return np.concatenate(
            [turns, self.high[N:] < free_high, turns, self.low[N:] > free_low, np.zeros(N - 1, dtype=bool)]
        )

    def scaled(self, alpha: Array, D: Array) -> Array:
        """x (2 N,) of a command."""
        return np.concatenate([alpha, D]) / self.scale

    def command(self, x: Array) -> tuple[Array, Array]:
        """alpha, D (N,) [rad], [m] of x, within the bounds to the last bit."""
        both = np.minimum(np.maximum(x * self.scale, self.low), self.high)
        alpha, D = both[: self.tubes], both[self.tubes :]
        return alpha, np.maximum.accumulate(D)

    def clamped(self, alpha: Array, D: Array) -> tuple[Array, Array]:
        """The command itself, or the nearest within the bounds."""
        return self.command(self.scaled(alpha, D))

    def contains(self, alpha: Array, D: Array) -> bool:
        """True for a command within the bounds, but for a rounding error."""
        return bool((self.rows @ self.scaled(alpha, D) <= self.right + ON_BOUND).all())

    def centre(self) -> tuple[Array, Array]:
        """A command to begin with: no rotation, tubes half out of what they can."""
        x = np.clip(0.0, self.low[: self.tubes], self.high[: self.tubes])
        return x, 0.5 * (self.low[self.tubes :] + self.high[self.tubes :])

    def turn_within(self, alpha: Array, turn: float) -> float:
        """The common rotation of all tubes, a whole number of turns from ``turn``, of least size that the limits allow
        from alpha (N,); that nearest to it where they allow none."""
        least = float((self.low[: self.tubes] - alpha).max())
        most = float((self.high[: self.tubes] - alpha).min())
        whole = 2.0 * np.pi
        turn = (turn + np.pi) % whole - np.pi
        ways = [turn, turn - np.copysign(whole, turn)]
        good = [way for way in ways if least <= way <= most]
        return good[0] if good else float(np.clip(turn, least, most))

    def inward(self, x: Array) -> Array:
        """(2 N,) a direction away from bounds that are near."""
        room = np.maximum(self.right - self.rows @ x, 0.0)
        return np.asarray(-(1.0 / (room + 0.2)) @ self.rows)

    def pressing(self, x: Array, gradient: Array) -> tuple[bool, list[str]]:
        """Whether limits of actuators, and which bounds at all, keep x from going down the ``gradient`` (2 N,)."""
        on = np.flatnonzero(self.right - self.rows @ x < 1e-6)
        held = [row for row in on.tolist() if self.rows[row] @ gradient < -1e-9 * np.abs(gradient).max()]
        names = [self._name(row) for row in held]
        return bool(self._actuator[held].any()), names

    def _name(self, row: int) -> str:
        entries = np.flatnonzero(self.rows[row])
        names = [f"alpha[{entry}]" if entry < self.tubes else f"D[{entry - self.tubes}]" for entry in entries.tolist()]
        if len(names) == 2:
            return f"{names[0]} <= {names[1]}"
        sign = "<=" if self.rows[row].sum() > 0.0 else ">="
        value = (self.high if sign == "<=" else self.low)[entries[0]]
        return f"{names[0]} {sign} {value:.6g}"

    def step(self, x: Array, hessian: Array, gradient: Array) -> Array:
        """The d (2 N,) of least d.H d / 2 + g.d with x + d within the bounds: H (2 N, 2 N) positive definite.

        A primal active set from d = 0: bounds that block are held, those that pull are let go.
        """
        room = np.maximum(self.right - self.rows @ x, 0.0)
        d = -np.linalg.solve(hessian, gradient)
        if (self.rows @ d <= room).all():
            return np.asarray(d)
        d, held = np.zeros(len(x)), list[int]()
        for _ in range(ROUNDS):
            move, push = _held_step(hessian, gradient + hessian @ d, self.rows[held])
            if np.abs(move).max() < NOTHING:
                if not held or push.min() >= 0.0:
                    break
                held.pop(int(push.argmin()))
                continue
            rates, left = self.rows @ move, room - self.rows @ d
            rates[held] = 0.0
            blocks = np.flatnonzero(rates > NOTHING)
            shares = np.maximum(left[blocks], 0.0) / rates[blocks]
            first = int(shares.argmin()) if len(shares) else -1
            if first >= 0 and shares[first] < 1.0:
                d = d + shares[first] * move
                held.append(int(blocks[first]))
            else:
                d = d + move
        return d


def _held_step(hessian: Array, gradient: Array, held: Array) -> tuple[Array, Array]:
    """The best move (n,) along the ``held`` rows (k, n), and how each of them pushes (k,): below 0 it may be let go."""
    n, k = len(gradient), len(held)
    both = np.zeros((n + k, n + k))
    both[:n, :n], both[:n, n:], both[n:, :n] = hessian, held.T, held
    solved = np.linalg.solve(both, np.concatenate([-gradient, np.zeros(k)]))
    return solved[:n], solved[n:]


def _ranges(robot: Robot, limits: Limits) -> tuple[Array, Array]:
    """Least and largest alpha, D (2 N,) by limits and lengths, order aside."""
    turns = [limit or (-LARGEST_ALPHA, LARGEST_ALPHA) for limit in limits.alpha]
    slides = [
        (0.0, tube.length) if limit is None else (max(limit[0], 0.0), min(limit[1], tube.length))
        for limit, tube in zip(limits.D, robot.tubes, strict=True)
    ]
    low, high = np.array([*turns, *slides]).T
    return low, high
