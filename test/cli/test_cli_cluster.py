"""--scheduler: the rows of threads, bit for bit, from workers of a Dask cluster, whatever becomes of these."""

from __future__ import annotations

import math
import os
import shutil
import signal
import sys
import threading
import time
from collections.abc import Iterator

import pytest

from ctr_pvs.cli import main as cli
from ctr_pvs.cli import workers
from ctr_pvs.cli.seeing.progress import Progress
from ctr_pvs.kernel import compiler
from ctr_pvs.tasks.sweep import Grid

pytest.importorskip("distributed")
from dask_processes import ROOT
from dask_processes import DaskProcesses

ROBOT = str(ROOT / "config" / "three_tubes.yaml")
BASES = ["--D-range", "0.06", "0.14", "0.2:0.28:5", "--degrees"]
GRID = ["--alpha-range", "0", "-180:150:4", "-180:150:6", *BASES]  # 120 rows
LONG = ["--alpha-range", "0", "-180:171:40", "-180:150:6", *BASES]  # 1200 rows


@pytest.fixture(scope="module")
def busy(tmp_path_factory) -> Iterator[DaskProcesses]:
    """A scheduler with two workers."""
    cluster = DaskProcesses(tmp_path_factory.mktemp("busy"))
    for _ in range(2):
        cluster.start_worker()
    cluster.wait_for_workers(2)
    yield cluster
    cluster.close()


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory) -> Iterator[DaskProcesses]:
    """A scheduler without workers."""
    cluster = DaskProcesses(tmp_path_factory.mktemp("scheduler"))
    yield cluster
    cluster.close()


@pytest.fixture
def idle(scheduler) -> Iterator[DaskProcesses]:
    """The same, for tests that start workers of their own."""
    yield scheduler
    scheduler.stop_workers()


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> bytes:
    """The table of LONG by threads."""
    path = tmp_path_factory.mktemp("whole") / "whole.csv"
    assert cli.main(["sweep", ROBOT, *LONG, "--output", str(path)]) == 0
    return path.read_bytes()


def run(capsys, command: str, *words: object, code: int = 0) -> str:
    """Standard output, or the lines on standard error where it is to fail."""
    assert cli.main([command, ROBOT, *map(str, words)]) == code
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err and "distributed" not in captured.err
    return captured.err if code == 2 else captured.out


@pytest.mark.parametrize("force", [[], ["--tip-force", "0", "0.2", "-0.1"]], ids=["unloaded", "loaded"])
def test_the_bits_of_threads(capsys, tmp_path, busy, force):
    tables = tmp_path / "threads.csv", tmp_path / "cluster.csv"
    run(capsys, "sweep", *GRID, *force, "--output", tables[0])
    out = run(capsys, "sweep", *GRID, *force, "--output", tables[1], "--scheduler", busy.address)
    assert "120 of 120 rows" in out
    assert tables[0].read_bytes() == tables[1].read_bytes()


def test_the_reach_by_a_cluster(capsys, tmp_path, busy):
    words = ["--count", "150", "--seed", "3"]
    here = run(capsys, "workspace", *words)
    assert run(capsys, "workspace", *words, "--scheduler", busy.address) == here


def test_a_design_by_a_cluster(capsys, tmp_path, busy):
    """The same robot, whoever tries the designs."""
    targets = tmp_path / "targets.csv"
    targets.write_text("x,y,z\n0.09,0.02,-0.03\n0.11,-0.03,-0.02\n", encoding="utf-8")
    words = ["design", str(ROOT / "config" / "renda2021.yaml"), str(targets), "--starts", "2", "--vary", "curvature"]
    here, there = tmp_path / "here.yaml", tmp_path / "there.yaml"
    assert cli.main([*words, "--write", str(here)]) == 0
    assert cli.main([*words, "--write", str(there), "--scheduler", busy.address]) == 0
    assert "2 of 2 targets reached" in capsys.readouterr().out
    assert here.read_text(encoding="utf-8") == there.read_text(encoding="utf-8")


