"""What the model says of the measured rows, and how that changes with the parameters.

Rows are followed in their order, one warm start after another, so that branches are those of the path; or each is a
cold start.  Columns of joints come from the tip's Jacobian, those of play by its operator's rule, registration and
sensor in closed form, and those of the tubes by reciprocity (``rates``).  Only where a force acts on the tip are the
tubes' columns central differences of solves: bending is free there, and ``rates`` knows no loads.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.answer.equilibrium import Equilibrium
from ctr_pvs.answer.shape import TorsionShape
from ctr_pvs.answer.status import NoEquilibriumError
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.play import NO_PLAY
from ctr_pvs.robot.play import Play
from ctr_pvs.robot.robot import Limits
from ctr_pvs.robot.robot import Robot
from ctr_pvs.solve.solver import EquilibriumSolver
from ctr_pvs.tasks.calibration.parameters import Parameter
from ctr_pvs.tasks.calibration.parameters import robot_with
from ctr_pvs.tasks.calibration.rates import TubeRates
from ctr_pvs.tasks.calibration.rates import tube_rates
from ctr_pvs.tasks.calibration.registration import left_jacobian
from ctr_pvs.tasks.calibration.registration import matrices
from ctr_pvs.tasks.calibration.registration import rotation
from ctr_pvs.tasks.calibration.table import Measurements

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

OF_TUBES = ("bending", "torsion", "poisson", "curvature", "length")
#: Step of central differences, in units of a parameter's scale, and the tolerance [m] of solves that are differenced.
STEP, TIGHT = 1e-3, 1e-8


@dataclass(frozen=True, eq=False)
class Frame:
    """How the robot's base lies in the frame of the measurement at first: rotation (3, 3), translation (3,) [m]."""

    rotation: Array
    translation: Array


@dataclass(frozen=True, eq=False)
class Tips:
    """Of M rows: position (M, 3) [m] and frame (M, 3, 3) of the tip in base axes, length (M,) [m] out of the orifice;
    NaN where the model has no equilibrium."""

    position: Array
    frame: Array
    length: Array
    answers: list[Equilibrium]
    joints: Array
    joint_rates: Array


