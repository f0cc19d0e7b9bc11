"""What the live page shows: meshes, and what becomes of a robot when sliders move."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from live_scenes import ROBOT
from live_scenes import SEED

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import load_robot
from ctr_pvs.cli.live.mesh import RING
from ctr_pvs.cli.live.mesh import tube_faces
from ctr_pvs.cli.live.mesh import tube_vertices
from ctr_pvs.cli.live.readout import snap_is_near
from ctr_pvs.cli.live.state import FRAMES
from ctr_pvs.cli.live.state import LiveRobot


def live(name=ROBOT) -> LiveRobot:
    return LiveRobot(load_robot(name), 1e-5)


# --- meshes -----------------------------------------------------------------------------------------------------------


def test_a_mesh_is_closed_and_as_wide_and_long_as_the_tube(seed_robot):
    answer = EquilibriumSolver(seed_robot).solve([0.0, 1.0], [0.0935, 0.1705])
    backbone = answer.tube_backbone(1, 50)
    vertices, faces = tube_vertices(backbone.position, backbone.orientation, 8e-4), tube_faces(50)
    rings = vertices[:-2].reshape(50, RING, 3)
    assert np.linalg.norm(rings - backbone.position[:, None], axis=2) == pytest.approx(8e-4)
    tangents = np.gradient(backbone.position, backbone.s, axis=0)
    assert np.abs(np.einsum("nrk,nk->nr", rings - backbone.position[:, None], tangents)).max() < 1e-3 * 8e-4 * 50
    edges = [tuple(edge) for face in faces.tolist() for edge in zip(face, [*face[1:], face[0]], strict=True)]
    assert len(set(edges)) == len(edges)  # each once in each direction: closed, and turned the same way everywhere
    assert {(b, a) for a, b in edges} == set(edges)
    corners = vertices[faces]
    volume = np.einsum("nk,nk->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6.0
    area = 0.5 * RING * np.sin(2.0 * np.pi / RING) * 8e-4**2
    assert volume == pytest.approx(area * answer.length, rel=1e-3)  # positive: seen from outside


# --- what sliders do --------------------------------------------------------------------------------------------------


def test_it_begins_in_the_middle_and_follows():
    robot = live()
    assert robot.shown.alpha.tolist() == [0.0, 0.0, 0.0]
    assert robot.shown.D.tolist() == [0.07, 0.11, 0.16]
    shown = robot.move([0.3, 1.0, -1.0], [0.06, 0.12, 0.2], [0.0, 0.1, 0.0])
    answer = EquilibriumSolver(robot.robot).solve(shown.alpha, shown.D, loads=Loads(tip_force=(0.0, 0.1, 0.0)))
    assert shown.good and shown.message == "stable equilibrium"
    assert shown.tip.position == pytest.approx(answer.tip.position, abs=2e-5)
    assert shown.torque == pytest.approx(answer.torque, abs=1e-4)
    assert (shown.margin, shown.reserve) == pytest.approx((answer.stability_margin, answer.snap_reserve), abs=1e-3)
    assert [tube.position[-1] for tube in shown.tubes][2] == pytest.approx(shown.tip.position)
    assert len(robot.trace) == 2


def test_a_command_beyond_the_limits_or_out_of_order_is_moved_and_told():
    shown = live().move([7.0, 0.0, 0.0], [0.12, 0.05, 0.2], [0.0, 0.0, 0.0])
    assert shown.alpha.tolist() == [6.3, 0.0, 0.0] and shown.D.tolist() == [0.12, 0.12, 0.2]
    assert "alpha[0]" in shown.message and "D[1]" in shown.message


def test_a_snap_is_announced_and_told():
    robot = live(SEED)
    for angle in (1.0, 3.0, 4.8):
        shown = robot.move([0.0, angle], [0.0935, 0.2085], np.zeros(3))
    assert shown.good and snap_is_near(shown.margin, shown.reserve) and shown.reserve < 0.2
    shown = robot.move([0.0, 5.5], [0.0935, 0.2085], np.zeros(3))
    assert shown.message.startswith("SNAP on the way") and not snap_is_near(shown.margin, shown.reserve)
    shown = robot.reset()
    assert shown.alpha.tolist() == [0.0, 0.0] and len(robot.trace) == 1 and "SNAP" not in shown.message


def test_a_snap_comes_with_the_shapes_on_its_way():
    robot = live(SEED)
    assert robot.shown.motion == ()
    assert robot.move([0.0, 4.8], [0.0935, 0.2085], np.zeros(3)).motion == ()
    shown = robot.move([0.0, 5.0], [0.0935, 0.2085], np.zeros(3))
    assert [frame.share for frame in shown.motion] == pytest.approx(np.linspace(0.0, 1.0, FRAMES))
    tips = np.array([frame.tip.position for frame in shown.motion])
    assert np.linalg.norm(tips[0] - robot.trace[-2]) < 0.01 < np.linalg.norm(tips[-1] - tips[0])
    assert np.linalg.norm(tips[-1] - shown.tip.position) < 0.003  # the rest of the move is a turn by 0.08 rad
    assert [frame.tubes[1].position[-1] for frame in shown.motion] == pytest.approx(tips, abs=1e-6)
    assert all(f"{1e3 * frame.released:.3g} mJ" in shown.message for frame in shown.motion)
    assert robot.move([0.0, 5.1], [0.0935, 0.2085], np.zeros(3)).motion == ()


def test_without_an_answer_it_stays_and_says_so(monkeypatch):
    robot = live(SEED)
    before = robot.move([0.0, 1.0], [0.0935, 0.2085], np.zeros(3))
    monkeypatch.setattr("ctr_pvs.cli.live.state.BUDGET", 1e-9)
    shown = robot.move([0.0, 40.0], [0.0935, 0.2085], np.zeros(3))
    assert not shown.good and shown.message.startswith("timeout") and "last command that was answered" in shown.message
    assert shown.tip is before.tip and shown.alpha is before.alpha


def test_the_saved_command_is_yaml_with_all_digits():
    robot = live()
    shown = robot.move([0.1, 1.0 / 3.0, 0.0], [0.06, 0.12, 0.2], [0.0, 0.1, 0.0])
    saved = yaml.safe_load(robot.command())
    assert (saved["robot"], saved["tubes"]) == ("three_tubes", ["outer", "middle", "inner"])
    assert saved["alpha"] == shown.alpha.tolist() and saved["D"] == shown.D.tolist()
    assert saved["tip_force"] == [0.0, 0.1, 0.0] and saved["tip_position"] == shown.tip.position.tolist()
