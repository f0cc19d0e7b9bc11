"""How soon the live page follows a slider: the generated table of docs/seeing.md.

    scripts/in_env.sh python3 -m bench.view.slider_latency

The page of this process is shown in a Chromium without a display, whose WebGL draws in software.  A key is pressed on
the slider of the inner tube's rotation, 0.5 deg at a time, and again a random while after the shape has followed.
*Slider to shape* runs, on the browser's clock, from the key event in the page to the first upload of a mesh of a tube's
size to WebGL: the new shape is then part of the frame that is being drawn.  *Server* runs, on this process's clock,
from the entry of the slider's handler to its return: the solve, the shapes and meshes, and all messages handed over to
viser.  What is left is viser's, the browser's, and the pace of its frames, *frame* apart.  It needs viser and Chromium.
"""

from __future__ import annotations

import argparse
import os
import platform
import socket
import time
from typing import Any
from typing import NamedTuple

import numpy as np
import viser

from bench.common.clock import unit
from bench.common.document import publish
from bench.common.document import table
from bench.common.places import CONFIG
from bench.common.places import DOCS
from bench.view.browser import Browser
from ctr_pvs.cli.live.mesh import RING
from ctr_pvs.cli.live.page import Page
from ctr_pvs.cli.live.state import POSES
from ctr_pvs.cli.live.state import LiveRobot
from ctr_pvs.cli.live.view import address_of
from ctr_pvs.cli.live.view import new_server
from ctr_pvs.robot.file import load_robot

DOCUMENT = DOCS / "seeing.md"
ROBOTS = ("renda2021", "three_tubes")
PRESSES = 150
#: First presses, which find everything cold.
WARMING = 10
#: Random pause between a shape and the next press [s].
PAUSE = (0.05, 0.15)
#: Floats of a mesh: what tells it from all else that goes to WebGL.
FLOATS = 3 * (RING * POSES + 2)
#: Notes when a key goes down, and when the first mesh of that size is uploaded after it.
WATCH = """
(() => {
  window.latency = { pressed: null, times: [], uploads: 0, frames: [] };
  const frame = () => { latency.frames.push(performance.now()); requestAnimationFrame(frame); };
  requestAnimationFrame(frame);
  window.addEventListener("keydown", () => { latency.pressed = performance.now(); }, true);
  for (const name of ["bufferData", "bufferSubData"]) {
    const plain = WebGL2RenderingContext.prototype[name];
    WebGL2RenderingContext.prototype[name] = function (...words) {
      if (words.some(word => word instanceof Float32Array && word.length === FLOATS)) {
        latency.uploads += 1;
        if (latency.pressed !== null) {
          latency.times.push(performance.now() - latency.pressed);
          latency.pressed = null;
        }
      }
      return plain.apply(this, words);
    };
  }
})();
""".replace("FLOATS", str(FLOATS))


class TimedPage(Page):
    """Notes how long each of its handlers takes [s], and the solve within."""

    def __init__(self, server: viser.ViserServer, live: LiveRobot) -> None:
        self.times: list[float] = []
        super().__init__(server, live, 1.0)

    def changed(self, event: Any = None) -> None:
        begin = time.perf_counter()
        super().changed(event)
        self.times.append(time.perf_counter() - begin)


class Measured(NamedTuple):
    """Slider to shape (n,), server (n,) and between frames (f,) [s], and what the browser complained of."""

    seen: np.ndarray
    served: np.ndarray
    frames: np.ndarray
    complaints: list[str]


def measure(robot: str, presses: int) -> Measured:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = new_server("127.0.0.1", port, robot)
    page = TimedPage(server, LiveRobot(load_robot(CONFIG / f"{robot}.yaml"), 1e-5))
    rng = np.random.default_rng(0)
    inner = len(page.alpha) - 1
    try:
        with Browser(address_of(server), WATCH) as browser:
            browser.until(lambda: "snap reserve" in browser.text and browser.run("latency.uploads") > 0)
            browser.run(f"document.querySelectorAll('[role=slider]')[{inner}].focus()")
            page.times.clear()
            browser.run("latency.frames.length = 0")
            for count in range(presses):
                browser.press("ArrowRight" if count % 100 < 50 else "ArrowLeft")
                browser.until(lambda wanted=count + 1: browser.run("latency.times.length") >= wanted)
                time.sleep(rng.uniform(*PAUSE))
            seen, frames = (1e-3 * np.array(browser.run(f"latency.{name}")) for name in ("times", "frames"))
            return Measured(seen, np.array(page.times), np.diff(frames), browser.complaints)
    finally:
        page.stop()


def told(times: np.ndarray, percent: float) -> str:
    return f"{1e3 * float(np.percentile(times[WARMING:], percent)):.1f} ms"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few presses, printed only")
    options = parser.parse_args()
    document, presses = (None, 30) if options.quick else (DOCUMENT, PRESSES)
    rows = []
    for robot in ROBOTS:
        run = measure(robot, presses)
        assert not run.complaints, run.complaints
        columns = (run.seen, 50), (run.seen, 99), (run.served, 50), (run.served, 99), (run.frames, 50)
        rows.append([robot, *(told(times, percent) for times, percent in columns)])
    busy = f"{os.getloadavg()[0]:.1f} processes wanted the {os.cpu_count()} cores"
    versions = f"Python {platform.python_version()}, viser {viser.__version__}"
    machine = f"{platform.machine()}, {versions}; {presses} presses each; u = {1e6 * unit():.3f} µs; {busy}."
    publish("page machine", machine, document)
    publish("page latency", table(["", "slider to shape p50", "p99", "server p50", "p99", "frame p50"], rows), document)


if __name__ == "__main__":
    main()
