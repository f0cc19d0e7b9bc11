"""What all benches share: the clock, energies at one degree, tables in documents, and who imports whom."""

from __future__ import annotations

import ast
from graphlib import TopologicalSorter
from pathlib import Path

import numpy as np
import pytest

from bench.common.clock import Stopwatch
from bench.common.clock import repeated
from bench.common.clock import unit
from bench.common.dense import FixedDegree
from bench.common.dense import nearest
from bench.common.document import publish
from bench.common.document import table
from bench.common.nested_robots import nested
from bench.common.places import ROOT
from ctr_pvs import EquilibriumSolver
from ctr_pvs.solve.equilibria import stationary

FULLEST = 12  # modules in a folder
#: The only modules that draw.
CHARTS = {
    "bench.growth.chart",
    "bench.inverse.path_chart",
    "bench.loads.compliance_sweep",
    "bench.loads.cost_chart",
    "bench.loaded.failure_chart",
    "bench.loads.snap_map",
    "bench.loads.turning_force",
    "bench.pvs.insertion_figures",
    "bench.speed.chart",
    "bench.stability.chart",
}


def modules() -> dict[str, Path]:
    paths = sorted((ROOT / "bench").rglob("*.py"))
    return {".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): path for path in paths}


def imported(path: Path) -> set[str]:
    """Modules of ``bench`` that a module imports anywhere."""
    every = modules()
    names = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("bench"):
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
    return names & {name for name, path in every.items() if path.name != "__init__.py"}


def test_no_module_is_in_a_circle():
    graph = {name: imported(path) for name, path in modules().items()}
    assert list(TopologicalSorter(graph).static_order())


def test_only_charts_draw_and_only_scripts_import_them():
    for name, path in modules().items():
        text = path.read_text(encoding="utf-8")
        assert (name in CHARTS) or "matplotlib." not in text, name
        if imported(path) & CHARTS:
            assert 'if __name__ == "__main__"' in text, name


def test_no_folder_is_full_and_each_says_what_is_in_it():
    folders = [path.parent for path in modules().values() if path.name == "__init__.py"]
    for folder in folders:
        assert len([path for path in folder.glob("*.py") if path.name != "__init__.py"]) <= FULLEST
        assert ast.get_docstring(ast.parse((folder / "__init__.py").read_text(encoding="utf-8")))


def test_the_clock():
    u = unit()
    assert 1e-8 < u < 1e-3
    timing = repeated(lambda: sum(range(1000)), 5)
    assert timing.microseconds == pytest.approx(1e6 * timing.seconds)
    watch = Stopwatch()
    assert watch.time(lambda: 7) == 7 and watch.spent == watch.seconds[0] > 0.0


def test_tables_go_between_their_markers(tmp_path):
    document = tmp_path / "page.md"
    document.write_text("a\n<!-- x -->\nold\n<!-- end x -->\nb\n")
    publish("x", table(["h"], [["1"]]), document)
    assert document.read_text() == "a\n<!-- x -->\n| h |\n| --- |\n| 1 |\n<!-- end x -->\nb\n"
    with pytest.raises(ValueError):
        publish("y", "", document)


def test_an_energy_at_one_degree_has_the_equilibria_of_the_solver():
    robot, D = nested(3)
    alpha = np.array([0.0, 0.4, 0.9])
    answer = EquilibriumSolver(robot, 1e-9).solve(alpha, D)
    errors = []
    for degree in (1, 2, 4, 8):
        energy = FixedDegree(robot, D, degree)
        y, _ = stationary(energy, alpha, np.zeros(energy.n), np.inf)
        assert energy.degrees.max() == degree
        assert energy.twist_size(y - nearest(energy, answer.shape, alpha)) < 0.05
        errors.append(np.linalg.norm(energy.state(y, alpha).tip[:3] - answer.tip.position))
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2] and errors[-1] < 1e-9
    s = np.linspace(0.0, robot.length_beyond(D), 7)
    assert alpha + energy.map_at(s) @ y == pytest.approx(answer.shape.angles_held(s), abs=1e-7)
    assert energy.margin(y, alpha) == pytest.approx(answer.stability_margin, abs=1e-6)
