"""Elements under load: gradient, Hessian and the exact tangent in any state, equilibrium or not, by differences."""

from __future__ import annotations

import numpy as np
import pytest
from long_runs import some
from random_loads import random_loads
from random_robots import random_D
from random_robots import random_robot
from test_element import BARE
from test_element import bare_scene

from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Tube
from ctr_pvs.answer.engine import Engine
from ctr_pvs.kernel import arrays
from ctr_pvs.kernel.layout import prepare
from ctr_pvs.kernel.loaded.tangent import solve_tangent
from ctr_pvs.kernel.twist.condensation import factorize
from ctr_pvs.kernel.twist.condensation import substitute
from ctr_pvs.kernel.twist.element import EXACT
from ctr_pvs.kernel.twist.element import energy_gradient
from ctr_pvs.kernel.twist.element import energy_value
from ctr_pvs.kernel.twist.fields import COARSE
from ctr_pvs.kernel.twist.fields import FINE
from ctr_pvs.kernel.twist.fields import field_of
from ctr_pvs.kernel.twist.margin import stability_margin
from ctr_pvs.kernel.workspace import kit_of
from ctr_pvs.model.packing import packed_loads
from ctr_pvs.robot.loads import ZERO
from ctr_pvs.robot.loads import Loads
from ctr_pvs.robot.loads import PointForce

TOLERANCE = 1e-5
#: Degree of the elements, and the highest that states and directions have: Gauss points integrate products of the
#: former with the latter, not those of two of the former.
DEGREE, LOW = 7, 2
#: Step of differences of the gradient, and weights of four points.
STEP, WEIGHTS = 2e-3, {-2: 1.0 / 12.0, -1: -8.0 / 12.0, 1: 8.0 / 12.0, 2: -1.0 / 12.0}
#: Added to the diagonal where a Hessian is not positive definite.
SHIFT = 4.0


class Loaded:
    """A scene of the kernel under loads, with a state (y, alpha) that is no equilibrium."""

    def __init__(
        self, robot: Robot, D: np.ndarray, alpha: np.ndarray, loads: Loads, seed: int = 0, degree: int = DEGREE
    ) -> None:
        engine = Engine(robot, TOLERANCE)
        packed = packed_loads(robot, D, loads)
        self.kit = kit_of(*engine.fixed())
        while not prepare(self.kit, self.kit.scenes[0], D, packed, TOLERANCE, 0, degree):
            engine.grow()
            self.kit = kit_of(*engine.fixed())
        self.robot, self.alpha = robot, alpha
        self.scene, self.bench = self.kit.scenes[0], self.kit.bench
        self.n = int(self.scene.counts[arrays.N_UNKNOWNS])
        rng = np.random.default_rng([seed, 3])
        # Unknowns that only check, those of bending, and those of low degree.
        self.finer, self.bending, self.low = np.zeros((3, self.n), dtype=bool)
        self.low[: robot.n_tubes] = D > 0.0  # a base on the orifice has no guide, and no unknown of it
        for m in range(int(self.scene.counts[arrays.N_ELEMENTS])):
            for field in range(robot.n_tubes + 2):
                first, size = field_of(self.scene, m, field, FINE)
                self.finer[first + field_of(self.scene, m, field, COARSE)[1] : first + size] = True
                self.bending[first : first + size] = field >= robot.n_tubes
                self.low[first : first + min(size, LOW + 1)] = True
        self.y = np.where(self.low, 0.02 * rng.standard_normal(self.n), 0.0)

    def put(self, y: np.ndarray) -> None:
        self.scene.vectors[arrays.Y, : self.n] = y

    def value(self, y: np.ndarray, alpha: np.ndarray | None = None) -> float:
        self.put(y)
        return energy_value(self.scene, self.kit.tubes, self.kit.rules, self.alpha if alpha is None else alpha)

    def gradient(self, y: np.ndarray, alpha: np.ndarray | None = None) -> np.ndarray:
        self.put(y)
        energy_gradient(self.scene, self.bench, self.kit.tubes, self.kit.rules, self.alpha if alpha is None else alpha)
        return self.scene.vectors[arrays.GRADIENT, : self.n].copy()

    def along(self, d: np.ndarray) -> np.ndarray:
        """The tangent times d (U,), by differences of the gradient."""
        return sum(w * self.gradient(self.y + i * STEP * d) for i, w in WEIGHTS.items()) / STEP

    def turned(self, turn: np.ndarray) -> np.ndarray:
        """Change of the gradient with base angles, by differences."""
        return sum(w * self.gradient(self.y, self.alpha + i * STEP * turn) for i, w in WEIGHTS.items()) / STEP

    def matrix(self) -> np.ndarray:
        return np.array([self.along(d) for d in np.eye(self.n)]).T

    def factorized(self, which: int = FINE) -> float:
        """Factorises at y and says what had to be added to the diagonal."""
        for shift in (0.0, SHIFT, 8.0 * SHIFT):
            self.gradient(self.y)
            if factorize(self.scene, self.bench, self.kit.rules, which, EXACT, 0.0, shift, -1.0):
                return shift
        raise AssertionError("no shift makes this Hessian positive definite")

    def solved(self, right: np.ndarray, which: int = FINE, turn: np.ndarray | None = None, sign: float = 1.0):
        """Solution (U,) of the factorised system with the exact tangent; sign -1: with its transpose."""
        rhs, out = np.zeros((2, self.scene.vectors.shape[1]))
        rhs[: self.n] = right
        turn = np.zeros(self.robot.n_tubes) if turn is None else turn
        solve_tangent(self.scene, self.bench, which, rhs, turn, out, sign)
        return out[: self.n]


