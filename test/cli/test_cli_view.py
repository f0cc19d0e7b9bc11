"""ctr-pvs view: what sliders do, tried with and without viser, through its own handlers and without a browser."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.request
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from ctr_pvs import EquilibriumSolver
from ctr_pvs import Loads
from ctr_pvs import equilibria
from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.live.mesh import RING
from ctr_pvs.cli.live.mesh import tube_faces
from ctr_pvs.cli.live.mesh import tube_vertices
from ctr_pvs.cli.live.others import Others
from ctr_pvs.cli.live.others import Question
from ctr_pvs.cli.live.others import find_others
from ctr_pvs.cli.live.readout import snap_is_near
from ctr_pvs.cli.live.scene import RED
from ctr_pvs.cli.live.scene import STABLE
from ctr_pvs.cli.live.scene import UNSTABLE
from ctr_pvs.cli.live.scene import Scene
from ctr_pvs.cli.live.searcher import Searcher
from ctr_pvs.cli.live.state import FRAMES
from ctr_pvs.cli.live.state import LiveRobot
from ctr_pvs.cli.live.turns import Turns
from ctr_pvs.cli.live.view import served

ROOT = Path(__file__).parents[2]
ROBOT = str(ROOT / "config" / "three_tubes.yaml")
SEED = ROOT / "config" / "renda2021.yaml"


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


# --- other equilibria -------------------------------------------------------------------------------------------------

#: With three equilibria.
TURNED = Question(np.array([0.0, 4.0]), np.array([0.0935, 0.2085]), np.zeros(3))


def test_others_are_those_of_the_solver_beside_that_which_is_shown():
    robot = live(SEED)
    shown = robot.move(TURNED.alpha, TURNED.D, TURNED.tip_force)
    others = find_others(robot.robot, 1e-5, TURNED)
    every = equilibria(robot.robot, TURNED.alpha, TURNED.D).found
    assert [ghost.stable for ghost in others.ghosts] == [one.stability_margin > 0.0 for one in every]
    assert sorted(ghost.stable for ghost in others.ghosts) == [False, True, True]
    for ghost, one in zip(others.ghosts, every, strict=True):
        assert ghost.tubes[1].position[-1] == pytest.approx(one.tip.position, abs=1e-9)
    beside = others.beside(shown.tubes, 1e-5)
    assert sorted(ghost.stable for ghost in beside) == [False, True]
    assert min(np.linalg.norm(ghost.tubes[1].position[-1] - shown.tip.position) for ghost in beside) > 0.01
    pushed = find_others(robot.robot, 1e-5, replace(TURNED, tip_force=np.array([0.0, 0.05, 0.0])))
    assert all(ghost.stable for ghost in pushed.ghosts) and "the loads put on" in pushed.told


class Heard:
    """What a searcher has found."""

    def __init__(self) -> None:
        self.answers: list[tuple[Question, Others]] = []
        self.came = threading.Semaphore(0)

    def __call__(self, question, others):
        self.answers.append((question, others))
        self.came.release()


@pytest.fixture
def searching():
    heard = Heard()
    searcher = Searcher(load_robot(SEED), 1e-5, heard)
    yield searcher, heard
    searcher.stop()


def test_a_search_answers_the_newest_question_from_a_process_of_its_own(searching):
    searcher, heard = searching
    older = [replace(TURNED, alpha=np.array([0.0, 0.01 * i])) for i in range(20)]
    for question in (*older, TURNED):
        searcher.ask(question)
    assert heard.came.acquire(timeout=60)
    question, others = heard.answers[-1]
    assert question is TURNED and len(heard.answers) == 1
    assert len(others.ghosts) == 3 and "integration from the tip" in others.told
    assert searcher._process.pid != os.getpid()
    process = searcher._process
    searcher.ask(older[0])
    searcher.ask(None)  # not wanted any more
    assert not heard.came.acquire(timeout=1.0)
    searcher.ask(older[1])
    assert heard.came.acquire(timeout=60) and len(heard.answers[-1][1].ghosts) == 1
    assert searcher._process is process


def test_a_search_that_takes_too_long_or_dies_is_given_up_and_the_next_one_works(searching, monkeypatch):
    searcher, heard = searching
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60)
    process = searcher._process
    process.send_signal(signal.SIGSTOP)
    monkeypatch.setattr("ctr_pvs.cli.live.searcher.BUDGET", 0.2)
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60)
    assert heard.answers[-1][1].told == "given up after 0.2 s" and process.poll() is not None
    monkeypatch.undo()
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60) and len(heard.answers[-1][1].ghosts) == 3
    searcher._process.kill()
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60) and "ended unexpectedly" in heard.answers[-1][1].told


def test_the_end_of_a_searcher_ends_its_process_in_mid_search(searching):
    searcher, heard = searching
    searcher.ask(TURNED)
    assert heard.came.acquire(timeout=60)
    process = searcher._process
    process.send_signal(signal.SIGSTOP)
    searcher.ask(TURNED)
    searcher.stop()
    assert process.poll() is not None and len(heard.answers) == 1


# --- turns ------------------------------------------------------------------------------------------------------------


def test_who_holds_the_turn_hears_at_once_that_somebody_waits():
    turns, order = Turns(), []

    def other():
        with turns.mine():
            order.append("other")

    with turns.mine():
        assert not turns.pause(0.01)
        thread = threading.Thread(target=other)
        thread.start()
        assert turns.pause(60.0)
        assert turns.pause(60.0)  # as long as it waits
        order.append("mine")
    thread.join(timeout=60)
    assert order == ["mine", "other"]
    with turns.mine():
        assert not turns.pause(0.01)


# --- the page ---------------------------------------------------------------------------------------------------------


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def page():
    pytest.importorskip("viser")
    page = served(load_robot(ROBOT), 1e-5, "127.0.0.1", free_port(), 1.0)
    yield page
    page.stop()


@pytest.mark.filterwarnings("default")
def test_the_page_is_served_and_needs_no_other_server(page):
    with urllib.request.urlopen(f"http://127.0.0.1:{page.server.get_port()}/", timeout=10) as answer:
        text = answer.read().decode()
    assert "<script" in text and 'src="http' not in text and 'href="http' not in text


@pytest.mark.filterwarnings("default")
def test_a_slider_moves_the_tip(page):
    before = {name: mesh.vertices.copy() for name, mesh in page.scene.tubes.items()}
    page.alpha[2].value = 90.0  # assigning runs the handlers, as a browser does
    assert page.live.shown.alpha[2] == pytest.approx(np.pi / 2.0)
    assert np.abs(page.scene.tubes["inner"].vertices - before["inner"]).max() > 0.05  # 5 mm
    tip = 10.0 * page.live.shown.tip.position
    assert page.scene.tip.position == pytest.approx(tip)
    assert page.scene.tubes["inner"].vertices[-1] == pytest.approx(tip, abs=1e-5)
    assert page.scene.trace.points.shape == (1, 2, 3)
    page.force[1].value = 0.5
    assert page.live.shown.tip_force.tolist() == [0.0, 0.5, 0.0]
    assert np.linalg.norm(page.scene.arrow.points[0, 1] - page.scene.arrow.points[0, 0]) > 0.1
    assert "stability margin" in page.readout.margin_told.content and page.readout.margin.value > 50.0
    assert page.readout.table.content.count("\n| ") == 5  # a head, a line under it, three tubes


@pytest.mark.filterwarnings("default")
def test_sliders_out_of_order_are_put_where_the_robot_is(page):
    page.D[0].value = 140.0
    assert [slider.value for slider in page.D] == pytest.approx([140.0, 140.0, 160.0])
    assert "D[1]" in page.readout.message.content
    page.D[2].value = 300.0  # all of the inner tube is behind the orifice
    assert page.scene.tubes["inner"].visible is False and page.scene.tubes["middle"].visible is True


@pytest.mark.filterwarnings("default")
def test_reset_clear_and_save(page):
    sent = []
    client = SimpleNamespace(send_file_download=lambda name, content: sent.append((name, content)))
    page.alpha[0].value = 50.0
    page._save(SimpleNamespace(client=client))
    assert sent[0][0] == "three_tubes_command.yaml"
    assert yaml.safe_load(sent[0][1])["alpha"] == page.live.shown.alpha.tolist()
    page._clear(None)
    assert len(page.scene.trace.points) == 0
    page._reset(None)
    assert page.alpha[0].value == 0.0 and page.live.shown.alpha.tolist() == [0.0, 0.0, 0.0]


@pytest.fixture
def seed_page():
    """The seed's robot at 4 rad, where it has three equilibria."""
    pytest.importorskip("viser")
    page = served(load_robot(SEED), 1e-5, "127.0.0.1", free_port(), 1.0)
    page.D[0].value, page.D[1].value, page.alpha[1].value = 93.5, 208.5, np.degrees(4.0)
    yield page
    page.stop()