@pytest.mark.parametrize("first", ["threads", "cluster"])
def test_one_goes_on_where_the_other_was_stopped(capsys, tmp_path, monkeypatch, busy, first):
    whole, path = tmp_path / "whole.csv", tmp_path / "parts.csv"
    run(capsys, "sweep", *GRID, "--output", whole)
    plain = Grid.rows

    def interrupted(grid, start, stop):
        os.kill(os.getpid(), signal.SIGINT)
        return plain(grid, start, min(stop, start + 30))

    on_cluster, by_threads = ["--scheduler", busy.address], []
    order = (by_threads, on_cluster) if first == "threads" else (on_cluster, by_threads)
    with monkeypatch.context() as patched:
        patched.setattr(Grid, "rows", interrupted)
        assert "30 of 120 rows" in run(capsys, "sweep", *GRID, "--output", path, *order[0], code=130)
    assert "new: 90 ok" in run(capsys, "sweep", *GRID, "--output", path, "--resume", *order[1])
    assert path.read_bytes() == whole.read_bytes()


def test_a_killed_worker_takes_nothing_along(capsys, tmp_path, monkeypatch, idle, whole):
    path = tmp_path / "killed.csv"
    victim, _ = idle.start_worker(), idle.start_worker()
    idle.wait_for_workers(2)
    tell, killed_at = Progress.tell, []

    def kill(progress: Progress, done: int) -> None:
        if not killed_at and done > 100:
            victim.kill()
            killed_at.append(done)
        tell(progress, done)

    monkeypatch.setattr(Progress, "tell", kill)
    assert "1200 of 1200 rows" in run(capsys, "sweep", *LONG, "--output", path, "--scheduler", idle.address)
    assert killed_at[0] < 1200 and victim.wait() == -signal.SIGKILL and idle.count() == 1
    assert path.read_bytes() == whole


def test_without_any_worker_left_what_is_done_is_kept(capsys, tmp_path, monkeypatch, idle, whole):
    path = tmp_path / "lost.csv"
    worker, tell = idle.start_worker(), Progress.tell
    idle.wait_for_workers(1)

    def kill(progress: Progress, done: int) -> None:
        worker.kill()
        tell(progress, done)

    with monkeypatch.context() as patched:
        patched.setattr(Progress, "tell", kill)
        patched.setattr(workers, "NO_WORKER", 1.0)
        patched.setattr(workers, "LOOK", 0.2)
        words = ["--output", path, "--scheduler", idle.address]
        said = run(capsys, "sweep", *LONG, *words, code=2).splitlines()[-1]
    rows = len(path.read_text().splitlines()) - 1
    assert 0 < rows < 1200 and f"{rows} of 1200 rows are kept, --resume goes on" in said
    assert "had no workers for 1 s; start some with: dask worker tcp://" in said
    run(capsys, "sweep", *LONG, "--output", path, "--resume")
    assert path.read_bytes() == whole


