"""What both pages show in space: tubes, frames, the tip's trace and force, ghosts, and a snap."""

from __future__ import annotations

from collections.abc import Iterable
from collections.abc import Sequence
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from numpy.typing import NDArray

from ctr_pvs.answer.backbone import Pose
from ctr_pvs.cli.live.mesh import Ints
from ctr_pvs.cli.live.mesh import Solid

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]
Colour = tuple[int, int, int]

#: Scene units per metre: viewers are made for things of about one unit.
UNITS = 10.0
#: Axes of the frames, the trace, and the arrow of the force at its largest [m].
AXES, LINE, ARROW = 0.015, 0.0004, 0.03
RED, GREEN, GREY = (210, 60, 50), (80, 160, 90), (90, 90, 90)
#: Ghosts of other equilibria, and how much of their light they stop.
STABLE, UNSTABLE, OPACITY = (40, 170, 150), (190, 60, 180), 0.35
#: The camera's field of view [rad].
FIELD = 0.8


class Scene:
    """Draws on ``server``, seen from where a robot with its tip near ``tip`` (3,) [m] fits.

    largest_force : [N] that has the longest arrow.
    """

    def __init__(self, server: ViserServer, tip: ArrayLike, largest_force: float) -> None:
        self._server: Any = server  # its types would ask for exact widths of floats
        self._largest_force = largest_force
        self.tubes: dict[str, Any] = {}
        self.ghosts: list[Any] = []
        self._build()
        self.look_at(tip)

    def _build(self) -> None:
        scene = self._server.scene
        scene.set_up_direction("+z")
        scene.configure_default_lights(cast_shadow=False)
        size: dict[str, Any] = {"axes_length": UNITS * AXES, "axes_radius": UNITS * AXES / 25.0}
        scene.add_frame("/orifice", **size)
        self.tip = scene.add_frame("/tip", **size)
        line = UNITS * LINE
        self.trace = scene.add_line_segments("/trace", np.zeros((0, 2, 3)), RED, thickness=line)
        self.arrow = scene.add_line_segments("/tip_force", np.zeros((0, 2, 3)), GREY, thickness=2.0 * line)
        self.label = scene.add_label("/tip/snap", "", visible=False)

    def look_at(self, tip: ArrayLike) -> None:
        """Moves everybody's camera to where a robot with its tip near ``tip`` (3,) [m] fits."""
        x, y, z = UNITS * np.asarray(tip, dtype=np.float64)
        reach = float(np.hypot(np.hypot(x, y), z))
        for camera in (self._server.initial_camera, *(each.camera for each in self._server.get_clients().values())):
            camera.look_at, camera.fov = (0.6 * x, 0.6 * y, 0.6 * z), FIELD
            camera.position = (0.6 * x, 0.6 * y - 1.9 * reach, 0.6 * z + 0.9 * reach)
        floor = (0.0, 0.0, -0.6 * reach)
        size: dict[str, Any] = {"cell_size": 0.1, "section_size": 1.0, "position": floor}
        self._server.scene.add_grid("/grid", 4.0 * reach, 4.0 * reach, **size)

    def show(self, tubes: Sequence[Solid], tip: Pose, flash: float = 0.0) -> None:
        """The tubes, and the frame of the tip; flash : how red the tubes are, 0 to 1."""
        for name in self.tubes.keys() - {tube.name for tube in tubes}:
            self.tubes[name].visible = False
        for tube in tubes:
            mesh = self.tubes.get(tube.name)
            colour = mixed(tube.colour, RED, flash)
            vertices = UNITS * tube.vertices
            if mesh is None or mesh.vertices.shape != vertices.shape:
                path = f"/tubes/{tube.name}"
                self.tubes[tube.name] = self._mesh(path, vertices, tube.faces, color=colour)
                continue
            mesh.vertices, mesh.visible = vertices, True
            if mesh.color != colour:
                mesh.color = colour
        x, y, z, w = tip.orientation.tolist()
        self.tip.position, self.tip.wxyz = UNITS * tip.position, (w, x, y, z)

    def hide(self) -> None:
        """No tubes."""
        for mesh in self.tubes.values():
            mesh.visible = False

    def show_force(self, tip: Pose, force: Array) -> None:
        """An arrow that ends on the tip; force (3,) [N]."""
        share = force / max(self._largest_force, float(np.linalg.norm(force)))
        self.arrow.points = UNITS * np.array([[tip.position - ARROW * share, tip.position]])

    def show_trace(self, tips: Iterable[Array]) -> None:
        """A line through ``tips``, (3,) [m] each."""
        points = UNITS * np.array([*tips]).reshape(-1, 3)
        self.trace.points = np.stack([points[:-1], points[1:]], axis=1)

    def tell(self, text: str) -> None:
        """A label at the tip; none without a text."""
        self.label.text, self.label.visible = text, bool(text)

    def show_ghosts(self, ghosts: Iterable[tuple[Sequence[Solid], bool]]) -> None:
        """Tubes of other equilibria, each stable or not, in place of those before."""
        for mesh in self.ghosts:
            mesh.remove()
        self.ghosts = [
            self._mesh(
                f"/ghosts/{index}/{tube.name}",
                UNITS * tube.vertices,
                tube.faces,
                color=STABLE if stable else UNSTABLE,
                opacity=OPACITY,
            )
            for index, (tubes, stable) in enumerate(ghosts)
            for tube in tubes
        ]

    def _mesh(self, path: str, vertices: Array, faces: Ints, **look: Any) -> Any:
        """Without shadows: they take as long to draw as all the rest where the processor draws."""
        scene = self._server.scene
        return scene.add_mesh_simple(path, vertices, faces, cast_shadow=False, receive_shadow=False, **look)


def mixed(colour: Colour, other: Colour, share: float) -> Colour:
    """``share`` of the ``other`` colour, 0 to 1."""
    red, green, blue = (round(a + share * (b - a)) for a, b in zip(colour, other, strict=True))
    return red, green, blue