def bare(name: str, moments: bool, degree: int) -> Loaded:
    """Helical, polynomial and constant pre-curvature; whatever is not beyond the orifice carries nothing."""
    energy, alpha, _ = bare_scene(BARE[name], [0.3, -1.1, 2.0])
    robot, rng = energy.engine.robot, np.random.default_rng(17)
    return Loaded(robot, energy.D, alpha, random_loads(rng, robot, energy.D, moments, 1.5), 0, degree)


def one_place(moments: bool, degree: int) -> Loaded:
    """Loads on both tubes where a segment of the outer one ends, and on the tip."""
    a, b = Segment(0.05, 0.05, 0.04), Segment(0.04, 0.05, 0.04, (6.0,))
    tubes = Tube("a", (a, b)), Tube("b", (Segment(0.16, 0.02, 0.015, (3.0 + 4.0j,), 9.0),))
    D, Q = np.array([0.03, 0.04]), (0.01, 0.02, 0.03) if moments else ZERO
    points = PointForce(0, 0.05, (0.1, 0.3, -0.2), Q), PointForce(1, D[1] + 0.02, (0.0, -0.4, 0.5), Q)
    return Loaded(Robot("one place", tubes), D, np.array([0.2, 1.4]), Loads((0.2, 0.1, 0.3), Q, points), 0, degree)


def scene(key, moments: bool = False, degree: int = DEGREE) -> Loaded:
    if key == "one place":
        return one_place(moments, degree)
    if key in BARE:
        return bare(key, moments, degree)
    seed, tubes = key
    rng = np.random.default_rng([seed, tubes, 171])
    robot = random_robot(rng, tubes, 1.5)
    D, alpha = random_D(rng, robot), rng.uniform(-2.0, 2.0, tubes)
    return Loaded(robot, D, alpha, random_loads(rng, robot, D, moments, 1.5), seed, degree)


SCENES = [(seed, tubes) for tubes in (1, 2, 3) for seed in range(3)]
SCENES += ["one place", *(name for name in BARE if name != "nothing out")]


@pytest.mark.parametrize("key", SCENES, ids=str)
def test_the_gradient_of_forces_is_that_of_the_energy(key):
    """And the torques at the bases are its slopes with the base angles."""
    loaded, rng, h = scene(key), np.random.default_rng(5), 1e-5
    gradient = loaded.gradient(loaded.y)
    torque = loaded.scene.held[arrays.TORQUE, 0].copy()
    for _ in range(4):
        d = rng.standard_normal(loaded.n)
        slope = (loaded.value(loaded.y + h * d) - loaded.value(loaded.y - h * d)) / (2.0 * h)
        assert slope == pytest.approx(gradient @ d, rel=1e-6, abs=1e-9)
    for j, turn in enumerate(h * np.eye(loaded.robot.n_tubes)):
        slope = loaded.value(loaded.y, loaded.alpha + turn) - loaded.value(loaded.y, loaded.alpha - turn)
        assert torque[j] == pytest.approx(slope / (2.0 * h), rel=1e-6, abs=1e-9)
    assert loaded.bending.any() and np.abs(gradient[loaded.bending]).max() > 1e-3