def until(done, seconds=60.0):
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.filterwarnings("default")
def test_ghosts_come_when_wanted_and_go_with_the_command(seed_page):
    page = seed_page
    page.others.value = True
    assert page.others_told.visible
    until(lambda: page.scene.ghosts)
    assert "2 others, 1 stable (green), 1 unstable (purple)" in page.others_told.content
    colours = {tuple(mesh.color) for mesh in page.scene.ghosts}
    assert colours == {STABLE, UNSTABLE} and len(page.scene.ghosts) == 4  # two tubes each
    assert all(mesh.opacity < 0.5 for mesh in page.scene.ghosts)
    page.alpha[1].value = 20.0
    assert page.scene.ghosts == [] or "others" not in page.others_told.content
    until(lambda: "no other" in page.others_told.content)
    assert page.scene.ghosts == []
    page.alpha[1].value = np.degrees(4.0)
    until(lambda: page.scene.ghosts)
    page.others.value = False
    assert page.scene.ghosts == [] and not page.others_told.visible


@pytest.mark.filterwarnings("default")
def test_what_is_found_for_an_older_command_is_dropped(seed_page):
    page = seed_page
    stale = find_others(page.live.robot, 1e-5, TURNED)
    page.others.value = True
    until(lambda: page.scene.ghosts)
    count = len(page.scene.ghosts)
    page._found(TURNED, stale)  # equal to the command that is shown, but not the one that was asked
    page._found(TURNED, Others((), "nothing"))
    assert len(page.scene.ghosts) == count and "nothing" not in page.others_told.content


