"""Through folds: snaps are found where they are, flagged, land where the gradient flow lands, and lose no history."""

from __future__ import annotations

import numpy as np
import pytest
from random_robots import random_D
from random_robots import two_tubes
from scipy.integrate import solve_ivp

from ctr_pvs import EquilibriumSolver
from ctr_pvs import NoEquilibriumError
from ctr_pvs import Robot
from ctr_pvs import Segment
from ctr_pvs import Status
from ctr_pvs import Tube
from ctr_pvs.answer.engine import Engine
from ctr_pvs.answer.state import Snap
from ctr_pvs.answer.state import State
from ctr_pvs.kernel.arrays import STATE
from ctr_pvs.oracles.two_tubes import TwoTubes
from ctr_pvs.solve.dense import DenseEnergy
from ctr_pvs.solve.path import joined

FULL, PARTIAL = [0.0935, 0.2085], [0.0935, 0.1705]


def strong_robot(rng: np.random.Generator, tubes: int) -> Robot:
    """Constant pre-curvatures in one plane, strong enough that many random motions snap."""
    length, curvature = rng.uniform(0.08, 0.16), rng.uniform(8, 22)
    parts = []
    for index in range(tubes):
        K = 0.03 * rng.uniform(0.4, 1)
        bent = Segment(length * rng.uniform(0.7, 1.2), K, K / 1.3, (curvature * rng.uniform(0.6, 1.2),))
        parts.append(Tube(f"t{index}", (Segment(0.03 + 0.03 * index, K, K / 1.3), bent)))
    return Robot("strong", tuple(parts))


@pytest.mark.parametrize(("D", "fold"), [(FULL, 281.889981), (PARTIAL, 205.921639)])
def test_fig4_snaps_at_its_folds(seed_robot, D, fold):
    """To 1e-4 deg, forwards and mirrored; the state before is the branch's end, the state after is stable."""
    for sign in (1.0, -1.0):
        solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
        assert solver.solve([0.0, sign * np.radians(fold - 1e-4)], D).status is Status.OK
        answer = solver.follow([0.0, sign * np.radians(fold + 1e-4)], D)
        assert answer.status is Status.SNAP and answer.success
        (snap,) = answer.snaps
        assert np.degrees(snap.alpha[1]) == pytest.approx(sign * fold, abs=1e-5)
        assert 0.0 < snap.t < 1.0 and snap.energy_released > 0.01
        assert "snapped" in answer.message and "prediction" in answer.message
        assert answer.stability_margin > 0.5


@pytest.mark.parametrize(("lam", "most"), [(50.0, 3_000), (100.0, 30_000)])
def test_a_strong_pair_is_followed_to_its_one_snap_in_few_steps(lam, most):
    """Its kink of the twist drifts along almost flat energy. A certificate that loses the angle's change, not its
    square, makes steps as small as the margin there: it took 2,800 and 99,000 of them, and more Newton steps."""
    robot, D = two_tubes(lam, 0.1)
    answer = EquilibriumSolver(robot, tolerance=1e-6).solve([0.0, 2.2 * np.pi], D, "cold")
    assert answer.status is Status.SNAP and answer.stability_margin > 0.0
    (snap,) = answer.snaps
    exact = TwoTubes(lam, 0.1).snap
    assert exact is not None and snap.alpha[1] == pytest.approx(exact.alpha, abs=5e-6)
    assert answer.iterations < most


def test_a_solver_that_halts_ends_where_others_snap_and_elsewhere_answers_as_they_do(seed_robot):
    solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
    begin = solver.solve([0.0, np.radians(270.0)], FULL)
    halting = solver.fork(begin, halts=True)
    ended = halting.solve([0.0, np.radians(290.0)], FULL)
    assert ended.status is Status.NO_STABLE_EQUILIBRIUM and not ended.success and ended.snaps == ()
    assert "the stable branch ends" in ended.message
    assert solver.fork(begin).solve([0.0, np.radians(290.0)], FULL).status is Status.SNAP
    one, other = (each.solve([0.0, np.radians(281.0)], FULL) for each in (halting, solver))
    assert one.status is Status.OK and (one.tip.position == other.tip.position).all()
    assert halting.fork(one).solve([0.0, np.radians(290.0)], FULL).snaps == ()  # forks halt, too


