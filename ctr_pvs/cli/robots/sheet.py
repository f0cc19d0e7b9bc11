"""What is to be said of a robot, in SI units and plain values: the JSON of ctr-pvs info, of which its text is made."""

from __future__ import annotations

import itertools
from typing import Any

from ctr_pvs.errors import FieldError
from ctr_pvs.oracles.tip_curve import TipCurve
from ctr_pvs.oracles.tube_pair import materials_at
from ctr_pvs.oracles.tube_pair import tube_pair
from ctr_pvs.oracles.two_tubes import critical_lambda
from ctr_pvs.oracles.two_tubes import two_tube_parameters
from ctr_pvs.robot.dimensions import clearance
from ctr_pvs.robot.dimensions import largest_strain
from ctr_pvs.robot.dimensions import tube_curvature
from ctr_pvs.robot.plausibility import implausible
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Segment
from ctr_pvs.robot.robot import Tube


def sheet(robot: Robot) -> dict[str, Any]:
    """Keys and values as docs/command_line.md lists them; None for what is not known."""
    return {
        "robot": robot.name,
        "tubes": [_tube(tube) for tube in robot.tubes],
        "clearances": [clearance_entry(outer, inner) for outer, inner in itertools.pairwise(robot.tubes)],
        "pairs": [_pair(outer, inner) for outer, inner in itertools.combinations(robot.tubes, 2)],
        "limits": [_limits(robot, index) for index in range(robot.n_tubes)],
        "warnings": implausible(robot),
    }


def tube_entry(tube: Tube) -> dict[str, Any]:
    """Dimensions of one tube, and what straightening strains it by."""
    return {
        "name": tube.name,
        "length": tube.length,
        "inner_diameter": tube.inner_diameter,
        "outer_diameter": tube.outer_diameter,
        "largest_curvature": tube_curvature(tube),
        "largest_strain": largest_strain(tube),
    }


def clearance_entry(outer: Tube, inner: Tube) -> dict[str, Any]:
    """Of two neighbours."""
    return {"outer": outer.name, "inner": inner.name, "diametral": clearance(outer, inner)}


def _tube(tube: Tube) -> dict[str, Any]:
    segments = [
        _segment(segment, begin, end)
        for segment, (begin, end) in zip(tube.segments, itertools.pairwise(tube.breaks.tolist()), strict=True)
    ]
    return {**tube_entry(tube), "density": tube.density, "segments": segments}


def _segment(segment: Segment, begin: float, end: float) -> dict[str, Any]:
    first, last = segment.pre_curvature([0.0, segment.length]).tolist()
    return {
        "from": begin,
        "to": end,
        "bending_stiffness": segment.bending_stiffness,
        "torsional_stiffness": segment.torsional_stiffness,
        "curvature_at_base": [first.real, first.imag],
        "curvature_at_tip": [last.real, last.imag],
        "turn": segment.turn,
        "straight": segment.is_straight,
    }


def _pair(outer: Tube, inner: Tube) -> dict[str, Any]:
    """The two by themselves, with all that is straight before their curved parts in the guide."""
    found: dict[str, Any] = {"outer": outer.name, "inner": inner.name, "D": None, "lambda": None, "b": None}
    found |= {"critical_lambda": None, "snap_free": None}
    first, second = (_first_curved(tube) for tube in (outer, inner))
    if first is None or second is None:
        return found | {"snap_free": True}
    D = [first, max(first, second)]  # of an inner tube that is curved farther back, more than that is in the guide
    pair = Robot("pair", (outer, inner))
    found["D"] = D
    try:
        two = two_tube_parameters(pair, D)
    except FieldError:
        return found | {"snap_free": _without_folds(pair, D)}
    return found | {
        "lambda": two.lam,
        "b": two.b,
        "critical_lambda": critical_lambda(two.b),
        "snap_free": two.snap_free,
    }


def _first_curved(tube: Tube) -> float | None:
    """Where the first curved segment begins [m]."""
    return next(
        (float(x) for x, segment in zip(tube.breaks, tube.segments, strict=False) if not segment.is_straight), None
    )


def _without_folds(pair: Robot, D: list[float]) -> bool | None:
    """Whether every rotation has one equilibrium; None where the curve of all of them was not resolved."""
    coupled = tube_pair(materials_at(pair, D))
    if coupled is None:
        return True
    curve = TipCurve(coupled)
    if curve.folds:
        return False
    return True if curve.resolved else None


def _limits(robot: Robot, index: int) -> dict[str, Any]:
    tube, alpha, D = robot.tubes[index], robot.limits.alpha[index], robot.limits.D[index]
    low, high = D or (0.0, tube.length)
    return {"name": tube.name, "alpha": list(alpha) if alpha else None, "D": [max(low, 0.0), min(high, tube.length)]}
