"""Robots and synthetic measurements of known truth for the tests of calibration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.tasks.calibration.parameters import chosen
from ctr_pvs.tasks.calibration.registration import rotation
from ctr_pvs.tasks.calibration.table import Measurements
from ctr_pvs.tasks.calibration.tips import Frame
from ctr_pvs.tasks.calibration.tips import TipModel

ROBOT = Robot(
    "pair",
    (
        Tube("outer", (Segment(0.04, 0.05, 0.05 / 1.3), Segment(0.08, 0.05, 0.05 / 1.3, (7.0,)))),
        Tube("inner", (Segment(0.14, 0.02, 0.02 / 1.3), Segment(0.06, 0.02, 0.02 / 1.3, (14.0,)))),
    ),
)
FIT = ("bending", "curvature", "poisson", "alpha", "D", "registration")


def path(rng, rows):
    """A smooth path of commands, alpha (rows, 2) [rad] and D (rows, 2) [m]."""
    t = np.linspace(0.0, 1.0, rows)[:, None]
    waves = [rng.uniform(0.5, 1.0, 2) * np.sin(2 * np.pi * (rng.uniform(0.5, 2.5, 2) * t + rng.random(2)))
             for _ in range(2)]  # fmt: skip
    return 0.9 * waves[0], np.array([0.03, 0.09]) + np.array([0.01, 0.02]) * waves[1]


def measured(rng, rows, noise, fit=FIT, truth=None, robot=ROBOT, axes=False, spread=1.0):
    """Measurements of a robot whose parameters are drawn from their priors (``spread`` standard deviations), or are
    ``truth``; and the values of all parameters but the registration."""
    parameters = chosen(robot, fit)
    values = np.array([p.mean + spread * p.std * rng.standard_normal() if np.isfinite(p.std) else 0.0
                       for p in parameters])  # fmt: skip
    values = np.clip(values, [p.low for p in parameters], [p.high for p in parameters])
    for index, parameter in enumerate(parameters):
        values[index] = (truth or {}).get(parameter.name, values[index])
    alpha, D = path(rng, rows)
    blank = Measurements(alpha, D, np.zeros((rows, 3)), np.zeros((rows, 6 if axes else 0)))
    model = TipModel(robot, parameters, blank, True, 1e-6)
    if any(p.kind == "registration" for p in parameters):
        model.frame = Frame(rotation(rng.normal(size=3)), rng.normal(scale=0.2, size=3))
    position, directions = model.told(model.tips(values), values)
    noisy = position + noise * rng.standard_normal(position.shape)
    return replace(blank, position=noisy, axes=directions if axes else None), {
        p.name: v for p, v in zip(parameters, values.tolist(), strict=True) if p.kind != "registration"
    }