@pytest.mark.parametrize("which", [COARSE, FINE])
@pytest.mark.parametrize("moments", [False, True])
@pytest.mark.parametrize("key", some(SCENES, {0, 3, 6, 9, 11}), ids=str)
def test_what_is_factorised_is_the_slope_of_the_gradient(key, moments, which):
    """J^-1 (J d + the change with turning bases) gives d back: with moments, J is unsymmetric."""
    loaded, rng = scene(key, moments), np.random.default_rng(6)
    counts = ~loaded.finer if which == COARSE else np.ones(loaded.n, dtype=bool)
    for turn in (np.zeros(loaded.robot.n_tubes), rng.standard_normal(loaded.robot.n_tubes)):
        d = np.where(loaded.low, rng.standard_normal(loaded.n), 0.0)
        right = loaded.along(d) + loaded.turned(turn)
        shift = loaded.factorized(which)
        found = loaded.solved(np.where(counts, right + shift * d, 0.0), which, turn)
        assert found == pytest.approx(d, rel=0.0, abs=1e-7 * np.abs(right).max())
        assert not found[~counts].any()


@pytest.mark.parametrize("key", some([(0, 2), (1, 3), "one base on the orifice"], {0}), ids=str)
def test_transposed_tangents(key):
    loaded, rng = scene(key, True, 5), np.random.default_rng(7)
    matrix = loaded.matrix()
    assert np.abs(matrix - matrix.T).max() > 1e-3 * np.abs(matrix).max()
    d = np.where(loaded.low, rng.standard_normal(loaded.n), 0.0)
    shift = loaded.factorized()
    for sign, J in ((1.0, matrix), (-1.0, matrix.T)):
        found = loaded.solved(J @ d + shift * d, sign=sign)
        assert found == pytest.approx(d, rel=0.0, abs=1e-7 * np.abs(J @ d).max())
    symmetric = 0.5 * (matrix + matrix.T)
    rhs, out = np.zeros((2, loaded.scene.vectors.shape[1]))
    rhs[: loaded.n] = symmetric @ d + shift * d
    substitute(loaded.scene, loaded.bench, FINE, rhs, np.zeros(loaded.robot.n_tubes), out, False)
    assert out[: loaded.n] == pytest.approx(d, rel=0.0, abs=1e-7 * np.abs(symmetric @ d).max())


@pytest.mark.parametrize("moments", [False, True])
@pytest.mark.parametrize("key", some([(0, 1), (0, 2), (1, 2), (2, 3), "tips in reverse order"], {0, 1}), ids=str)
def test_pivots_and_margin_are_those_of_the_whole_matrix(key, moments):
    """The smaller one of bending alone, psi held, and of psi, bending eliminated, relative to their own stiffness."""
    loaded = scene(key, moments, 3)
    matrix = loaded.matrix()
    S = 0.5 * (matrix + matrix.T)
    if not moments:
        assert matrix == pytest.approx(matrix.T, rel=0.0, abs=1e-4)
    b, psi = loaded.bending, ~loaded.bending
    least = [np.linalg.eigvalsh(S[np.ix_(b, b)])[0]]
    if least[0] > 0.0:
        eliminated = S[np.ix_(psi, psi)] - S[np.ix_(psi, b)] @ np.linalg.solve(S[np.ix_(b, b)], S[np.ix_(b, psi)])
        least.append(np.linalg.eigvalsh(eliminated)[0])
    loaded.put(loaded.y)
    margin = stability_margin(loaded.scene, loaded.bench, loaded.kit.tubes, loaded.kit.rules, loaded.alpha)
    positive = bool(np.linalg.eigvalsh(S)[0] > 0.0)
    assert positive == (min(least) > 0.0)
    assert margin == pytest.approx(min(1.0, *least) if positive else -1.0, abs=1e-6)


def test_stable_and_unstable_states_are_among_them():
    signs = set()
    for key in SCENES:
        loaded = scene(key)
        loaded.gradient(loaded.y)
        signs.add(factorize(loaded.scene, loaded.bench, loaded.kit.rules, FINE, EXACT, 0.0, 0.0, -1.0))
    assert signs == {True, False}