@pytest.mark.filterwarnings("default")
def test_a_snap_is_shown_on_its_way_and_ends_at_the_answer(seed_page, monkeypatch):
    page, seen = seed_page, []
    show = Scene.show

    def shown(scene, tubes, tip, flash=0.0):
        show(scene, tubes, tip, flash)
        seen.append((flash, tip.position, scene.label.text, scene.tubes["inner"].color))

    monkeypatch.setattr(Scene, "show", shown)
    page.alpha[1].value = 290.0
    flashes = [flash for flash, *_ in seen]
    assert flashes == pytest.approx([*np.linspace(1.0, 0.0, FRAMES), 0.0])
    assert seen[0][3] == RED and seen[-1][3] == page.live.shown.tubes[1].colour
    assert all("mJ released" in text for _, _, text, _ in seen[:-1]) and page.scene.label.text == ""
    assert seen[-1][1] == pytest.approx(page.live.shown.tip.position)
    assert page.readout.message.content.startswith("SNAP on the way")


@pytest.mark.filterwarnings("default")
def test_a_slider_that_moves_during_a_snap_cuts_it_short_and_is_not_lost(seed_page, monkeypatch):
    page, frames = seed_page, []
    monkeypatch.setattr("ctr_pvs.cli.live.page.SNAP_TIME", 3600.0)
    show_frame = page._show_frame
    monkeypatch.setattr(page, "_show_frame", lambda frame: (frames.append(frame), show_frame(frame)))
    snapping = threading.Thread(target=setattr, args=(page.alpha[1], "value", 290.0))
    snapping.start()
    until(lambda: frames)
    assert page._waiting.acquire(blocking=False)  # nobody waits yet
    page._waiting.release()
    page.alpha[1].value = 300.0
    snapping.join(timeout=60)
    assert not snapping.is_alive() and len(frames) == 1
    assert np.degrees(page.live.shown.alpha[1]) == pytest.approx(300.0)
    assert page.alpha[1].value == 300.0 and page.scene.label.text == ""
    assert page.scene.tip.position == pytest.approx(10.0 * page.live.shown.tip.position)
    page._reset(None)  # and so does a button
    page.D[0].value, page.D[1].value, page.alpha[1].value = 93.5, 208.5, 270.0
    frames.clear()
    snapping = threading.Thread(target=setattr, args=(page.alpha[1], "value", 290.0))
    snapping.start()
    until(lambda: frames)
    page._reset(None)
    snapping.join(timeout=60)
    assert page.live.shown.alpha.tolist() == [0.0, 0.0] and page.alpha[1].value == 0.0


@pytest.mark.filterwarnings("default")
def test_many_events_at_once_end_at_the_newest_value(page):
    slider = page.alpha[1]
    threads = [threading.Thread(target=setattr, args=(slider, "value", float(angle))) for angle in range(1, 30)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    page.changed()
    assert np.degrees(page.live.shown.alpha[1]) == pytest.approx(slider.value)


# --- the command line -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("words", [["--port", "0"], ["--largest-force", "0"], ["--port", "x"]])
def test_bad_input_is_one_line(capsys, words):
    assert cli.main(["view", ROBOT, *words]) == 2
    captured = capsys.readouterr()
    assert captured.out == "" and words[0] in captured.err and len(captured.err.splitlines()) == 1


def test_without_viser(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert cli.main(["view", ROBOT]) == 2
    assert capsys.readouterr().err == "ctr-pvs: view needs viser (pip install 'ctr_pvs[view]')\n"


def test_a_port_that_is_taken_is_told(capsys):
    pytest.importorskip("viser")
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        assert cli.main(["view", ROBOT, "--port", str(other.getsockname()[1])]) == 2
    assert "cannot serve at 127.0.0.1" in capsys.readouterr().err


def test_ctrl_c_ends_it_and_nobody_else_can_reach_it():
    pytest.importorskip("viser")
    port = free_port()
    command = [sys.executable, "-m", "ctr_pvs", "view", ROBOT, "--port", str(port)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
    try:
        assert any(f"three_tubes: http://127.0.0.1:{port} (Ctrl-C ends)" in line for line in process.stdout)
        listening = Path("/proc/net/tcp").read_text().split()
        assert f"0100007F:{port:04X}" in listening and f"00000000:{port:04X}" not in listening
        process.send_signal(2)
        assert process.wait(timeout=60) == 0
    finally:
        process.kill()
        process.wait()
        process.stdout.close()
