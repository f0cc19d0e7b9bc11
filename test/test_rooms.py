"""The package is a house of rooms, one above the other: a room uses what is below it, never what is above."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "ctr_pvs"
#: From the ground up.
ROOMS = ("errors", "robot", "model", "kernel", "pvs", "answer", "oracles", "solve", "tasks", "renda2021", "cli")
#: Without scipy: what they compute is plain numpy.
PLAIN = ("robot", "model", "kernel")
#: Modules outside the rooms.
FRONT = {"__init__", "__main__", "errors"}
LONGEST = 350  # lines
FULLEST = 12  # modules in a room, beside __init__

NODE = PACKAGE.parent / "ctr_pvs_ros"
#: From the ground up: a part of the node uses those before it.
PARTS = (
    "parameters",
    "process",
    "inputs",
    "stream",
    "tip_servo",
    "outputs",
    "handler",
    "service",
    "arguments",
    "node",
    "executable",
    "client",
    "demo_picture",
    "demo",
    "front",
)
#: Hold the decisions; they are tried without ROS.
WITHOUT_ROS = (
    "inputs/joints",
    "inputs/commands",
    "inputs/wrenches",
    "inputs/external_load",
    "inputs/poses",
    "stream",
    "tip_servo",
)


def modules() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def room_of(path: Path) -> str | None:
    """The room that a module is in; None for the ground floor."""
    parts = path.relative_to(PACKAGE).parts
    return parts[0] if len(parts) > 1 else None


def imports(source: str) -> Iterator[str]:
    """All modules that a source imports, at the top of it or within functions; ``a.b`` for ``from a import b`` too,
    where b may be a module or a name in one."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = "." * node.level + (node.module or "")
            yield from (f"{base}.{alias.name}" for alias in node.names)


def forbidden(room: str, source: str) -> list[str]:
    """What a module in ``room`` imports from the package although it may not."""
    allowed = ROOMS[: ROOMS.index(room) + 1]
    wrong = []
    for name in imports(source):
        top, _, rest = name.partition(".")
        relative = not top  # one import has one spelling here, from the top
        if relative or (top == PACKAGE.name and rest.partition(".")[0] not in allowed):
            wrong.append(name)
    return wrong


def of(paths: list[Path]) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("path", paths, ids=lambda path: str(path.relative_to(PACKAGE)))


@of([path for path in modules() if room_of(path)])
def test_imports_go_down_only(path):
    assert room_of(path) in ROOMS
    assert forbidden(room_of(path), path.read_text(encoding="utf-8")) == []


def test_errors_stand_on_nothing():
    assert forbidden("errors", (PACKAGE / "errors.py").read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    ("source", "wrong"),
    [
        ("from ctr_pvs.errors import RobotError", False),
        ("from ctr_pvs.pvs.energy import FullEnergy", False),
        ("from ctr_pvs.robot import file", False),
        ("from ctr_pvs.model.shape import Shape", False),
        ("from ctr_pvs.shape import Shape", True),
        ("import numpy", False),
        ("from ctr_pvs.cli.main import main", True),
        ("from ctr_pvs import cli", True),
        ("import ctr_pvs.oracles.two_tubes as pair", True),
        ("import ctr_pvs", True),
        ("from ctr_pvs import EquilibriumSolver", True),
        ("from . import energy", True),
        ("from ..cli import main", True),
        ("def f():\n    from ctr_pvs.renda2021.robots import fig2_robot", True),
    ],
)
def test_a_way_up_is_seen(source, wrong):
    assert bool(forbidden("pvs", source)) is wrong


def test_the_ground_floor_holds_the_front_only():
    assert {path.stem for path in PACKAGE.glob("*.py")} == FRONT


@of(modules())
def test_no_module_imports_the_node_or_ros(path):
    tops = {name.partition(".")[0] for name in imports(path.read_text(encoding="utf-8"))}
    assert not tops & {"ctr_pvs_ros", "ctr_pvs_interfaces", "rclpy"}


def test_one_module_knows_of_clusters():
    """Tasks take any executor; who that is is settled at the command line."""
    knowing = {
        str(path.relative_to(PACKAGE))
        for path in modules()
        for name in imports(path.read_text(encoding="utf-8"))
        if name.partition(".")[0] in ("dask", "distributed")
    }
    assert knowing == {"cli/workers.py"}


@of([path for path in modules() if room_of(path) in PLAIN])
def test_plain_rooms_do_without_scipy(path):
    assert not [name for name in imports(path.read_text(encoding="utf-8")) if name.partition(".")[0] == "scipy"]


def test_no_module_is_long_and_no_room_is_full():
    lines = {str(path.relative_to(PACKAGE)): len(path.read_text(encoding="utf-8").splitlines()) for path in modules()}
    assert {name: count for name, count in lines.items() if count > LONGEST} == {}
    folders = [path.parent.name for path in (*modules(), *NODE.rglob("*.py")) if path.name != "__init__.py"]
    assert {folder: folders.count(folder) for folder in folders if folders.count(folder) > FULLEST} == {}


def test_every_room_says_what_is_in_it_and_holds_nothing_else():
    for path in PACKAGE.glob("*/__init__.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        starts_what_is_compiled = path.parent.name == "kernel"
        assert ast.get_docstring(tree) and (len(tree.body) == 1 or starts_what_is_compiled), path.parent.name


def part_of(path: Path) -> str:
    return path.relative_to(NODE).with_suffix("").parts[0]


@pytest.mark.parametrize("path", sorted(NODE.rglob("*.py")), ids=lambda path: str(path.relative_to(NODE)))
def test_parts_of_the_node_use_those_before_them(path):
    part, source = part_of(path), path.read_text(encoding="utf-8")
    allowed = PARTS[: PARTS.index(part) + 1] if part in PARTS else ()
    names = [name.split(".") for name in imports(source)]
    assert [name for name in names if name[0] == NODE.name and name[1] not in allowed] == []
    assert len(source.splitlines()) <= LONGEST
    assert part != "client" or not [name for name in names if name[0] == NODE.name and name[1] != "client"]


@pytest.mark.parametrize("name", WITHOUT_ROS)
def test_decisions_know_nothing_of_ros(name):
    tops = {name.partition(".")[0] for name in imports((NODE / f"{name}.py").read_text(encoding="utf-8"))}
    assert not {top for top in tops if top == "rclpy" or top.endswith(("_msgs", "_interfaces"))}
