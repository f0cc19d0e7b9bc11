"""Section by section or all at once: Newton's step, rates, stability and margin against whole matrices."""

from __future__ import annotations

import numpy as np
import pytest
from dense_energies import energy_of
from dense_energies import random_scene
from dense_energies import solved_for
from random_robots import random_D
from random_robots import random_robot
from test_element import SCENES
from test_element import scene_of

from ctr_pvs import EquilibriumSolver
from ctr_pvs.kernel import arrays
from ctr_pvs.kernel.twist.margin import largest_eigenvalue
from ctr_pvs.kernel.twist.newton import newton_step
from ctr_pvs.kernel.walk.step import NOT_PROVEN
from ctr_pvs.kernel.walk.step import OK
from ctr_pvs.kernel.walk.step import open_state
from ctr_pvs.kernel.workspace import kit_of

UNSTABLE = -1.0


def newton_step_of_kernel(engine, state, turned, finer):
    """The step (U,) that the kernel takes from any ``state`` while the bases turn by ``turned`` (N,) [rad]; None if it
    finds the Hessian not positive definite."""
    kit = kit_of(*engine.fixed())
    scene, bench = kit.scenes[open_state(kit, state.vector, engine.tolerance)], kit.bench
    good = newton_step(scene, bench, kit.tubes, kit.rules, state.alpha, turned, finer)
    return scene.vectors[arrays.STEP, : len(state.unknowns)].copy() if good else None


def mixed(energy, y, alpha):
    """d2E / dy dalpha (n, N), by differences of the gradient to fourth order."""
    h, columns = 1e-3, []
    for turn in np.eye(len(alpha)):
        g = [energy.gradient(y, alpha + k * h * turn) for k in (-2, -1, 1, 2)]
        columns.append((g[0] - 8 * g[1] + 8 * g[2] - g[3]) / (12 * h))
    return np.array(columns).T


@pytest.mark.parametrize("finer", [0, 1])
@pytest.mark.parametrize("scene", SCENES)
def test_newtons_step_is_that_of_the_whole_matrix(scene, finer):
    """From states that are no equilibria, all unknowns or those solved for, bases held or turning."""
    energy, alpha, y = scene_of(scene)
    state = energy.state(y, alpha)
    counts = np.ones(energy.n, dtype=bool) if finer else solved_for(energy.engine, state)
    hessian = energy.hessian(y, alpha)[np.ix_(counts, counts)]
    if np.linalg.eigvalsh(hessian)[0] <= 0.0:
        assert newton_step_of_kernel(energy.engine, state, np.zeros(len(alpha)), finer) is None
        return
    for turned in (np.zeros(len(alpha)), np.linspace(0.3, -0.2, len(alpha))):
        expected = np.zeros(energy.n)
        right = -energy.gradient(y, alpha) - mixed(energy, y, alpha) @ turned
        expected[counts] = np.linalg.solve(hessian, right[counts])
        found = newton_step_of_kernel(energy.engine, state, turned, finer)
        digits = 1e-11 if not turned.any() else 1e-9  # those of the differences
        assert found == pytest.approx(expected, rel=0.0, abs=digits * max(1e-3, np.abs(expected).max()))


@pytest.mark.parametrize("scene", SCENES)
def test_rates_of_the_tubes_ends_are_those_of_the_whole_matrix(scene):
    """d psi_end / d alpha = 1 - A H^-1 d2E/dy dalpha, in states that are no equilibria too."""
    energy, alpha, y = scene_of(scene)
    engine, state = energy.engine, energy.state(y, alpha)
    code, _, gain, _ = engine.rates(state.vector)
    if energy.eigenvalues(y, alpha).min(initial=1.0) <= 0.0:
        assert code == NOT_PROVEN
        return
    assert code == OK
    rates = -np.linalg.solve(energy.hessian(y, alpha), mixed(energy, y, alpha))
    far = np.array([max(engine.robot.length_beyond(energy.D), 0.0)])
    expected = np.empty_like(gain)
    for column in range(len(alpha)):  # angles are linear in alpha and the unknowns
        moved = energy.state(y + rates[:, column], alpha + np.eye(len(alpha))[column])
        expected[:, column] = (engine.angles(moved.vector, far)[0] - engine.angles(state.vector, far)[0])[0]
    assert gain == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("tubes", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(25))
