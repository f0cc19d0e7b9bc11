"""Compiled kernels do what the functions they are made of do, also in threads, and take nothing else."""

from __future__ import annotations

import time

import pytest
from toy_fixtures import compiled_toy
from toy_fixtures import toy
from toy_kernel import needs_numba

# --- what runs --------------------------------------------------------------------------------------------------------


@needs_numba
def test_compiled_and_interpreted_kernels_give_the_same(compiled_toy):
    program = """
import numba
x = np.linspace(-2.0, 3.0, 11)
def run(step):
    out = np.empty(11)
    return step(x, out, 40), out.tolist()
fast = run(entries.wander)
assert isinstance(entries.wander, numba.core.dispatcher.Dispatcher)
plain = entries.wander.py_func
slow = run(plain)
compiler.use_interpreted()
assert entries.wander is plain and run(entries.wander) == slow and compiler.mode() == "interpreted"
assert compiler.use_compiled() and compiler.use_compiled() and compiler.mode() == "compiled"
assert run(entries.wander) == fast and entries.wander.py_func is plain
np.testing.assert_allclose(fast[1], slow[1], rtol=1e-14, atol=1e-14)
"""
    assert compiled_toy.say(program) == []


@needs_numba
def test_functions_inside_the_kernel_stay_as_they_are_written(compiled_toy):
    """So tests of one function run it interpreted, with no compiling, and ``py_func`` is interpreted to the bottom."""
    program = """
import types
from ctr_pvs.kernel import inner
assert compiler.mode() == "compiled"
assert all(isinstance(f, types.FunctionType) for f in (inner.total, inner.term, entries.added))
assert entries.add.py_func.__globals__ is vars(entries)
"""
    assert compiled_toy.say(program) == []


@needs_numba
def test_arrays_of_other_kinds_are_refused_at_once(compiled_toy):
    program = """
import time
read_only = np.arange(3.0)
read_only.flags.writeable = False
single = np.arange(3, dtype=np.float32)
for wrong in (read_only, np.arange(6.0)[::2], np.arange(3), single, np.ones((3, 3)), [1.0], None):
    began = time.perf_counter()
    try:
        entries.add(wrong)
    except TypeError:
        assert time.perf_counter() - began < 0.1
    else:
        print("taken:", wrong)
print(len(entries.add.signatures))
"""
    assert compiled_toy.say(program) == ["1"]


@needs_numba
def test_threads_run_a_kernel_at_once(compiled_toy):
    program = """
import threading
from concurrent.futures import ThreadPoolExecutor
both = threading.Barrier(2, timeout=30)
def run(seed):
    x, out = np.random.default_rng(seed).normal(size=200), np.empty(200)
    both.wait()
    for _ in range(20):
        entries.wander(x, out, 200)
    return out.tolist()
with ThreadPoolExecutor(2) as pool:
    together = list(pool.map(run, [1, 2]))
both = threading.Barrier(1)
print(together == [run(1), run(2)])
"""
    assert compiled_toy.say(program) == ["True"]


@needs_numba
def test_the_switch_may_come_while_a_thread_is_inside_a_kernel(compiled_toy):
    program = """
import threading
x = np.arange(200.0)
right, stop, wrong = entries.add(x), threading.Event(), []
def run():
    while not stop.is_set():
        if entries.add(x) != right:
            wrong.append(1)
thread = threading.Thread(target=run)
thread.start()
for _ in range(5):
    compiler.use_interpreted()
    assert compiler.use_compiled()
stop.set()
thread.join()
print(wrong)
"""
    assert compiled_toy.say(program) == ["[]"]


def test_only_plain_functions_of_a_module_can_be_registered(toy):
    program = """
def outer():
    def inner():
        pass
    return inner
for wrong in (len, outer(), type("Step", (), {})):
    try:
        compiler.compiled(wrong)
    except TypeError as error:
        print(error)
"""
    lines = toy.say(program, NUMBA_DISABLE_JIT="1")
    assert len(lines) == 3 and all(line.startswith("expected a plain function of a module") for line in lines)
