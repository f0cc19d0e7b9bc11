"""A torsion equilibrium as a ``Shape``, from scipy's solve_bvp and the field's equations: nothing of the solver.

The equations are those of ``ctr_pvs.oracles.standard_equations``.  The tubes are turned to their base angles in steps,
each from the solution before, so that the branch is the one a robot at rest is turned to.
"""

from __future__ import annotations

import numpy as np
from scipy.integrate import solve_bvp

from ctr_pvs.model.materials import Materials
from ctr_pvs.model.shape import Shape
from ctr_pvs.oracles.standard_equations import Problem
from ctr_pvs.oracles.standard_model import Collocation
from ctr_pvs.pvs.virtual_work import quadrature

#: Largest turn of a base in one step [rad].
STEP = 0.35


class BvpShape(Shape):
    """Fields of the boundary-value model at base angles ``alpha`` (N,) [rad] and base positions ``D`` (N,) [m].

    tolerance : relative residual of the equations.
    """

    def __init__(self, robot, alpha, D, tolerance=1e-10):
        steps = max(1, int(np.ceil(np.abs(alpha).max() / STEP)))
        x, y = np.linspace(0.0, 1.0, 11), None
        for share in np.arange(1, steps + 1) / steps:
            problem = Problem(robot, share * np.asarray(alpha), D)
            system = Collocation(problem)
            y = system.first_state(x, None) if y is None else y
            result = solve_bvp(
                system.rates,
                system.conditions,
                x,
                y,
                fun_jac=system.jacobian,
                bc_jac=system.conditions_jacobian,
                tol=tolerance,
                max_nodes=20_000,
            )
            assert result.success, result.message
            y = result.sol(x)
        super().__init__(Materials(robot, problem.domain), problem.alpha)
        self.problem, self._state, self._rows = problem, result.sol, system.rows
        self._ends = self._boundaries()

    def _boundaries(self):
        part, start = self.problem.sections[0], self._state(0.0)
        first = self.alpha.copy()
        torque = self.problem.torque_unit * start[part.p : 2 * part.p]
        first[part.tubes] += self.problem.guide_compliance[part.tubes] * torque
        ends = [first]
        for part, row in zip(self.problem.sections, self._rows, strict=True):
            last = ends[-1].copy()
            last[part.tubes] = self._state(1.0)[row : row + part.p]
            ends.append(last)
        return np.array(ends)

    @property
    def angle_at_boundaries(self):
        return self._ends

    def angle(self, m, x):
        part, row = self.problem.sections[m], self._rows[m]
        psi = np.tile(self._ends[m], (len(x), 1))
        psi[:, part.tubes] = self._state(x)[row : row + part.p].T
        return psi

    def twist_rate(self, m, x):
        part, row = self.problem.sections[m], self._rows[m]
        rate = np.zeros((len(x), len(self.alpha)))
        rate[:, part.tubes] = (self._state(x)[row + part.p : row + 2 * part.p].T) * part.compliance
        return rate

    def curvature(self, m, x):
        part = self.problem.sections[m]
        return part.curvature(part.start + part.length * x, self.angle(m, x)[:, part.tubes].T)


def elastic_energy(shape, nodes=24):
    """E [J] of a shape: twist and bending in every section, and what lies in the guide, twisted and straightened.

    nodes : a number of Gauss points on every panel, or the ``SectionNodes`` of every section.
    """
    materials = shape.materials
    if isinstance(nodes, int):
        nodes = quadrature(shape, nodes)
    guide = shape.angle_at_boundaries[0] - shape.alpha
    twisted = np.divide(guide**2, materials.guide_compliance, out=np.zeros_like(guide), where=guide != 0.0)
    energy = 0.5 * float(twisted.sum()) + float(materials.straightening_energy.sum())
    for node in nodes:
        m, x = node.section, node.rule.x
        strain = node.kappa - shape.curvature(m, x)[:, None] * np.exp(-1j * shape.angle(m, x))
        density = np.abs(strain) ** 2 @ node.bending + shape.twist_rate(m, x) ** 2 @ materials.torsional[m]
        energy += 0.5 * float(node.weight @ density)
    return energy