def test_a_scheduler_that_does_not_answer(capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(workers, "CONNECT", 0.5)
    words = [*GRID, "--output", tmp_path / "t.csv", "--scheduler", "tcp://127.0.0.1:1"]
    (line,) = run(capsys, "sweep", *words, code=2).splitlines()
    assert "no Dask scheduler answers at tcp://127.0.0.1:1" in line and "dask scheduler" in line
    assert list(tmp_path.iterdir()) == []


def test_a_scheduler_without_workers(capsys, tmp_path, monkeypatch, idle):
    monkeypatch.setattr(workers, "FIRST_WORKER", 1.0)
    words = ["--output", tmp_path / "t.csv", "--scheduler", idle.address]
    waits, line = run(capsys, "sweep", *GRID, *words, code=2).splitlines()
    assert waits.endswith("has no workers: waiting 1 s for the first")
    assert f"had no workers for 1 s; start some with: dask worker {idle.address}" in line
    assert list(tmp_path.iterdir()) == []


def test_ctrl_c_while_waiting_for_workers(capsys, tmp_path, idle):
    timer = threading.Timer(3.0, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    run(capsys, "sweep", *GRID, "--output", tmp_path / "t.csv", "--scheduler", idle.address, code=130)
    timer.join()
    assert list(tmp_path.iterdir()) == []


def test_a_worker_without_the_package_or_with_another(capsys, tmp_path, idle):
    """What stands for an environment without it is found first, should one be installed, too."""
    words = ["--output", tmp_path / "t.csv", "--scheduler", idle.address]
    for text in ("raise ModuleNotFoundError(\"No module named 'ctr_pvs'\")", "# another package of that name"):
        package = tmp_path / "elsewhere" / "ctr_pvs"
        package.mkdir(parents=True, exist_ok=True)
        (package / "__init__.py").write_text(text)
        idle.start_worker(PYTHONPATH=str(package.parent), PYTHONDONTWRITEBYTECODE="1")
        idle.wait_for_workers(1)
        (line,) = run(capsys, "sweep", *GRID, *words, code=2).splitlines()
        assert "a worker has no ctr_pvs like this one (No module named 'ctr_pvs" in line and "install 0.1" in line
        idle.stop_workers()
    assert not (tmp_path / "t.csv").exists()


def test_a_worker_with_other_sources(capsys, tmp_path, idle):
    folder = tmp_path / "elsewhere"
    for name in ("ctr_pvs", "config"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "package.xml", folder)
    with (folder / "ctr_pvs" / "tasks" / "sweep.py").open("a") as file:
        file.write("# edited\n")
    idle.start_worker(PYTHONPATH=str(folder))
    idle.wait_for_workers(1)
    words = ["--output", tmp_path / "t.csv", "--scheduler", idle.address]
    (line,) = run(capsys, "sweep", *GRID, *words, code=2).splitlines()
    assert "has ctr_pvs 0.1" in line and f"in place of {workers.identity()['ctr_pvs']}" in line
    assert "install the same versions" in line


@pytest.mark.skipif(compiler.mode() == "interpreted", reason="nothing is compiled here")
def test_a_worker_that_interprets_kernels(capsys, tmp_path, idle):
    """Its rows would have other last digits, and come far later."""
    idle.start_worker(NUMBA_DISABLE_JIT="1")
    idle.wait_for_workers(1)
    words = ["--output", tmp_path / "t.csv", "--scheduler", idle.address]
    (line,) = run(capsys, "sweep", *GRID, *words, code=2).splitlines()
    assert "kernels interpreted in place of compiled" in line and "python -m ctr_pvs.kernel" in line


def test_other_tasks_can_use_it_too(busy):
    """Results and errors of functions as they are; from one place for every sub-command."""
    with workers.executor(busy.address) as pool:
        assert pool.submit(workers.identity).result(60.0) == workers.identity()
        assert list(pool.map(math.hypot, [3.0, 5.0], [4.0, 12.0])) == [5.0, 13.0]
        with pytest.raises(ValueError, match="math domain error"):
            pool.submit(math.sqrt, -1.0).result(60.0)
    with workers.executor(None) as pool:
        assert pool.submit(workers.identity).result() == workers.identity()


def test_words(capsys, tmp_path, monkeypatch):
    output = ["--output", tmp_path / "t.csv"]
    said = run(capsys, "sweep", *GRID, *output, "--scheduler", "nonsense", code=2)
    assert "expected an address such as tcp://host:8786, got 'nonsense'" in said
    monkeypatch.setitem(sys.modules, "distributed", None)
    said = run(capsys, "sweep", *GRID, *output, "--scheduler", "tcp://127.0.0.1:8786", code=2)
    assert said == "ctr-pvs: --scheduler needs Dask (pip install 'ctr_pvs[cluster]')\n"


@pytest.mark.soak
def test_a_scheduler_that_ends_in_the_middle(capsys, tmp_path, monkeypatch, tmp_path_factory):
    cluster = DaskProcesses(tmp_path_factory.mktemp("ending"))
    try:
        cluster.start_worker()
        cluster.wait_for_workers(1)
        tell = Progress.tell

        def end(progress: Progress, done: int) -> None:
            cluster.close()
            tell(progress, done)

        monkeypatch.setattr(Progress, "tell", end)
        monkeypatch.setattr(workers, "CONNECT", 1.0)
        monkeypatch.setattr(workers, "NO_WORKER", 5.0)
        path, began = tmp_path / "t.csv", time.monotonic()
        said = run(capsys, "sweep", *LONG, "--output", path, "--scheduler", cluster.address, code=2)
        assert "rows are kept, --resume goes on" in said.splitlines()[-1]
        assert time.monotonic() - began < 60.0
    finally:
        cluster.close()
