"""Where the tip should be: how far it is from there, and how that changes with the command."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.errors import FieldError

Array = NDArray[np.float64]

#: How many metres a radian counts as.
LEVER = 0.02


class Aim:
    """A position (3,) [m], and either the tangent there (3,) or the whole orientation (4,), quaternion x, y, z, w.

    within [m] and within_angle [rad] : how near is there.
    """

    def __init__(
        self, position: ArrayLike, tangent: ArrayLike | None = None, orientation: ArrayLike | None = None,
        within: float = 1e-6, within_angle: float = 1e-4,
    ) -> None:  # fmt: skip
        if tangent is not None and orientation is not None:
            raise FieldError("tangent", tangent, "None beside an orientation, which holds the tangent")
        self.position = _vector("position", position, 3)
        self.tangent = None if tangent is None else _unit("tangent", tangent, 3)
        self.orientation = None if orientation is None else _unit("orientation", orientation, 4)
        self.within, self.within_angle = _positive("within", within), _positive("within_angle", within_angle)

    @property
    def turns(self) -> bool:
        """True if more than a position is asked for."""
        return self.tangent is not None or self.orientation is not None

    def residual(self, answer: Equilibrium) -> Array:
        """(3,) or (6,) [m]: how far the tip is off, a rotation times ``LEVER``."""
        tip = answer.tip
        off = tip.position - self.position
        if not self.turns:
            return off
        return np.concatenate([off, LEVER * self._rotation(tip.orientation)])

    def jacobian(self, answer: Equilibrium) -> Array:
        """(3 or 6, 2 N) rates of the residual with alpha [m/rad] and D."""
        return self.moved(answer, answer.jacobian)

    def moved(self, answer: Equilibrium, rates: Array) -> Array:
        """(3 or 6, n) rates of the residual where the tip, position and rotation, has ``rates`` (6, n)."""
        if self.orientation is not None:
            return np.concatenate([rates[:3], LEVER * rates[3:]])
        if self.tangent is not None:
            x, y, z = tangent_of(answer.tip.orientation).tolist()
            turned = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])  # d tangent = rotation x tangent
            return np.concatenate([rates[:3], LEVER * turned @ rates[3:]])
        return np.asarray(rates[:3])

    def miss(self, position: Array, orientation: Array) -> Array:
        """(M,) [m^2] squared residuals of tips at positions (M, 3) with orientations (M, 4)."""
        square = ((position - self.position) ** 2).sum(axis=1)
        if self.turns:
            square += LEVER**2 * (self._rotation(orientation) ** 2).sum(axis=1)
        return np.asarray(square)

    def distance(self, answer: Equilibrium) -> float:
        """[m] from the tip to the position."""
        return float(np.linalg.norm(answer.tip.position - self.position))

    def angle(self, answer: Equilibrium) -> float:
        """[rad] between the tip's tangent, or orientation, and the one asked for; 0 where none is."""
        off = float(np.linalg.norm(self._rotation(answer.tip.orientation))) if self.turns else 0.0
        return off if self.tangent is None else 2.0 * float(np.arcsin(min(1.0, 0.5 * off)))

    def met(self, answer: Equilibrium) -> bool:
        return self.distance(answer) <= self.within and (not self.turns or self.angle(answer) <= self.within_angle)

    def turn_from(self, position: Array) -> Array:
        """(..,) the rotation [rad] about +x that brings positions (.., 3) into the target's half plane; 0 from and to
        the axis."""
        (y, z), (py, pz) = self.position[1:], (position[..., 1], position[..., 2])
        off_axis = (np.hypot(py, pz) > 1e-9) & (np.hypot(y, z) > 1e-9)
        return np.where(off_axis, np.arctan2(z * py - y * pz, y * py + z * pz), 0.0)

    def _rotation(self, orientation: Array) -> Array:
        """(.., 3) the difference of tangents, or the rotation vector [rad] from the orientation asked for to
        ``orientation`` (.., 4)."""
        if self.orientation is None:
            return np.asarray(tangent_of(orientation) - (0.0 if self.tangent is None else self.tangent))
        x, y, z, w = self.orientation
        product = quaternion_product(orientation, np.array([-x, -y, -z, w]))
        product = np.where(product[..., 3:] < 0.0, -product, product)
        vector, size = product[..., :3], np.linalg.norm(product[..., :3], axis=-1, keepdims=True)
        angle = 2.0 * np.arctan2(size, product[..., 3:])
        return np.asarray(vector * np.where(size > 1e-12, angle / np.maximum(size, 1e-12), 2.0))


def tangent_of(orientation: Array) -> Array:
    """(.., 3) first axis of the frames that quaternions (.., 4) x, y, z, w stand for."""
    x, y, z, w = np.moveaxis(orientation, -1, 0)
    return np.stack([1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + z * w), 2.0 * (x * z - y * w)], axis=-1)


def quaternion_product(left: Array, right: Array) -> Array:
    """(.., 4) the rotation ``right``, then ``left``."""
    a, b, c, d = np.moveaxis(left, -1, 0)
    x, y, z, w = np.moveaxis(right, -1, 0)
    return np.stack(
        [
            d * x + a * w + b * z - c * y,
            d * y - a * z + b * w + c * x,
            d * z + a * y - b * x + c * w,
            d * w - a * x - b * y - c * z,
        ],
        axis=-1,
    )


def turned_about_x(turn: Array, position: Array, orientation: Array) -> tuple[Array, Array]:
    """Positions (M, 3) and quaternions (M, 4), all turned by ``turn`` (M,) [rad] about the insertion axis."""
    c, s = np.cos(turn), np.sin(turn)
    x, y, z = position.T
    turned = np.stack([x, c * y - s * z, s * y + c * z], axis=1)
    zero = np.zeros_like(turn)
    half = np.stack([np.sin(0.5 * turn), zero, zero, np.cos(0.5 * turn)], axis=1)
    return turned, quaternion_product(half, orientation)


def _vector(name: str, value: ArrayLike, count: int) -> Array:
    try:
        array = np.asarray(value)
    except ValueError:  # lists of unequal lengths
        array = np.empty(0)
    if array.shape != (count,) or array.dtype.kind not in "iuf" or not np.isfinite(array).all():
        raise FieldError(name, value, f"{count} finite numbers")
    return array.astype(np.float64)


def _unit(name: str, value: ArrayLike, count: int) -> Array:
    vector = _vector(name, value, count)
    size = float(np.linalg.norm(vector))
    if not size > 0.0:
        raise FieldError(name, value, f"{count} numbers that are not all 0")
    return vector / size


def _positive(name: str, value: float) -> float:
    if not 0.0 < value < np.inf:
        raise FieldError(name, value, "a number above 0")
    return float(value)
