"""The page itself: sliders, bars and meshes of viser, which serves them from its own files, without a network."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.live.mesh import tube_faces
from ctr_pvs.cli.live.mesh import tube_vertices
from ctr_pvs.cli.live.state import NEAR
from ctr_pvs.cli.live.state import POSES
from ctr_pvs.cli.live.state import LiveRobot
from ctr_pvs.cli.live.state import Shown

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

#: Scene units per metre: viewers are made for things of about one unit.
UNITS = 10.0
#: Axes of the frames, the trace, and the arrow of the force at its largest [m].
AXES, LINE, ARROW = 0.015, 0.0004, 0.03
RED, GREEN, GREY = (210, 60, 50), (80, 160, 90), (90, 90, 90)
MM, STEP_ANGLE, STEP_D, STEP_FORCE = 1e3, 0.5, 0.1, 0.01  # deg, mm, N
#: Sliders that are nearer than this to the command are left where they are.
SAME = 1e-6
#: The camera's field of view [rad].
FIELD = 0.8
#: Limits of sliders are cut to so many decimals.
DECIMALS = 2


class Page:
    """Shows ``live`` on ``server``, and moves it with the sliders.

    alpha, D, force : sliders [deg], [mm], [N].  Callbacks come in threads of the server, one for each event: one at a
    time works, one waits and will see the newest values, others have nothing to add.
    """

    def __init__(self, server: ViserServer, live: LiveRobot, largest_force: float) -> None:
        self.server: Any = server  # its types would ask for exact widths of floats
        self.live = live
        self._working, self._waiting = threading.Lock(), threading.Lock()
        self._setting: int | None = None  # the thread that sets sliders itself
        server.gui.configure_theme(show_logo=False, show_share_button=False)  # nothing that would ask the network
        self._build_scene()
        self._build_sliders(largest_force)
        self._build_numbers()
        self._build_buttons()
        self.show(live.shown)

    def _build_scene(self) -> None:
        scene = self.server.scene
        scene.set_up_direction("+z")
        tip = UNITS * self.live.shown.tip.position
        reach = float(np.linalg.norm(tip))
        camera = self.server.initial_camera
        camera.look_at, camera.fov = tuple(0.6 * tip), FIELD
        camera.position = (0.6 * tip[0], 0.6 * tip[1] - 1.9 * reach, 0.6 * tip[2] + 0.9 * reach)
        floor = (0.0, 0.0, -0.6 * reach)
        scene.add_grid("/grid", 4.0 * reach, 4.0 * reach, cell_size=0.1, section_size=1.0, position=floor)
        size: dict[str, Any] = {"axes_length": UNITS * AXES, "axes_radius": UNITS * AXES / 25.0}
        scene.add_frame("/orifice", **size)
        self.tip = scene.add_frame("/tip", **size)
        faces = tube_faces(POSES)
        self.tubes = [
            scene.add_mesh_simple(f"/tubes/{tube.name}", np.zeros((faces.max() + 1, 3)), faces, color=tube.colour)
            for tube in self.live.shown.tubes
        ]
        line: dict[str, Any] = {"thickness": UNITS * LINE}
        self.trace = scene.add_line_segments("/trace", np.zeros((0, 2, 3)), RED, **line)
        self.arrow = scene.add_line_segments("/tip_force", np.zeros((0, 2, 3)), GREY, thickness=2.0 * UNITS * LINE)

    def _build_sliders(self, largest_force: float) -> None:
        gui, limits, names = self.server.gui, self.live.limits, [tube.name for tube in self.live.robot.tubes]
        with gui.add_folder("rotation [deg]"):
            self.alpha = [
                _slider(gui, name, np.degrees(limit), STEP_ANGLE)
                for name, limit in zip(names, limits.alpha, strict=True)
                if limit is not None
            ]
        with gui.add_folder("base to orifice, D [mm]"):
            self.D = [
                _slider(gui, name, MM * np.array(limit), STEP_D)
                for name, limit in zip(names, limits.D, strict=True)
                if limit is not None
            ]
        with gui.add_folder("force on the tip [N]"):
            self.force = [gui.add_slider(axis, -largest_force, largest_force, STEP_FORCE, 0.0) for axis in "xyz"]
        self._largest_force = largest_force
        for slider in (*self.alpha, *self.D, *self.force):
            slider.on_update(self.changed)

    def _build_numbers(self) -> None:
        gui = self.server.gui
        self.message = gui.add_markdown("")
        self.margin_told, self.margin = gui.add_markdown(""), gui.add_progress_bar(0.0)
        self.reserve_told, self.reserve = gui.add_markdown(""), gui.add_progress_bar(0.0)
        self.table = gui.add_markdown("")

    def _build_buttons(self) -> None:
        gui = self.server.gui
        self.save = gui.add_button("Save the command")
        self.clear = gui.add_button("Clear the trace")
        self.reset = gui.add_button("Reset")
        self.save.on_click(self._save)
        self.clear.on_click(self._clear)
        self.reset.on_click(self._reset)

    def changed(self, event: Any = None) -> None:
        """A slider has moved."""
        if self._setting == threading.get_ident() or not self._waiting.acquire(blocking=False):
            return
        with self._working:
            self._waiting.release()
            asked = self._asked()
            angles, depths, force = asked
            self.show(self.live.move(np.radians(angles), depths / MM, force), asked)

    def _asked(self) -> tuple[Array, Array, Array]:
        """Where the sliders are: (N,) [deg], (N,) [mm], (3,) [N]."""
        alpha, D, force = (
            np.array([slider.value for slider in row], dtype=np.float64) for row in (self.alpha, self.D, self.force)
        )
        return alpha, D, force

    def _reset(self, event: Any) -> None:
        with self._working:
            self.show(self.live.reset())

    def _clear(self, event: Any) -> None:
        with self._working:
            self.live.trace.clear()
            self.show(self.live.shown)

    def _save(self, event: Any) -> None:
        with self._working:
            text = self.live.command()
        (event.client or self.server).send_file_download(f"{self.live.robot.name}_command.yaml", text.encode())

    def show(self, shown: Shown, asked: tuple[Array, Array, Array] | None = None) -> None:
        """Puts everything on the page, and the sliders to the command that is shown where it is not what they
        ``asked`` for: others may have been moved on meanwhile."""
        with self.server.atomic():
            for mesh, tube in zip(self.tubes, shown.tubes, strict=True):
                mesh.visible = len(tube.position) > 0
                if mesh.visible:
                    mesh.vertices = UNITS * tube_vertices(tube.position, tube.orientation, 0.5 * tube.diameter)
            x, y, z, w = shown.tip.orientation.tolist()
            self.tip.position, self.tip.wxyz = UNITS * shown.tip.position, (w, x, y, z)
            tips = UNITS * np.array(self.live.trace).reshape(-1, 3)
            self.trace.points = np.stack([tips[:-1], tips[1:]], axis=1)
            start = shown.tip.position - ARROW * shown.tip_force / self._largest_force
            self.arrow.points = UNITS * np.array([[start, shown.tip.position]])
            self._show_numbers(shown)
        self._set_sliders(shown, self._asked() if asked is None else asked)

    def _show_numbers(self, shown: Shown) -> None:
        warning = "**A snap is near.** " if shown.snap_is_near else ""
        self.message.content = f"{warning}{shown.message}" if shown.good else f"**{shown.message}**"
        for name, value, told, bar in (
            ("stability margin", shown.margin, self.margin_told, self.margin),
            ("snap reserve", shown.reserve, self.reserve_told, self.reserve),
        ):
            told.content = f"{name} {value:.3f}" + (" **near a snap**" if value < NEAR else "")
            bar.value = 100.0 * min(max(0.0 if math.isnan(value) else value, 0.0), 1.0)
            bar.color = RED if value < NEAR else GREEN
        rows = [
            f"| {tube.name} | {1e3 * torque:.2f} | {force:.3f} |"
            for tube, torque, force in zip(shown.tubes, shown.torque, shown.force, strict=True)
        ]
        tip = ", ".join(f"{place + 0.0:.2f}" for place in MM * shown.tip.position)
        head = "| tube | torque [mN m] | force [N] |\n| --- | --- | --- |\n"
        self.table.content = f"tip ({tip}) mm\n\n{head}" + "\n".join(rows)

    def _set_sliders(self, shown: Shown, asked: tuple[Array, Array, Array]) -> None:
        self._setting = threading.get_ident()
        values = np.degrees(shown.alpha), MM * shown.D, shown.tip_force
        try:
            for sliders, before, after in zip((self.alpha, self.D, self.force), asked, values, strict=True):
                for slider, old, new in zip(sliders, before.tolist(), after.tolist(), strict=True):
                    if abs(old - new) > SAME:
                        slider.value = new
        finally:
            self._setting = None


def _slider(gui: Any, name: str, limits: Array, step: float) -> Any:
    """A slider between limits that are cut to a few decimals, at the place nearest to 0."""
    low = math.ceil(round(10**DECIMALS * float(limits[0]), 6)) / 10**DECIMALS
    high = max(low, math.floor(round(10**DECIMALS * float(limits[1]), 6)) / 10**DECIMALS)
    return gui.add_slider(name, low, high, min(step, max(high - low, 1e-9)), min(max(0.0, low), high))
