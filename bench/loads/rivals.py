"""Compiled solvers of others, and what they take under a tip force: measured once, elsewhere, never run here.

Measured for this project on 25 November 2026 on one shared x86-64 machine with 2 cores, with g++ 12 -O3, where u, one
``np.sin`` of 8 doubles, took 0.324 us in the same run: warm steps of 1 deg of tube 2 from 0 to 200 deg, the seed's
robot, 0.5 N across the tip.  Errors are of the tip, against shooting with DOP853 at 1e-12.
"""

from __future__ import annotations

from dataclasses import dataclass

#: Where and when.
MACHINE = "another machine, 25 November 2026: 2 shared x86-64 cores, g++ 12 -O3, u = 0.324 µs"


@dataclass(frozen=True)
class Rival:
    """One solver on one scene: microseconds and u of a step with its tip, tip error [m], u of a step with Jacobian and
    compliance (as text, empty where that is not known)."""

    name: str
    scene: str
    time_us: float
    time_u: float
    error_m: float
    derivatives: str = ""
    remark: str = ""


CANNULA = "CannulaKinematics (medlabprojects)"
TIM = "Modeling-and-Control (TIMClab-CAMI)"
FCP = "Concentric-Tube-Robot (fcpedrosa)"
PARTIAL, FULL = "Fig. 4, partial overlap", "Fig. 4, full overlap"
SHARPENED = "one smoothing length sharpened"

RIVALS = (
    Rival(CANNULA, PARTIAL, 79.0, 244.0, 1.3e-3, "1240 to 1370 u"),
    Rival(CANNULA, FULL, 70.0, 216.0, 0.50e-3, "1240 to 1370 u"),
    # Its error is one hard-wired smoothing length; its core is good for 6e-6 to 2e-5 mm at about 80 us without it.
    Rival(CANNULA, PARTIAL, 80.0, 250.0, 2e-8, remark=SHARPENED),
    Rival(TIM, PARTIAL, 96.0, 296.0, 0.09e-3, "497 u, Jacobian by differences, no compliance"),
    Rival(TIM, FULL, 95.0, 293.0, 0.48e-3, "497 u, Jacobian by differences, no compliance"),
    Rival(FCP, PARTIAL, 2015.0, 6200.0, 7e-8),
    Rival(FCP, FULL, 1078.0, 3300.0, 6e-8),
)
