"""What both pages tell in words and bars: the last outcome, margin and snap reserve, a table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.live.scene import GREEN
from ctr_pvs.cli.live.scene import RED

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

#: Margin and reserve below which a snap is called near.
NEAR = 0.2
MM = 1e3


class Readout:
    """Words and bars, one below the other, on ``server``."""

    def __init__(self, server: ViserServer) -> None:
        gui: Any = server.gui
        self.message = gui.add_markdown("")
        self.margin_told, self.margin = gui.add_markdown(""), gui.add_progress_bar(0.0)
        self.reserve_told, self.reserve = gui.add_markdown(""), gui.add_progress_bar(0.0)
        self.table = gui.add_markdown("")

    def tell(self, message: str, good: bool) -> None:
        """What came of the last command; in bold where that was nothing."""
        self.message.content = message if good else f"**{message}**"

    def show_stability(self, margin: float, reserve: float) -> None:
        """Two bars from 0 to 1, red near a snap; NaN is not known."""
        for name, value, told, bar in (
            ("stability margin", margin, self.margin_told, self.margin),
            ("snap reserve", reserve, self.reserve_told, self.reserve),
        ):
            known = not math.isnan(value)
            told.content = (f"{name} {value:.3f}" if known else f"{name} not known") + (
                " **near a snap**" if value < NEAR else ""
            )
            bar.value = 100.0 * min(max(value, 0.0), 1.0) if known else 0.0
            bar.color = RED if value < NEAR else GREEN

    def show_table(self, tip: Array, head: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """tip (3,) [m]; the cells of a table."""
        place = ", ".join(f"{coordinate + 0.0:.2f}" for coordinate in MM * tip)
        lines = [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]
        self.table.content = "\n".join([f"tip ({place}) mm", "", *lines])


def snap_is_near(margin: float, reserve: float) -> bool:
    """Whether either says so; NaN says nothing."""
    return margin < NEAR or reserve < NEAR