class TipModel:
    """Tips of ``robot`` at the rows of ``data`` for values of ``parameters``.

    history : rows are a path.  tolerance : of the tip [m].  Limits of the robot's actuators are left aside, and of its
    play what is not fitted is kept.
    """

    def __init__(
        self, robot: Robot, parameters: Sequence[Parameter], data: Measurements, history: bool, tolerance: float
    ) -> None:
        self.robot = replace(robot, limits=Limits(), play=NO_PLAY)
        self.parameters, self.data, self.history, self.tolerance = parameters, data, history, tolerance
        self.widths = robot.play.of(robot.n_tubes)
        self.loads = _loads(data)
        self.frame = Frame(np.eye(3), np.zeros(3))

    def columns(self, *kinds: str) -> list[int]:
        """Places of the parameters of these kinds."""
        return [index for index, parameter in enumerate(self.parameters) if parameter.kind in kinds]

    def tips(self, values: Array) -> Tips:
        """Solves all rows at these ``values`` (P,)."""
        return self._follow(robot_with(self.robot, self.parameters, values), *self._joints(values), self.tolerance)

    def told(self, tips: Tips, values: Array) -> tuple[Array, Array]:
        """Position (M, 3) [m] of the sensor, and axes (M, 3 a) of the tip, in the frame of the measurement."""
        R, t, sensor = self.placed(values)
        axes = np.moveaxis(tips.frame, 2, 1)[:, : self.data.n_axes]
        return (tips.position + tips.frame @ sensor) @ R.T + t, (axes @ R.T).reshape(len(tips.position), -1)

    def placed(self, values: Array) -> tuple[Array, Array, Array]:
        """Rotation (3, 3) and translation (3,) [m] of the base in the frame of the measurement, offset (3,) [m] of the
        sensor in that of the tip."""
        turn, moved, sensor = np.zeros((3, 3))
        for index in self.columns("registration"):
            segment = self.parameters[index].segment
            (turn if segment < 3 else moved)[segment % 3] = values[index]
        for index in self.columns("sensor"):
            sensor[self.parameters[index].segment] = values[index]
        return rotation(turn) @ self.frame.rotation, self.frame.translation + moved, sensor

    def jacobian(self, tips: Tips, values: Array, rows: Mask) -> Array:
        """(M, 3 + 3 a, P) rates of ``told``; zeros for rows that are not among ``rows`` and those without an answer."""
        M, a = len(self.data), self.data.n_axes
        R, _, sensor = self.placed(values)
        out = np.zeros((M, 3 + 3 * a, len(self.parameters)))
        moved = np.zeros((M, 6, len(self.parameters)))
        for index in np.flatnonzero(rows & np.isfinite(tips.position[:, 0])).tolist():
            self._moved(tips, values, index, moved[index])
        if self.loads is not None and self.columns(*OF_TUBES):
            self._differences(values, moved)
        arm = tips.frame @ sensor
        out[:, :3] = moved[:, :3] + np.cross(moved[:, 3:], arm[:, :, None], axis=1)
        for k in range(a):
            out[:, 3 + 3 * k : 6 + 3 * k] = np.cross(moved[:, 3:], tips.frame[:, :, k, None], axis=1)
        out = (R @ out.reshape(M, 1 + a, 3, -1)).reshape(out.shape)
        self._placing_rates(tips, values, out)
        return np.where((rows & np.isfinite(tips.position[:, 0]))[:, None, None], out, 0.0)

    def _placing_rates(self, tips: Tips, values: Array, out: Array) -> None:
        """Columns of registration and sensor, in closed form."""
        R, t, _ = self.placed(values)
        position, axes = self.told(tips, values)
        turn = np.zeros(3)
        for index in self.columns("registration"):
            if self.parameters[index].segment < 3:
                turn[self.parameters[index].segment] = values[index]
        turned = left_jacobian(turn)
        for index in self.columns("registration"):
            part = self.parameters[index].segment
            if part >= 3:
                out[:, part - 3, index] = 1.0
                continue
            out[:, :3, index] = np.cross(turned[:, part], position - t)
            for k in range(self.data.n_axes):
                out[:, 3 + 3 * k : 6 + 3 * k, index] = np.cross(turned[:, part], axes[:, 3 * k : 3 * k + 3])
        for index in self.columns("sensor"):
            out[:, :3, index] = tips.frame[:, :, self.parameters[index].segment] @ R.T

    def _moved(self, tips: Tips, values: Array, row: int, out: Array) -> None:
        """Rates (6, P) of one row's tip, position and rotation in base axes, into ``out``."""
        answer, N = tips.answers[row], self.robot.n_tubes
        try:
            joints = answer.jacobian
        except NoEquilibriumError:  # the edge of a snap: it has no rates
            return
        shape = answer.shape
        wanted = self.loads is None and bool(self.columns(*OF_TUBES))
        tubes = tube_rates(shape, bool(self.columns("length"))) if wanted and isinstance(shape, TorsionShape) else None
        joints = np.where(np.concatenate(answer.command_at_tubes) == tips.joints[row], joints, 0.0)  # clamped ones rest
        for index, parameter in enumerate(self.parameters):
            kind, j = parameter.kind, parameter.tube
            if kind in ("alpha", "D"):
                out[:, index] = joints[:, j + (N if kind == "D" else 0)]
            elif kind in ("play_alpha", "play_D"):
                joint = j + (N if kind == "play_D" else 0)
                out[:, index] = joints[:, joint] * tips.joint_rates[row, joint]
            elif tubes is not None and kind in OF_TUBES:
                out[:, index] = _tube_column(tubes, parameter, values[index])

    def _differences(self, values: Array, out: Array) -> None:
        """Columns of the tubes by central differences of solves of all rows."""
        for index in self.columns(*OF_TUBES):
            step = STEP * self.parameters[index].scale
            both = []
            for sign in (1.0, -1.0):
                there = values.copy()
                there[index] += sign * step
                robot = robot_with(self.robot, self.parameters, there)
                both.append(self._follow(robot, *self._joints(there), TIGHT))
            plus, minus = both
            turned = np.einsum("mik,mjk->mij", plus.frame - minus.frame, 0.5 * (plus.frame + minus.frame))
            turn = 0.5 * np.stack(
                [
                    turned[:, 2, 1] - turned[:, 1, 2],
                    turned[:, 0, 2] - turned[:, 2, 0],
                    turned[:, 1, 0] - turned[:, 0, 1],
                ],
                axis=1,
            )
            rates = np.hstack([plus.position - minus.position, turn]) / (2.0 * step)
            out[:, :, index] = np.nan_to_num(rates)

    def _joints(self, values: Array) -> tuple[Array, Array]:
        """(M, 2 N) alpha [rad] and D [m] at the tubes, and their rates with the widths of play."""
        N, widths, offsets = self.robot.n_tubes, self.widths.copy(), np.zeros(2 * self.robot.n_tubes)
        for index in self.columns("alpha", "D", "play_alpha", "play_D"):
            parameter = self.parameters[index]
            joint = parameter.tube + (N if parameter.kind.endswith("D") else 0)
            (widths if parameter.kind.startswith("play") else offsets)[joint] = values[index]
        commands = np.hstack([self.data.alpha, self.data.D])
        if not widths.any() or not self.history:
            return commands + offsets, _rates_without(commands)
        tubes, rates = played(commands, widths)
        return tubes + offsets, rates

    def _follow(self, robot: Robot, joints: Array, joint_rates: Array, tolerance: float) -> Tips:
        N, M = robot.n_tubes, len(joints)
        solver = EquilibriumSolver(robot, tolerance, "torsion" if self.loads is None else "auto")
        position, quaternion, length, answers = np.full((M, 3), np.nan), np.full((M, 4), np.nan), np.zeros(M), []
        for row, joint in enumerate(joints):
            alpha, D, _ = robot.clamp_command(joint[:N], joint[N:])
            loads = None if self.loads is None else self.loads[row]
            answer = solver.solve(alpha, D, start="warm" if self.history else "cold", loads=loads)
            if not answer.success and self.history:
                answer = solver.solve(alpha, D, start="cold", loads=loads)
            if answer.success:
                position[row], quaternion[row] = answer.tip.position, answer.tip.orientation
            length[row] = robot.length_beyond(D)
            answers.append(answer)
        return Tips(position, matrices(quaternion), length, answers, joints, joint_rates)


