"""ctr-pvs view: a page that is served, moves with its sliders, and ends with Ctrl-C."""

from __future__ import annotations

import socket
import subprocess
import sys
import threading
import time
import urllib.request
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml
from live_scenes import ROBOT
from live_scenes import ROOT
from live_scenes import SEED
from live_scenes import TURNED

from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli
from ctr_pvs.cli.live.others import Others
from ctr_pvs.cli.live.others import find_others
from ctr_pvs.cli.live.scene import RED
from ctr_pvs.cli.live.scene import STABLE
from ctr_pvs.cli.live.scene import UNSTABLE
from ctr_pvs.cli.live.scene import Scene
from ctr_pvs.cli.live.state import FRAMES
from ctr_pvs.cli.live.view import served

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
