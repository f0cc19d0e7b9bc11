"""Compiling in processes of its own, in front and in the background: once, with reasons, and ended by a signal."""

from __future__ import annotations

import signal
import time

import pytest
from busy_machine import check_in_time
from toy_fixtures import slow_toy
from toy_fixtures import toy
from toy_kernel import ADD
from toy_kernel import AT_ONCE
from toy_kernel import COMPILED
from toy_kernel import ENTRIES
from toy_kernel import INTERPRETED
from toy_kernel import SLOWER
from toy_kernel import Toy
from toy_kernel import folders
from toy_kernel import needs_numba
from toy_kernel import processes
from toy_kernel import wait_for

# --- compiling --------------------------------------------------------------------------------------------------------


@needs_numba
def test_two_runs_at_once_compile_once(toy):
    runs = [toy.start("-m", "ctr_pvs.kernel") for _ in range(2)]
    said = sorted(run.communicate(timeout=60)[0] for run in runs)
    assert [run.returncode for run in runs] == [0, 0]
    assert said[0].startswith("another process has compiled") and said[1].startswith("compiled 2 entry points")
    assert len(folders(toy)) == 1 and toy.say(ADD) == COMPILED


@needs_numba
def test_what_cannot_be_compiled_is_named_and_leaves_nothing(tmp_path):
    toy = Toy(tmp_path, ENTRIES + '\n@entry_point("int64(int64)")\ndef bad(x):\n    return unknown(x)\n')
    out = toy.compile(code=1)
    assert out.startswith("kernels could not be compiled: bad: TypingError: ") and "'unknown'" in out
    assert len(out.splitlines()) == 1
    assert folders(toy) == [] and toy.say(ADD) == INTERPRETED


@needs_numba
def test_a_performance_warning_of_numba_is_an_error(tmp_path):
    text = '\n@entry_point("float64(float64[:], float64[:])")\ndef dot(x, y):\n    return np.dot(x, y)\n'
    toy = Toy(tmp_path, "import numpy as np\n" + ENTRIES + text)
    (toy.code / "scipy.py").unlink()
    assert "NumbaPerformanceWarning" in toy.compile(code=1)


@needs_numba
def test_a_kernel_that_allocates_is_an_error(tmp_path):
    """Numba would make a copy of x here, for the case that both are parts of one array."""
    text = '\n@entry_point("int64(float64[::1], float64[::1])")\ndef make(x, y):\n    y[:] = x\n    return len(y)\n'
    toy = Toy(tmp_path, ENTRIES + text)
    assert toy.compile(code=1).startswith("kernels could not be compiled: make: ")


@needs_numba
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_compiling_with_all_its_processes(slow_toy, number):
    run = slow_toy.start("-m", "ctr_pvs.kernel")
    wait_for(lambda: len(processes(slow_toy)) == 3, 20, "no processes that compile")
    time.sleep(1.0)  # let them compile
    began = time.monotonic()
    run.send_signal(number)
    out, err = run.communicate(timeout=20)
    wait_for(lambda: processes(slow_toy) == [], AT_ONCE, "a process went on")
    check_in_time(time.monotonic() - began, AT_ONCE)
    assert run.returncode == -number and out == "compiling the kernels was stopped\n" and "Trace" not in err
    assert folders(slow_toy) == []


@needs_numba
def test_processes_that_compile_end_with_the_one_that_started_them(slow_toy):
    run = slow_toy.start("-m", "ctr_pvs.kernel")
    wait_for(lambda: len(processes(slow_toy)) == 3, 20, "no processes that compile")
    time.sleep(1.0)
    run.kill()
    run.communicate()
    wait_for(lambda: processes(slow_toy) == [], AT_ONCE, "a process went on")


# --- compiling in the background --------------------------------------------------------------------------------------

BACKGROUND = "import os, signal, sys, time\nhandle = compiler.compile_in_background(lambda line: print(line))\n"


@needs_numba
def test_a_cold_start_serves_interpreted_compiles_beside_and_switches(toy):
    first, line, second, ended = toy.say(BACKGROUND + ADD + "handle.wait(60)\n" + ADD + "print(handle.running)\n")
    assert [first] == INTERPRETED and [second] == COMPILED and ended == "False"
    assert line.startswith("compiled 2 entry points in ") and line.endswith("from now on they run compiled")
    assert toy.say(BACKGROUND + "print(handle.running)\nhandle.stop()\n" + ADD) == ["False", *COMPILED]


@needs_numba
def test_a_failure_in_the_background_is_told_once(tmp_path):
    toy = Toy(tmp_path, ENTRIES + '\n@entry_point("int64(int64)")\ndef bad(x):\n    return unknown(x)\n')
    line, *rest = toy.say(BACKGROUND + "handle.wait(60)\n" + ADD)
    assert line.startswith("kernels could not be compiled: bad: ") and line.endswith(SLOWER) and rest == INTERPRETED


@needs_numba
def test_stop_ends_it_also_from_a_signal_handler(slow_toy):
    program = """
def stop(number, frame):
    began = time.monotonic()
    handle.stop()
    print(time.monotonic() - began, flush=True)
    sys.exit(0)
signal.signal(signal.SIGTERM, stop)
print("ready", flush=True)
handle.wait(60)
"""
    imports = "import numpy as np\nfrom ctr_pvs.kernel import compiler, entries\n"
    run = slow_toy.start("-c", imports + BACKGROUND + program)
    wait_for(lambda: len(processes(slow_toy)) == 4, 20, "no processes that compile")
    time.sleep(0.5)
    run.terminate()
    out, err = run.communicate(timeout=20)
    assert out.startswith("ready\n") and float(out.split()[1]) < 1.0 and len(out.split()) == 2, out + err
    wait_for(lambda: processes(slow_toy) == [], AT_ONCE, "a process went on")
    assert folders(slow_toy) == []


@needs_numba
def test_the_background_ends_with_the_process_it_belongs_to(slow_toy):
    imports = "from ctr_pvs.kernel import compiler\n"
    run = slow_toy.start("-c", imports + BACKGROUND + "handle.wait(60)\n")
    wait_for(lambda: len(processes(slow_toy)) == 4, 20, "no processes that compile")
    run.kill()
    run.communicate()
    wait_for(lambda: processes(slow_toy) == [], AT_ONCE, "a process went on")
    assert folders(slow_toy) == []
