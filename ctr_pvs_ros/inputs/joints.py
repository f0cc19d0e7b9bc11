"""The robot's joints as messages name and count them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ctr_pvs import Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Joints:
    """A rotation and a translation of each tube in turn, outermost first: 2N joints of N tubes.

    Attributes:
        names: (2N,).
        translation_sign: 1: a translation's position is D, the distance from the tube's base to the orifice; -1: it is
            -D, which others call beta. Forces are counted along it, too.
    """

    names: tuple[str, ...]
    translation_sign: int = 1

    @classmethod
    def of(cls, robot: Robot, prefix: str = "", translation_sign: int = 1) -> Joints:
        """`<prefix><tube>_rotation` and `<prefix><tube>_translation` of each tube."""
        kinds = ("rotation", "translation")
        return cls(tuple(f"{prefix}{tube.name}_{kind}" for tube in robot.tubes for kind in kinds), translation_sign)

    def in_turn(self, rotational: Array, translational: Array) -> list[float]:
        """(2N,) in the order of ``names``, of (N,) by rotation and (N,) along D: positions, or torques and forces."""
        values = [0.0] * len(self.names)
        values[0::2], values[1::2] = rotational.tolist(), self.along(translational).tolist()
        return values

    def apart(self, positions: Sequence[float]) -> tuple[Array, Array]:
        """alpha (N,) [rad] and D (N,) [m] of positions (2N,) in the order of ``names``."""
        values = np.array(positions, dtype=np.float64)
        return values[0::2], self.along(values[1::2])

    def along(self, translational: Array) -> Array:
        """What is counted along D, counted along the translations; and back."""
        return translational if self.translation_sign > 0 else -translational

    def pairs_along(self, pairs: Sequence[float]) -> list[float]:
        """A low and a high of each tube's translation, counted along D; and back."""
        lows, highs = pairs[0::2], pairs[1::2]
        if self.translation_sign < 0:
            lows, highs = [0.0 - high for high in highs], [0.0 - low for low in lows]
        return [value for pair in zip(lows, highs, strict=True) for value in pair]
