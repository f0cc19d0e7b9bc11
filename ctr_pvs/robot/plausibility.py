"""What is possible but hardly meant: numbers of a robot that look as if they were in another unit.

Nothing is refused here. A robot in mm solves as well as one in m, and its forces are as wrong as its lengths, so
whoever reads them should hear of it. The thresholds are far from what is built: nitinol stays elastic up to a strain of
some 8 %, the longest robots have about 1 m, the thickest some 10 mm.
"""

from __future__ import annotations

import math

from ctr_pvs.robot.cross_section import annulus_modulus
from ctr_pvs.robot.dimensions import largest_curvature
from ctr_pvs.robot.dimensions import largest_strain
from ctr_pvs.robot.robot import Range
from ctr_pvs.robot.robot import Robot
from ctr_pvs.robot.robot import Tube

LARGEST_STRAIN = 0.10
SMALLEST_RADIUS = 5e-3  # m, of the pre-curvature of a tube whose diameter is not known
LENGTHS = (5e-3, 3.0)  # m, of a tube
OUTER_DIAMETERS = (20e-6, 30e-3)  # m
MODULI = (1e7, 1.3e12)  # Pa, Young's modulus that stiffness and diameters make; softest rubber to diamond
LARGEST_STIFFNESS = 1e3  # N m^2, of bending; a steel rod of 15 mm has 500
STIFFNESS_RATIOS = (0.02, 50.0)  # G J / K; 0.67 to 1 for plain tubes, patterned ones may be far from that
LARGEST_ANGLE = 50.0  # rad, of a limit; 8 turns


def implausible(robot: Robot) -> list[str]:
    """One line for each thing that looks wrong: the number, the threshold, the likely mistake. Mostly none."""
    found = []
    for tube, alpha, D in zip(robot.tubes, robot.limits.alpha, robot.limits.D, strict=True):
        remarks = [*_sizes(tube), *_stiffnesses(tube), *_strains(tube), *_limits(alpha, D)]
        found += [f"tube {tube.name!r}: {remark}" for remark in remarks]
    return found


def _sizes(tube: Tube) -> list[str]:
    found = []
    if tube.length > LENGTHS[1]:
        found.append(f"it is {tube.length:g} m long (over {LENGTHS[1]:g} m); is that in mm? Write length_mm, or e-3")
    elif tube.length < LENGTHS[0]:
        found.append(f"it is {tube.length:g} m long (under {LENGTHS[0]:g} m); was it divided by 1000 twice?")
    if tube.outer_diameter is None:
        return found
    outer = tube.outer_diameter
    if outer > OUTER_DIAMETERS[1]:
        found.append(f"its outer diameter is {outer:g} m (over {OUTER_DIAMETERS[1]:g} m); is that in mm? "
                     "Write outer_diameter_mm, or e-3")  # fmt: skip
    elif outer < OUTER_DIAMETERS[0]:
        found.append(
            f"its outer diameter is {outer:g} m (under {OUTER_DIAMETERS[0]:g} m); was it divided by 1000 twice?"
        )
    return found


def _stiffnesses(tube: Tube) -> list[str]:
    """Judged by the largest of the tube: patterned stretches are softer."""
    stiffness = max(segment.bending_stiffness for segment in tube.segments)
    found = _bending(stiffness, tube)
    ratios = [segment.torsional_stiffness / segment.bending_stiffness for segment in tube.segments]
    odd = max(ratios, key=lambda ratio: abs(math.log(ratio)))
    low, high = STIFFNESS_RATIOS
    if not low <= odd <= high:
        found.append(f"its torsional stiffness is {odd:.3g} times that of bending (plain tubes: 0.67 to 1; outside "
                     f"{low:g} to {high:g}); are both, or the moduli, in one unit?")  # fmt: skip
    return found


def _bending(stiffness: float, tube: Tube) -> list[str]:
    """A bending stiffness [N m^2] against the tube's diameters, or by itself."""
    told = f"its bending stiffness is {stiffness:g} N m^2"
    if tube.outer_diameter is None or tube.inner_diameter is None:
        if stiffness <= LARGEST_STIFFNESS:
            return []
        return [f"{told} (over {LARGEST_STIFFNESS:g} N m^2); is it in N mm^2? 1 N mm^2 is 1e-6 N m^2"]
    modulus = annulus_modulus(stiffness, tube.inner_diameter, tube.outer_diameter)
    told += f", with its diameters a Young's modulus of {modulus:.3g} Pa"
    if modulus > MODULI[1]:
        return [f"{told} (over {MODULI[1]:g} Pa); is it in N mm^2? 1 N mm^2 is 1e-6 N m^2"]
    if modulus < MODULI[0]:
        return [f"{told} (under {MODULI[0]:g} Pa); are moduli in MPa or GPa, or diameters in mm?"]
    return []


def _strains(tube: Tube) -> list[str]:
    """The most curved segment, if it is too curved."""
    curvatures = [largest_curvature(segment) for segment in tube.segments]
    largest = max(curvatures)
    where = f"segment {curvatures.index(largest) + 1}: its pre-curvature {largest:.4g} 1/m"
    guess = f"is that a radius in mm? Write radius_mm, or 1/radius: {1e3 / largest:.4g} 1/m" if largest else ""
    strain = largest_strain(tube)
    if tube.outer_diameter is None or strain is None:
        if largest * SMALLEST_RADIUS <= 1.0:
            return []
        return [f"{where} is a radius of {1e3 / largest:.3g} mm (under {1e3 * SMALLEST_RADIUS:g} mm); {guess}"]
    if strain <= LARGEST_STRAIN or tube.outer_diameter > OUTER_DIAMETERS[1]:  # of a wrong diameter is told already
        return []
    return [f"{where} strains a tube of {1e3 * tube.outer_diameter:g} mm by {100.0 * strain:.3g} % "
            f"(over {100.0 * LARGEST_STRAIN:g} %); {guess}"]  # fmt: skip


def _limits(alpha: Range | None, D: Range | None) -> list[str]:
    found = []
    if alpha is not None and max(map(abs, alpha)) > LARGEST_ANGLE:
        found.append(f"its limits of alpha are {alpha[0]:g} to {alpha[1]:g} rad (beyond {LARGEST_ANGLE:g} rad); "
                     "are they in degrees? Write alpha_deg")  # fmt: skip
    if D is not None and max(map(abs, D)) > LENGTHS[1]:
        found.append(f"its limits of D are {D[0]:g} to {D[1]:g} m (beyond {LENGTHS[1]:g} m); "
                     "are they in mm? Write D_mm")  # fmt: skip
    return found
