"""From the unknowns of a batch back to what single commands have: states to read every output from, and margins."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.batch_layout import Geometry
from ctr_pvs.batch_linear import circle
from ctr_pvs.batch_linear import packed_entries
from ctr_pvs.batch_tables import Tables
from ctr_pvs.batch_values import Values
from ctr_pvs.batch_walk import Problem
from ctr_pvs.batch_walk import check
from ctr_pvs.energy import TorsionEnergy
from ctr_pvs.materials import Materials
from ctr_pvs.sections import piecewise_domain
from ctr_pvs.serve import Position
from ctr_pvs.serving import ServingModel
from ctr_pvs.serving import raised

Array = NDArray[np.float64]

#: Rows that are looked at together.
TOGETHER = 4096


def rebuilt(tables: Tables, u: Array, alpha: Array, D: Array, tolerance: float, twists: bool) -> Position | None:
    """The state of one row: unknowns ``u`` (n,), the command (N,) each; None where the last digits decide whether it is
    certainly stable."""
    materials = Materials(tables.layout.robot, piecewise_domain(tables.layout.robot, D))
    model = ServingModel(TorsionEnergy(materials, raised(tables.degree)), tables.degree)
    values = Values(tables, Geometry(tables.layout, D[:, None]), tolerance)
    slack = float(values.slack[0])
    if not twists:
        served = model.untwisted(alpha, None, slack)
    else:
        q = u / np.sqrt(materials.domain.lengths[tables.section[: model.n]])
        if tables.lead:
            torque = values.features(u[:, None])[model.n + tables.tubes :, 0]
            block = model.energy.space.blocks[0]
            q[: tables.lead] = block.frame.T @ (block.scale * torque)
        served = model.solve(np.concatenate([q, alpha, [1.0]]), None, slack)
    return None if served is None else Position(alpha, D, [served], twists)


def tip_estimates(tables: Tables, u: Array, alpha: Array, D: Array, tolerance: float) -> Array:
    """(rows,) estimates of the tip error [m] by discretisation: see ``Served.tip_estimate``."""
    out = np.zeros(u.shape[1])
    for part, problem in _problems(tables, alpha, D, tolerance):
        good, count = np.ones(problem.rows, dtype=bool), np.zeros(problem.rows, dtype=np.int64)
        change = check(problem, u[:, part], good, count, settled=False).change
        if tables.n:
            out[part] = problem.values.tip_motion(change * problem.values.tip_shares())
    return out


def margins(tables: Tables, u: Array, alpha: Array, D: Array, tolerance: float) -> Array:
    """(rows,) stability margins for unknowns (n, rows) and commands (N, rows): see ``ServingModel.margin``."""
    out = np.ones(u.shape[1])
    if not tables.n:
        return out
    row, column = packed_entries(tables.finer)
    for part, problem in _problems(tables, alpha, D, tolerance):
        packed = problem.hessian(circle(problem.angles(u[:, part], problem.alpha))[0], tables.finer_hessian)
        full = np.empty((packed.shape[1], tables.finer, tables.finer))
        full[:, row, column] = full[:, column, row] = packed.T
        units = _units(problem.values)
        out[part] = np.minimum(1.0, np.linalg.eigvalsh(units.transpose(0, 2, 1) @ full @ units)[:, 0])
    return out


def _problems(tables: Tables, alpha: Array, D: Array, tolerance: float) -> Iterator[tuple[slice, Problem]]:
    """Some rows at a time."""
    same = alpha.shape[1] > 0 and not np.any(D[:, :1] != D)
    for start in range(0, alpha.shape[1], TOGETHER):
        part = slice(start, start + TOGETHER)
        values = Values(tables, Geometry(tables.layout, D[:, :1] if same else D[:, part]), tolerance)
        yield part, Problem(tables, values, alpha[:, part])


def _units(values: Values) -> Array:
    """(K, finer, finer) u per unit of unknowns whose torsional energy is half their square."""
    tables, r = values.tables, values.tables.lead
    out = np.zeros((values.compliance.shape[1], tables.finer, tables.finer))
    index = np.arange(tables.finer)
    out[:, index, index] = np.sqrt(values.compliance.T)
    if r > 1:  # the tubes' angles against the first one's: its compliance is in all of them
        relative = np.zeros((len(out), r, r)) + values.lead[tables.leading[0]][:, None, None]
        relative[:, index[:r], index[:r]] += values.compliance[:r].T
        out[:, :r, :r] = np.linalg.cholesky(relative)
    return out
