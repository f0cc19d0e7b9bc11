"""A robot of another code as the text of a robot file, with comments on what became of its conventions."""

from __future__ import annotations

import json
import re

from ctr_pvs.robot.reading.foreign import ForeignRobot
from ctr_pvs.robot.reading.foreign import ForeignTube

_PLAIN = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


def robot_text(robot: ForeignRobot, source: str, name: str) -> str:
    """YAML that `load_robot` reads. source : what the comment says it was made of; name : where it has none."""
    order = "innermost first" if robot.innermost_first else "outermost first"
    title = robot.name or name
    lines = [
        f"# Converted by `ctr-pvs convert` from {' '.join(source.split())}, which has its tubes {order}.",
        "# SI units. Directions are those of a z-forward code: u_x is curvature_y, u_y is curvature_z, base angles are",
        "# alpha, D = -beta (docs/conventions.md). A curvature or radius without direction became curvature_y.",
        *_command(robot),
        f"name: {title if _PLAIN.fullmatch(title) else json.dumps(title)}",
        "tubes: # outermost first",
    ]
    for tube in robot.tubes:
        lines += _tube(tube)
    return "\n".join(lines) + "\n"


def _command(robot: ForeignRobot) -> list[str]:
    """The file's command, if it has one: that is no property of a robot."""
    words = []
    for option, values in (
        ("--alpha", [tube.alpha for tube in robot.tubes]),
        ("--D", [tube.D for tube in robot.tubes]),
    ):
        known = [_number(value) for value in values if value is not None]
        words += [option, *known] if len(known) == len(values) else []
    return [f"# Its command, for `ctr-pvs solve`: {' '.join(words)}"] if words else []


def _tube(tube: ForeignTube) -> list[str]:
    shear = [f"shear_modulus: {_number(tube.shear_modulus)} # Pa"] if tube.shear_modulus is not None else []
    ratio = [f"poissons_ratio: {_number(tube.poissons_ratio)}"] if tube.poissons_ratio is not None else []
    lines = [
        f"youngs_modulus: {_number(tube.youngs_modulus)} # Pa",
        *shear,
        *ratio,
        f"inner_diameter: {_number(tube.inner_diameter)} # m",
        f"outer_diameter: {_number(tube.outer_diameter)} # m",
        "segments: # from the base to the tip",
        *([f"  - {{length: {_number(tube.straight)}}} # m; straight"] if tube.straight else []),
        *([f"  - {{length: {_number(tube.curved)}{_curvature(tube.kappa)}"] if tube.curved else []),
    ]
    name = tube.name if _PLAIN.fullmatch(tube.name) else json.dumps(tube.name)
    return [f"  - name: {name}", *(f"    {line}" for line in lines)]


def _curvature(kappa: complex) -> str:
    parts = [f", curvature_y: [{_number(kappa.real)}]"] if kappa.real else []
    parts += [f", curvature_z: [{_number(kappa.imag)}]"] if kappa.imag else []
    radius = f"; radius {1e3 / abs(kappa):.5g} mm" if kappa else ""
    return f"{''.join(parts)}}} # 1/m{radius}" if kappa else "} # m; straight"


def _number(value: float) -> str:
    """Twelve digits: a factor of a unit leaves rounding behind that nobody wrote."""
    return f"{value:.12g}"