def test_margin_and_early_warning_of_fig4(seed_robot):
    """The margin stands at 1 until late; the reserve falls from the start, to 0.086 at 280 deg."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-8)
    margins = {200: 1.0, 260: 0.989, 280: 0.452, 281.8: 0.0985, 281.889: 0.0103}
    reserves = []
    for degrees, margin in margins.items():
        answer = solver.solve([0.0, np.radians(degrees)], FULL)
        assert answer.stability_margin == pytest.approx(margin, abs=6e-4)
        reserves.append(answer.snap_reserve)
    assert reserves[2] == pytest.approx(0.086, abs=6e-4)
    assert np.all(np.diff(reserves) < 0.0) and reserves[-1] < 0.003
    early = [solver.solve([0.0, np.radians(a)], FULL, start="cold").snap_reserve for a in (0, 40, 80, 120, 160)]
    assert early[0] == pytest.approx(1.0, abs=1e-9) and np.all(np.diff(early) < -0.005)
    for degrees, margin in {200: 0.576, 205: 0.220}.items():
        cold = solver.solve([0.0, np.radians(degrees)], PARTIAL, start="cold")
        assert cold.stability_margin == pytest.approx(margin, abs=6e-4)
        full = EquilibriumSolver(seed_robot, 1e-6, fidelity="full").solve([0.0, np.radians(degrees)], PARTIAL)
        assert full.stability_margin == pytest.approx(margin, abs=6e-4)


def test_distance_to_snap(seed_robot):
    """How far each actuator can go: the folds of Fig. 4 seen from 40 deg, in both directions and by either tube."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
    with pytest.raises(NoEquilibriumError):
        solver.distance_to_snap()
    solver.solve([0.0, np.radians(40)], FULL)
    distance = np.degrees(solver.distance_to_snap()[:2])
    fold = 281.889981
    assert distance == pytest.approx(np.array([[fold - 40, fold + 40], [fold + 40, fold - 40]]), abs=1e-4)
    slid = EquilibriumSolver(seed_robot, tolerance=1e-7)
    slid.solve([0.0, np.radians(240)], FULL)
    insert, retract = slid.distance_to_snap()[3]
    for end in (FULL[1] - insert, FULL[1] + retract):
        step = np.sign(end - FULL[1]) * 1e-6
        solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
        solver.solve([0.0, np.radians(240)], FULL)
        assert solver.follow([0.0, np.radians(240)], [FULL[0], end - step]).status is Status.OK
        assert solver.follow([0.0, np.radians(240)], [FULL[0], end + step]).status is Status.SNAP


def unknowns(energy: DenseEnergy, state: State) -> np.ndarray:
    """Those of ``energy`` whose angles are nearest to the ones of ``state``."""
    psi = energy.engine.angles(state.vector, energy.place)[0] - state.alpha
    return np.linalg.lstsq(energy.angle_map.reshape(-1, energy.n), psi.ravel(), rcond=None)[0]


