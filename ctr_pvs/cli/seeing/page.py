"""The page of one equilibrium: one HTML file that turns under the mouse and loads nothing, so it works anywhere, also
from an e-mail or without a network."""

from __future__ import annotations

import html
import json
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ctr_pvs.cli.seeing.drawn import Drawn
from ctr_pvs.renda2021.figures import MM

Array = NDArray[np.float64]


def save_page(drawn: Drawn, path: Path) -> None:
    """Writes the page.  Raises ``OSError`` where it cannot be written."""
    told = "<br>".join(html.escape(line) for line in drawn.told)
    page = _PAGE.replace("@TITLE@", html.escape(drawn.title)).replace("@TOLD@", told)
    path.write_text(page.replace("@DATA@", json.dumps(_data(drawn), allow_nan=False)), encoding="utf-8")


def _data(drawn: Drawn) -> dict[str, object]:
    """In mm, degrees, 1/m and N mm, with few digits: a picture."""
    return {
        "tubes": [
            {
                "name": tube.name,
                "colour": list(tube.colour),
                "diameter": MM * tube.diameter,
                "points": np.round(MM * tube.position, 3).tolist(),
                "twist": _rounded(np.degrees(twist)),
                "bending": _rounded(MM * bending),
                "twisting": _rounded(MM * twisting),
            }
            for tube, twist, bending, twisting in zip(
                drawn.tubes, drawn.twist.T, drawn.moments.bending.T, drawn.moments.twisting.T, strict=True
            )
        ],
        "s": np.round(MM * drawn.s, 3).tolist(),
        "curvature": np.round(drawn.curvature, 4).tolist(),
        "bending": _rounded(MM * drawn.moments.all_bending),
        "twisting": _rounded(MM * drawn.moments.all_twisting),
        "tip": np.round(MM * drawn.tip, 3).tolist(),
        "force": drawn.tip_force.tolist(),
    }


def _rounded(values: Array) -> list[float | None]:
    """None where a tube is not."""
    return [None if np.isnan(value) else round(float(value), 3) for value in values]


_PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>@TITLE@</title>
<style>
body { font: 14px sans-serif; margin: 12px; color: #222; background: #fff; }
canvas { width: 100%; display: block; touch-action: none; }
#shape { height: 60vh; border: 1px solid #ccc; cursor: grab; }
.curves { display: flex; gap: 12px; } .curves div { flex: 1; } .curves canvas { height: 24vh; }
.key span { margin-right: 18px; } .key i { display: inline-block; width: 28px; height: 8px; margin-right: 6px; }
</style></head><body>
<b>@TITLE@</b><br>@TOLD@
<div class="key" id="key"></div>
<canvas id="shape"></canvas>
<div class="curves"><div>twist ψ [deg] along s [mm]<canvas id="twist"></canvas></div>
<div>curvature [1/m] along s [mm]<canvas id="curvature"></canvas></div></div>
<div class="curves"><div>bending moment [N mm] along s [mm], grey: of all tubes<canvas id="bending"></canvas></div>
<div>twisting moment [N mm] along s [mm], grey: of all tubes<canvas id="twisting"></canvas></div></div>
<small>Drag to turn, wheel to zoom, double click to reset. x is the insertion direction.</small>
<script>
"use strict";
const data = @DATA@;
const all = data.tubes.flatMap(tube => tube.points).concat([[0, 0, 0], data.tip]);
const low = [0, 1, 2].map(i => Math.min(...all.map(p => p[i])));
const high = [0, 1, 2].map(i => Math.max(...all.map(p => p[i])));
const middle = low.map((v, i) => (v + high[i]) / 2);
const size = Math.max(1e-6, Math.hypot(...high.map((v, i) => v - low[i])));
const FIRST = { yaw: -0.6, pitch: 0.45, zoom: 1 };
let view = { ...FIRST };

function prepared(id) {
  const canvas = document.getElementById(id), ratio = window.devicePixelRatio || 1;
  canvas.width = canvas.clientWidth * ratio; canvas.height = canvas.clientHeight * ratio;
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio); pen.lineCap = "round"; pen.font = "12px sans-serif";
  return [pen, canvas.clientWidth, canvas.clientHeight];
}
function drawShape() {
  const [pen, width, height] = prepared("shape");
  const scale = 0.9 * view.zoom * Math.min(width, height) / size;
  const [cy, sy, cp, sp] = [Math.cos(view.yaw), Math.sin(view.yaw), Math.cos(view.pitch), Math.sin(view.pitch)];
  const seen = p => {  // right, up, towards the eye
    const [x, y, z] = p.map((v, i) => v - middle[i]);
    const across = cy * x - sy * y, depth = sy * x + cy * y;
    return [width / 2 + scale * across, height / 2 - scale * (cp * z + sp * depth), sp * z - cp * depth];
  };
  const lines = [];
  const add = (a, b, colour, wide) => {
    const [p, q] = [seen(a), seen(b)];
    lines.push({ p, q, colour, wide, depth: (p[2] + q[2]) / 2 });
  };
  for (const [j, tube] of data.tubes.entries())
    for (let i = 1; i < tube.points.length; i++) {
      const [a, b] = [tube.points[i - 1], tube.points[i]];
      if (data.tubes.slice(0, j).some(other => other.points.length && covers(other, i, tube))) continue;
      const [p, q] = [seen(a), seen(b)];
      const flat = Math.hypot(q[0] - p[0], q[1] - p[1]) / (scale * Math.hypot(...a.map((v, k) => v - b[k])) || 1);
      const light = 0.65 + 0.35 * Math.min(1, flat);
      add(a, b, `rgb(${tube.colour.map(c => Math.round(c * light)).join()})`, Math.max(1, scale * tube.diameter));
    }
  const along = (i, length) => [0, 1, 2].map(k => k === i ? length : 0);
  ["#c33", "#393", "#33c"].forEach((colour, i) => add([0, 0, 0], along(i, size / 8), colour, 2));
  if (data.force.some(v => v)) {
    const most = Math.hypot(...data.force);
    add(data.tip.map((v, i) => v - data.force[i] / most * size / 6), data.tip, "#000", 2);
  }
  lines.sort((a, b) => a.depth - b.depth);
  for (const line of lines) {
    pen.strokeStyle = line.colour; pen.lineWidth = line.wide;
    pen.beginPath(); pen.moveTo(line.p[0], line.p[1]); pen.lineTo(line.q[0], line.q[1]); pen.stroke();
  }
  pen.fillStyle = "#222";
  "xyz".split("").forEach((name, i) => {
    const p = seen(along(i, size / 7));
    pen.fillText(name, p[0], p[1]);
  });
}
// Poses are at equal spacing along each tube: an inner tube is hidden as far as an outer one reaches.
function reach(tube) {
  let sum = 0;
  for (let i = 1; i < tube.points.length; i++)
    sum += Math.hypot(...tube.points[i].map((v, k) => v - tube.points[i - 1][k]));
  return sum;
}
function covers(outer, i, tube) { return reach(tube) * i / (tube.points.length - 1) <= reach(outer); }
function drawCurves(id, curves) {
  const [pen, width, height] = prepared(id), left = 52, below = 20, top = 8;
  const values = curves.flatMap(curve => curve.y).filter(v => v !== null);
  let [bottom, most] = [Math.min(0, ...values), Math.max(0, ...values)];
  if (most - bottom < 1e-9) most = bottom + 1;
  const end = data.s[data.s.length - 1] || 1;
  const x = s => left + (width - left - 12) * s / end;
  const y = v => top + (height - top - below) * (most - v) / (most - bottom);
  pen.strokeStyle = "#ddd"; pen.fillStyle = "#222";
  for (let i = 0; i <= 4; i++) {
    const v = bottom + (most - bottom) * i / 4, s = end * i / 4;
    pen.beginPath(); pen.moveTo(left, y(v)); pen.lineTo(width - 12, y(v)); pen.stroke();
    pen.textAlign = "right"; pen.fillText(v.toPrecision(3), left - 6, y(v) + 4);
    pen.textAlign = "center"; pen.fillText(s.toPrecision(3), x(s), height - 5);
  }
  for (const curve of curves) {
    pen.strokeStyle = curve.colour; pen.lineWidth = 2; pen.beginPath();
    let on = false;
    curve.y.forEach((v, i) => {
      if (v === null) { on = false; return; }
      if (on) pen.lineTo(x(curve.s[i]), y(v)); else pen.moveTo(x(curve.s[i]), y(v));
      on = true;
    });
    pen.stroke();
  }
}
function draw() {
  drawShape();
  const between = data.curvature.map((_, i) => (data.s[i] + data.s[i + 1]) / 2);
  const each = (s, name) => data.tubes.map(tube => ({ s, y: tube[name], colour: `rgb(${tube.colour.join()})` }));
  const together = name => ({ s: between, y: data[name], colour: "#444" });
  drawCurves("twist", each(data.s, "twist"));
  drawCurves("curvature", [together("curvature")]);
  for (const name of ["bending", "twisting"]) drawCurves(name, [...each(between, name), together(name)]);
}
document.getElementById("key").innerHTML = data.tubes.map(tube =>
  `<span><i style="background: rgb(${tube.colour.join()})"></i>${tube.name}, ${tube.diameter.toFixed(2)} mm</span>`
).join("");
const shape = document.getElementById("shape");
shape.addEventListener("pointerdown", event => shape.setPointerCapture(event.pointerId));
shape.addEventListener("pointermove", event => {
  if (!event.buttons) return;
  view.yaw += event.movementX * 0.008; view.pitch += event.movementY * 0.008; drawShape();
});
shape.addEventListener("wheel", event => {
  event.preventDefault(); view.zoom *= Math.exp(-event.deltaY * 0.001); drawShape();
}, { passive: false });
shape.addEventListener("dblclick", () => { view = { ...FIRST }; drawShape(); });
window.addEventListener("resize", draw);
draw();
</script></body></html>
"""