def played(commands: Array, widths: Array) -> tuple[Array, Array]:
    """What play of these ``widths`` (J,) makes of ``commands`` (M, J) in their order, and its rate with the width: half
    of it more or less while an end of the slot pushes, what it was before while none does."""
    play, out, rates = Play(widths), np.empty_like(commands), np.zeros_like(commands)
    for row, command in enumerate(commands):
        out[row] = play.update(command)
        if row:  # a closed slot opens to where the joint came from
            side = 0.5 * np.sign(out[row - 1] - command)
            rates[row] = np.where(out[row] != out[row - 1], side, rates[row - 1])
    return out, rates


def _rates_without(commands: Array) -> Array:
    return played(commands, np.zeros(commands.shape[1]))[1]


def _loads(data: Measurements) -> list[Loads | None] | None:
    """Per row; None where no force acts in any."""
    if data.tip_force is None or not data.tip_force.any():
        return None
    return [Loads(tuple(force)) if any(force) else None for force in data.tip_force.tolist()]


def _tube_column(tubes: TubeRates, parameter: Parameter, value: float) -> Array:
    """(6,) rate of the tip with one of the tubes' parameters at its ``value``."""
    j = parameter.tube
    if parameter.kind == "bending":  # of GJ, too: see ``parameters.robot_with``
        return np.asarray((tubes.bending[:, j] + tubes.torsion[:, j]) / value)
    if parameter.kind == "torsion":
        return np.asarray(tubes.torsion[:, j] / value)
    if parameter.kind == "poisson":
        return np.asarray(-tubes.torsion.sum(axis=1) / (1.0 + value))
    if parameter.kind == "curvature":
        return np.asarray(tubes.curvature[:, j] / value)
    return tubes.length[j][:, parameter.segment]
