"""Robots of the live page's tests, and a command with several equilibria."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ctr_pvs.cli.live.others import Question

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "three_tubes.yaml")
SEED = ROOT / "config" / "renda2021.yaml"
#: Three equilibria, of the seed's robot.
TURNED = Question(np.array([0.0, 4.0]), np.array([0.0935, 0.2085]), np.zeros(3))