def test_a_landing_is_that_of_the_gradient_flow(seed_robot):
    """An independent stiff integration of dq/dtime = -dE/dq from the branch's end rests in the same state."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
    solver.solve([0.0, np.radians(281)], FULL)
    answer = solver.follow([0.0, np.radians(281.89)], FULL)
    (snap,) = answer.snaps
    energy = DenseEnergy(Engine(seed_robot, 1e-7), snap.D, 7)
    alpha = snap.alpha + np.radians([0.0, 0.005])  # a little past the fold, so that the flow leaves by itself
    start = unknowns(energy, snap.before)
    flow = solve_ivp(
        lambda _, q: -energy.gradient(q, alpha),
        (0.0, 3e4),
        start,
        method="LSODA",
        jac=lambda _, q: -energy.hessian(q, alpha),
        rtol=1e-8,
        atol=1e-12,
    )
    energies = [energy.value(q, alpha) for q in flow.y.T]
    assert np.all(np.diff(energies) < 1e-13)
    landed = unknowns(energy, snap.after)
    assert energy.twist_size(flow.y[:, -1] - landed) < 1e-3


@pytest.mark.parametrize("lam", [3.0, 5.0, 10.0])
@pytest.mark.parametrize("b", [0.0, 0.5, 4.0])
def test_many_turns_snap_again_and_again(lam, b):
    """Eight turns on end: snaps, each releasing energy, every landing stable, in one path as in two halves."""
    robot, D = two_tubes(lam, b)
    whole, halves = EquilibriumSolver(robot, tolerance=1e-7), EquilibriumSolver(robot, tolerance=1e-7)
    whole.solve([0.0, 0.0], D)
    halves.solve([0.0, 0.0], D)
    once = whole.follow([0.0, 16 * np.pi], D)
    assert once.status is Status.SNAP and once.stability_margin > 0.0 and len(once.snaps) >= 3
    assert all(snap.energy_released > 0.0 for snap in once.snaps)
    first, second = halves.follow([0.0, 8 * np.pi], D), halves.follow([0.0, 16 * np.pi], D)
    assert len(first.snaps) + len(second.snaps) == len(once.snaps)
    assert second.tip.position == pytest.approx(once.tip.position, abs=1e-6)


def test_a_snap_free_robot_turns_freely():
    """lambda = 2, b = 0 has no fold: ten turns, no snap."""
    robot, D = two_tubes(2.0, 0.0)
    solver = EquilibriumSolver(robot, tolerance=1e-6)
    for turn in np.linspace(0.0, 20 * np.pi, 9):
        assert solver.solve([0.0, turn], D).status is Status.OK


@pytest.mark.parametrize("offset", [-1e-3, -1e-6, -1e-9, -1e-12, 1e-12, 1e-9, 1e-6, 1e-3])
def test_close_to_the_fold_the_answer_is_one_or_the_other(seed_robot, offset):
    """Within 1e-12 rad of the fold: either the branch, stable and unflagged, or its landing, flagged. Nothing else."""
    probe = EquilibriumSolver(seed_robot, tolerance=1e-7)
    probe.solve([0.0, np.radians(200)], FULL)
    fold = probe.follow([0.0, np.radians(283)], FULL).snaps[0].alpha[1]
    solver = EquilibriumSolver(seed_robot, tolerance=1e-7)
    solver.solve([0.0, np.radians(200)], FULL)
    answer = solver.follow([0.0, fold + offset], FULL)
    theta = np.degrees(np.diff(answer.twist(np.array([0.0923])))[0, 0])
    assert answer.success and answer.stability_margin > 0.0
    if abs(offset) > 1e-10:
        assert answer.status is (Status.SNAP if offset > 0 else Status.OK)
    assert (answer.status is Status.OK) == (theta < 120.0)


def test_exactly_at_the_bifurcation():
    """lambda = 5, b = 0, alpha = pi from either side: mirror images, both stable; from far away through a snap:
    flagged."""
    robot, D = two_tubes(5.0, 0.0)
    up = EquilibriumSolver(robot, tolerance=1e-7).solve([0.0, np.pi], D)
    down = EquilibriumSolver(robot, tolerance=1e-7).solve([0.0, -np.pi], D)
    assert up.status is down.status is Status.OK
    assert up.tip.position * [1, -1, 1] == pytest.approx(down.tip.position, abs=1e-8)
    assert up.stability_margin == pytest.approx(down.stability_margin, abs=1e-9)


def test_sliding_out_of_an_antialigned_state_leaves_it_when_it_must():
    """Held at half a turn, short overlap: stable. Pushing out until lambda passes its critical value: the symmetric
    state is left for one of its two neighbours, and that is said."""
    K, G, curvature = 0.02, 0.02 / 1.3, 14.0
    tubes = tuple(Tube(n, (Segment(0.12, K, G, (curvature * sign,)),)) for n, sign in (("a", 1.0), ("b", -1.0)))
    solver = EquilibriumSolver(Robot("opposed", tubes), tolerance=1e-7)
    first = solver.solve([0.0, 0.0], [0.10, 0.10])
    assert first.success
    out = solver.follow([0.0, 0.0], [0.0, 0.0])
    assert out.success and out.stability_margin > 0.0
    untwisted = np.abs(np.diff(out.twist(np.array([0.12])), axis=1)).max() < 1e-6
    assert not untwisted


@pytest.mark.parametrize("seed", range(6))
def test_one_large_step_is_many_small_ones(seed):
    """Along one straight path, with rotation and sliding together, both ways end on the same branch."""
    rng = np.random.default_rng([seed, 61])
    robot = strong_robot(rng, 2 + seed % 2)
    n = robot.n_tubes
    D, D_end = random_D(rng, robot), random_D(rng, robot)
    alpha, alpha_end = np.zeros(n), rng.uniform(-5, 5, n)
    large, small = EquilibriumSolver(robot, 1e-7), EquilibriumSolver(robot, 1e-7)
    large.solve(alpha, D)
    small.solve(alpha, D)
    one = large.follow(alpha_end, D_end)
    snaps = 0
    for t in np.linspace(0.0, 1.0, 41)[1:]:
        many = small.follow(alpha + t * (alpha_end - alpha), D + t * (D_end - D))
        assert many.success, many.message
        snaps += len(many.snaps)
    assert one.success and len(one.snaps) == snaps
    assert np.linalg.norm(one.tip.position - many.tip.position) < 1e-6


def test_setting_out_from_the_very_edge_never_raises():
    """From states within 1e-4 .. 1e-9 rad of a fold of strongly coupled tubes, in all directions: answers, no
    exceptions."""
    robot, D = two_tubes(12.0, 0.3)
    probe = EquilibriumSolver(robot, tolerance=1e-8)
    probe.solve([0.0, 0.0], D)
    fold = probe.follow([0.0, 12.0], D).snaps[0].alpha[1]
    for gap in 10.0 ** np.arange(-9, -3):
        for step in (-0.5, -1e-3, gap / 2, 2 * gap, 0.5):
            solver = EquilibriumSolver(robot, tolerance=1e-8)
            solver.solve([0.0, 0.0], D)
            edge = solver.follow([0.0, fold - gap], D)
            moved = solver.follow([0.0, fold - gap + step], D)
            assert edge.success and moved.success, (edge.message, moved.message)
            assert moved.stability_margin > 0.0
            if step > 2 * gap:
                assert moved.status is Status.SNAP or edge.status is Status.SNAP


@pytest.mark.parametrize(
    ("lam", "b"), [(3.0, 0.0), (5.0, 0.0), (8.0, 0.0), (10.0, 0.0), (1.0, 1.0), (2.0, 0.5), (12.0, 1.0)]
)
def test_snaps_are_where_the_closed_form_has_them(lam, b):
    """The place of a snap does not depend on the tolerance asked of the tip: alpha to 1e-6 rad."""
    robot, D = two_tubes(lam, b)
    exact = TwoTubes(lam, max(b, 1e-6)).snap.alpha  # a robot needs some straight tube: 1e-7 m of it
    for tolerance in (1e-3, 1e-6):
        solver = EquilibriumSolver(robot, tolerance=tolerance)
        solver.solve([0.0, 0.0], D)
        (snap, *_) = solver.follow([0.0, exact + 0.3], D).snaps
        assert snap.alpha[1] == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize("tolerance", [1e-3, 1e-4, 1e-5, 1e-6, 1e-7])
@pytest.mark.parametrize(("lam", "b"), [(3.0, 0.0), (5.0, 0.5), (8.0, 0.0), (10.0, 0.0), (12.0, 1.0), (30.0, 0.1)])
def test_one_fold_is_one_snap(lam, b, tolerance):
    """Whatever degrees the tolerance asks for: no snap is told twice, and none that releases next to nothing."""
    robot, D = two_tubes(lam, b)
    exact = TwoTubes(lam, max(b, 1e-6)).snap.alpha
    solver = EquilibriumSolver(robot, tolerance)
    solver.solve([0.0, 0.0], D)
    answer = solver.follow([0.0, exact + 0.01], D)
    assert answer.success, answer.message
    (snap,) = answer.snaps
    assert snap.alpha[1] == pytest.approx(exact, abs=1e-6)
    assert snap.energy_released > 1e-3


def test_the_states_of_a_snap_tell_their_own_numbers(seed_robot):
    """Both are equilibria with a tip, a residual and a number of unknowns, whoever looks at them later."""
    solver = EquilibriumSolver(seed_robot, tolerance=1e-6)
    solver.solve([0.0, 4.8], FULL)
    (snap,) = solver.follow([0.0, np.radians(283)], FULL).snaps
    engine = Engine(seed_robot, 1e-6)
    for state in (snap.before, snap.after):
        again = State(engine.describe(state.vector), 2)
        assert state.tip == pytest.approx(again.tip, abs=1e-9)
        assert state.residual == pytest.approx(again.residual, abs=1e-9) and state.residual < 1e-9
        assert state.torque == pytest.approx(again.torque, abs=1e-9)
        assert state.solved_for == again.solved_for and state.coupled


def snap_at(alpha, released):
    turned = np.array([0.0, alpha])
    unloaded = State(np.zeros(STATE + 6), 2)
    return Snap(alpha, turned, np.zeros(2), unloaded, unloaded, released)


def test_what_only_begins_a_snap_is_part_of_it():
    """Faint releases of a drifting kink just before the snap that they lead to; others stay what they are."""
    faint, other = [snap_at(6.0 + 1e-6 * index, 1e-10) for index in range(3)], snap_at(3.0, 1e-10)
    last = snap_at(6.0 + 3e-6, 5.0)
    first, whole = joined([other, *faint], last)
    assert first is other
    assert (whole.alpha[1], whole.t) == (6.0, 6.0) and whole.energy_released == pytest.approx(5.0 + 3e-10, rel=1e-15)
    assert joined([snap_at(6.0, 1.0)], last)[0].energy_released == 1.0
