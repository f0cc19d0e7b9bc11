"""Robot files as text."""

from __future__ import annotations

import warnings
from pathlib import Path

from ctr_pvs.errors import RobotWarning
from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Robot

GOOD = """\
name: pair
tubes:
  - name: outer
    youngs_modulus: 58.0e9
    shear_modulus: 21.5e9
    inner_diameter: 2.01e-3
    outer_diameter: 2.39e-3
    segments:
      - {length: 93.5e-3}
      - {length: 92.3e-3, curvature_y: [9.9]}
  - name: inner
    bending_stiffness: 0.018
    torsional_stiffness: 0.013
    segments:
      - {length: 0.2}
limits:
  alpha: {inner: [-3, 3]}
  D: {outer: [0, 0.1]}
"""


def load_text(tmp_path: Path, text: str | bytes) -> Robot:
    """The robot; what is odd about its numbers is not of interest here."""
    path = tmp_path / "robot.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return load_robot(path)


def one_tube(material: str, segment: str = "length: 0.1") -> str:
    return f"name: r\ntubes:\n  - name: t\n    {material}\n    segments:\n      - {{{segment}}}\n"
