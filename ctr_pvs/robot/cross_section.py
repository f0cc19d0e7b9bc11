"""Round tubes: what moduli and diameters make of stiffness, and diameters of area."""

from __future__ import annotations

import math


def annulus_area(inner_diameter: float, outer_diameter: float) -> float:
    """Area [m^2] of the material's cross section, pi/4 (d_o^2 - d_i^2); diameters in m."""
    return math.pi / 4.0 * (outer_diameter**2 - inner_diameter**2)


def annulus_stiffness(
    youngs_modulus: float, shear_modulus: float, inner_diameter: float, outer_diameter: float
) -> tuple[float, float]:
    """(K, G J) [N m^2] of a round tube: I = pi/64 (d_o^4 - d_i^4), J = 2 I.

    Args:
        youngs_modulus, shear_modulus: Pa.
        inner_diameter, outer_diameter: m.
    """
    second_moment = math.pi / 64.0 * (outer_diameter**4 - inner_diameter**4)
    return youngs_modulus * second_moment, shear_modulus * 2.0 * second_moment


def annulus_modulus(bending_stiffness: float, inner_diameter: float, outer_diameter: float) -> float:
    """Young's modulus [Pa] that gives a round tube of these diameters [m] its bending stiffness K [N m^2]."""
    return bending_stiffness / annulus_stiffness(1.0, 0.0, inner_diameter, outer_diameter)[0]


def shear_modulus_from_poisson(youngs_modulus: float, poissons_ratio: float) -> float:
    """G = E / (2 (1 + nu)) [Pa] of an isotropic material."""
    return youngs_modulus / (2.0 * (1.0 + poissons_ratio))


def torsional_from_poisson(bending_stiffness: float, poissons_ratio: float) -> float:
    """G J = K / (1 + nu) [N m^2] of any round section with K [N m^2], because J = 2 I."""
    return bending_stiffness / (1.0 + poissons_ratio)