def test_pivots_are_positive_where_eigenvalues_are_and_the_margin_is_the_smallest(seed, tubes):
    """Strong coupling and large angles, so that many states are unstable; the margin to 1e-10."""
    energy, alpha, y = random_scene(seed, tubes, strength=1.0 + 3.0 * (seed % 4), twist=1.0)
    least = energy.eigenvalues(y, alpha).min(initial=1.0)
    margin = energy.engine.margin(energy.state(y, alpha).vector)
    if least <= 0.0:
        assert margin == UNSTABLE
    else:
        assert margin == pytest.approx(min(1.0, least), abs=1e-10)


def test_both_kinds_of_states_are_among_them():
    least = []
    for seed in range(25):
        for tubes in (2, 3):
            energy, alpha, y = random_scene(seed, tubes, strength=1.0 + 3.0 * (seed % 4), twist=1.0)
            least.append(energy.eigenvalues(y, alpha).min(initial=1.0))
    assert sum(value <= 0.0 for value in least) >= 10 and sum(0.0 < value < 1.0 for value in least) >= 10


@pytest.mark.parametrize("scene", SCENES)
def test_the_margin_in_special_scenes(scene):
    energy, alpha, y = scene_of(scene)
    least = energy.eigenvalues(y, alpha).min(initial=1.0)
    margin = energy.engine.margin(energy.state(y, alpha).vector)
    assert margin == pytest.approx(min(1.0, least) if least > 0.0 else UNSTABLE, abs=1e-10)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-9])
@pytest.mark.parametrize("seed", range(8))
def test_an_answer_balances_the_whole_gradient(seed, tolerance):
    """At the degrees that the tolerance asked for; its margin is that of all its unknowns."""
    rng = np.random.default_rng([seed, 62])
    robot = random_robot(rng, 2 + seed % 3, strength=1.5)
    solver = EquilibriumSolver(robot, tolerance, fidelity="torsion")
    answer = solver.solve(rng.uniform(-2.0, 2.0, robot.n_tubes), random_D(rng, robot))
    assert answer.success, answer.message
    energy, y = energy_of(answer._engine, answer.state), answer.state.unknowns
    counts = solved_for(answer._engine, answer.state)
    unbalanced = energy.twist_size(energy.gradient(y, answer.alpha) * counts)
    assert unbalanced <= answer.residual + 1e-15 and answer.residual < 1e-10
    least = energy.eigenvalues(y, answer.alpha).min(initial=1.0)
    assert answer.stability_margin == pytest.approx(min(1.0, least), abs=1e-10)
    if answer.degrees_of_freedom:
        assert answer.degrees_of_freedom == np.count_nonzero(counts) - np.count_nonzero(answer.D == 0.0)


def test_the_largest_eigenvalue_of_a_growing_tridiagonal_matrix():
    """As Lanczos asks for it, row by row; also where two eigenvalues nearly meet."""
    rng = np.random.default_rng(12)
    for scale in (1.0, 1e-3, 1e-9):
        diagonal, side = rng.uniform(0.1, 2.0, 12), scale * rng.uniform(0.1, 1.0, 12)
        largest = 0.0
        for n in range(1, 13):
            T = np.diag(diagonal[:n]) + np.diag(side[: n - 1], 1) + np.diag(side[: n - 1], -1)
            largest = largest_eigenvalue(diagonal, side, n, largest)
            assert largest == pytest.approx(np.linalg.eigvalsh(T)[-1], rel=1e-14)
