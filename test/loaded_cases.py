"""Robots and loads of ``data/loads_reference.json``, as the package has them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.robot.cross_section import annulus_stiffness
from ctr_pvs.robot.cross_section import shear_modulus_from_poisson
from ctr_pvs.robot.loads import ZERO
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

REFERENCE = json.loads((Path(__file__).parent / "data" / "loads_reference.json").read_text())


@dataclass(frozen=True)
class Case:
    """One command under loads, its numbers in SI; ``values`` are the file's own."""

    name: str
    robot: Robot
    alpha: np.ndarray
    D: np.ndarray
    loads: Loads
    relaxed: np.ndarray
    values: dict


def robot_of(name: str) -> Robot:
    tubes = REFERENCE["robots"][name]["tubes"]
    return Robot(
        name,
        tuple(Tube(f"t{i}", tuple(_segment(tube, part) for part in tube["segments"])) for i, tube in enumerate(tubes)),
    )


def _segment(tube: dict, part: dict) -> Segment:
    E = tube["youngs_modulus"]
    shear = tube.get("shear_modulus") or shear_modulus_from_poisson(E, tube["poissons_ratio"])
    K, GJ = annulus_stiffness(E, shear, tube["inner_diameter"], tube["outer_diameter"])
    curvature = (part["curvature"],) if "curvature" in part else _complex(part)
    K, GJ = part.get("bending_stiffness", K), part.get("torsional_stiffness", GJ)
    return Segment(part["length"], K, GJ, curvature, part.get("turn", 0.0))


def _complex(part: dict) -> tuple[complex, ...]:
    y, z = (part.get(key, []) for key in ("curvature_y", "curvature_z"))
    coefficients = np.zeros(max(len(y), len(z)), dtype=complex)
    coefficients[: len(y)] += y
    coefficients[: len(z)] += 1j * np.array(z)
    return tuple(coefficients.tolist())


def loads_of(told: dict) -> Loads:
    tip = told.get("tip", {})
    points = [
        PointForce(load["tube"] - 1, load["X"], load.get("force", ZERO), load.get("moment", ZERO))
        for load in told.get("points", [])
    ]
    lines = {load["tube"] - 1: load["force_per_length"] for load in told.get("distributed", [])}
    return Loads(tip.get("force", ZERO), tip.get("moment", ZERO), tuple(points), lines)


CASES = [
    Case(
        values["name"],
        robot_of(values["robot"]),
        np.radians(values["alpha_deg"]),
        np.array(values["D"]),
        loads_of(values["loads"]),
        np.radians(values["relaxed_alpha_deg"]),
        values,
    )
    for values in REFERENCE["cases"]
]
