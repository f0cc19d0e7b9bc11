"""The backbone: poses at the tip and along a chain of pieces of constant or smooth curvature.

The curvature is that of the Bishop frame, which does not twist; material frames follow by a turn psi about the tangent.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.pieces import ORIFICE
from ctr_pvs.pieces import Piece
from ctr_pvs.pieces import State

Array = NDArray[np.float64]

#: Divisions of arc lengths over pieces that are kept: at one D the same places come again and again.
KEPT = 64
#: From spinors (Re a, Im a, Re b, -Im b) to quaternions (x, y, z, w).
QUATERNION = np.array([[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0]])
#: From paths (Re p, Im p, r, s) to positions (s - 2 r, 2 Im p, -2 Re p).
POSITION = np.array([[0.0, 0.0, -2.0], [0.0, 2.0, 0.0], [-2.0, 0.0, 0.0], [1.0, 0.0, 0.0]])


class Pose:
    """position (3,) [m] in the base frame, orientation (4,) unit quaternion x, y, z, w."""

    __slots__ = ("orientation", "position")

    def __init__(self, position: Array, orientation: Array) -> None:
        self.position, self.orientation = position, orientation


class Backbone:
    """Poses along the robot: s (n,) [m], position (n, 3) [m], orientation (n, 4) unit quaternions x, y, z, w."""

    __slots__ = ("orientation", "position", "s")

    def __init__(self, s: Array, position: Array, orientation: Array) -> None:
        self.s, self.position, self.orientation = s, position, orientation

    def __len__(self) -> int:
        return len(self.s)


def chain(pieces: Sequence[Piece]) -> list[State]:
    """The states where each of ``pieces`` starts, and where the last one ends."""
    states = [ORIFICE]
    for piece in pieces:
        states.append(piece.advance(states[-1]))
    return states


def position_of(state: State) -> Array:
    """Position (3,) [m] of ``state``."""
    _, _, p, r, s = state
    return np.array((s - 2.0 * r, 2.0 * p.imag, -2.0 * p.real))


def orientation_of(state: State, roll: float) -> Array:
    """Quaternion (4,) of material that is turned by ``roll`` [rad] against the Bishop frame of ``state``."""
    a, b = state[:2]
    e = cmath.rect(1.0 / math.hypot(a.real, a.imag, b.real, b.imag), 0.5 * roll)
    a, b = a * e, b * e.conjugate()
    return np.array((a.imag, b.real, b.imag, a.real))


def tip_pose(pieces: Sequence[Piece], end: State) -> Pose:
    """Pose of the material at the far ``end`` of ``pieces`` (one at least); its quaternion goes with the roll."""
    return Pose(position_of(end), orientation_of(end, pieces[-1].end_roll))


def poses(pieces: Sequence[Piece], s: Array) -> Backbone:
    """Poses of the material at increasing ``s`` (n,) [m] from 0 to the length of ``pieces`` (one at least).

    Quaternions are sign-continuous along s, and in time: the first one's sign follows the unwrapped roll.
    """
    spinors, paths = _trace(pieces, s, rolled=True)
    return Backbone(s, paths.dot(POSITION), spinors.dot(QUATERNION))


def bishop_frames(pieces: Sequence[Piece], s: Array) -> tuple[Array, Array]:
    """Rotations (n, 3, 3) of the Bishop frame, which starts as the identity, and positions (n, 3) [m] at increasing
    ``s`` (n,) [m]."""
    spinors, paths = _trace(pieces, s, rolled=False)
    a, c = spinors.view(complex).T  # b is conj(c)
    image_y, image_z = a * a + (c * c).conj(), 1j * (a * a - (c * c).conj())
    mixed, tangent = a * c, -2j * a * c.conj()
    rotation = np.empty((len(s), 3, 3))
    rotation[:, 0, 0] = 1.0 - 2.0 * (c * c.conj()).real
    rotation[:, 1, 0], rotation[:, 2, 0] = tangent.real, tangent.imag
    rotation[:, 0, 1], rotation[:, 0, 2] = 2.0 * mixed.imag, 2.0 * mixed.real
    rotation[:, 1, 1], rotation[:, 2, 1] = image_y.real, image_y.imag
    rotation[:, 1, 2], rotation[:, 2, 2] = image_z.real, image_z.imag
    return rotation, paths.dot(POSITION)


def _trace(pieces: Sequence[Piece], s: Array, rolled: bool) -> tuple[Array, Array]:
    """Spinors (n, 4) of norm 1 and paths (n, 4) at ``s``, see ``pieces``."""
    shares = _shares(tuple([(type(piece), piece.length, piece.nodes) for piece in pieces]), s.tobytes())
    spinors, paths = np.empty((len(s), 4)), np.empty((len(s), 4))
    state = ORIFICE
    last = len(pieces) - 1
    for number, (piece, (here, places)) in enumerate(zip(pieces, shares, strict=True)):
        if places is not None:
            piece.trace(state, places, spinors[here], paths[here], rolled)
        if number < last:
            state = piece.advance(state)
    return spinors, paths


@lru_cache(maxsize=KEPT)
def _shares(layout: tuple[tuple[type[Piece], float, int], ...], places: bytes) -> list[tuple[slice, Any]]:
    """For each piece of ``layout`` (type, length, nodes) the rows of the arc lengths ``places`` that lie on it, with
    what the piece prepares for them; a boundary counts to the piece before it."""
    s = np.frombuffer(places)
    ends = np.cumsum([length for _, length, _ in layout])
    rows = np.searchsorted(s, ends[:-1], side="right")
    shares: list[tuple[slice, Any]] = []
    for (kind, length, nodes), (first, last), end in zip(layout, pairwise([0, *rows, len(s)]), ends, strict=True):
        inside = np.clip(s[first:last] - (end - length), 0.0, length)
        shares.append((slice(first, last), kind.prepare(inside, length, nodes) if last > first else None))
    return shares
