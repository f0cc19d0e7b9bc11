"""How kernels are compiled, kept, found again and switched to: one rule a test, on a toy, in processes of its own."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import stat
import time
from pathlib import Path

import pytest
from busy_machine import check_in_time
from toy_kernel import ENTRIES
from toy_kernel import SLOW
from toy_kernel import Toy

needs_numba = pytest.mark.skipif(importlib.util.find_spec("numba") is None, reason="Numba is not installed")

#: One line: what runs, and the sum of 0, 1, 2 doubled.
ADD = "print(compiler.mode(), entries.add(np.arange(3.0)))\n"
INTERPRETED, COMPILED = ["interpreted 6.0"], ["compiled 6.0"]
WHY = "print(compiler.why())\n"
SLOWER = "kernels run interpreted, slower, with the same numbers"
AT_ONCE = 2.0  # s, for what ends when it is told to


@pytest.fixture
def toy(tmp_path: Path) -> Toy:
    """Nothing is compiled in it."""
    return Toy(tmp_path)


@pytest.fixture(scope="module")
def compiled_toy(tmp_path_factory: pytest.TempPathFactory) -> Toy:
    """All is compiled in it; not to be changed."""
    toy = Toy(tmp_path_factory.mktemp("compiled"))
    toy.compile()
    return toy


@pytest.fixture
def copied_cache(compiled_toy: Toy, tmp_path: Path) -> tuple[Toy, dict[str, str], Path]:
    """The toy in which all is compiled, the variable that leads it to a copy of its cache, and the folder in there."""
    cache = shutil.copytree(compiled_toy.cache, tmp_path / "cache")
    (folder,) = (path for path in (cache / "ctr_pvs").iterdir() if path.is_dir())
    return compiled_toy, {"XDG_CACHE_HOME": str(cache)}, folder


@pytest.fixture
def slow_toy(tmp_path: Path) -> Toy:
    """Compiling it takes about ten seconds."""
    return Toy(tmp_path, ENTRIES + SLOW)


def folders(toy: Toy) -> list[Path]:
    """What lies in the cache, the lock left out."""
    return [path for path in (toy.cache / "ctr_pvs").glob("*") if path.is_dir()]


def processes(toy: Toy) -> list[int]:
    """Processes that run code of ``toy``, by the path they look for modules on."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            if str(toy.code).encode() in (process / "environ").read_bytes():
                found.append(int(process.name))
        except OSError:
            continue  # ended meanwhile
    return found


def wait_for(condition, seconds: float, what: str) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, what
        time.sleep(0.02)


# --- where there is no Numba to compile with --------------------------------------------------------------------------


def fake_numba(toy: Toy, text: str) -> None:
    (toy.code / "numba.py").write_text(text)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("raise ModuleNotFoundError(\"No module named 'numba'\", name='numba')", "Numba is not installed: "),
        ("raise ImportError('Numba needs NumPy 2.3 or less')", "Numba needs NumPy 2.3 or less"),
        ("raise SystemError('initialization failed')", "initialization failed"),
        ("import a_missing_part", "a_missing_part"),
        ("import warnings; warnings.warn('old')", "old"),  # an error in these processes, as in pytest
        ("__version__ = '0.58.1'\nclass config: DISABLE_JIT = 0", "Numba 0.58.1 is older than 0.59: "),
        ("__version__ = 'unknown'\nclass config: DISABLE_JIT = 0", "Numba unknown is older than 0.59: "),
        ("", "AttributeError"),
    ],
)
def test_without_a_numba_that_works_kernels_run_interpreted(toy, text, reason):
    fake_numba(toy, text)
    line, *rest = toy.say(WHY + ADD)
    assert rest == INTERPRETED
    assert reason in line and SLOWER in line and "pip install" in line


def test_without_numba_compiling_says_so(toy):
    fake_numba(toy, "raise ModuleNotFoundError(\"No module named 'numba'\", name='numba')")
    assert "Numba is not installed" in toy.compile(code=1)
    program = "b = compiler.compile_in_background(print); print(b.running, b.wait()); b.stop()\n"
    assert toy.say(program + ADD) == ["False True", *INTERPRETED]


@needs_numba
def test_numba_disable_jit_is_obeyed(compiled_toy):
    line, *rest = compiled_toy.say(WHY + ADD, NUMBA_DISABLE_JIT="1")
    assert rest == INTERPRETED and line.startswith("NUMBA_DISABLE_JIT is set: ")
    assert compiled_toy.say(ADD, NUMBA_DISABLE_JIT="0") == COMPILED


# --- the cache --------------------------------------------------------------------------------------------------------


@needs_numba
def test_nothing_is_compiled_by_importing(toy):
    line, *rest = toy.say(WHY + ADD + "print(compiler.use_compiled(), compiler.mode())\n")
    assert rest == [*INTERPRETED, "False interpreted"]
    assert line == f"kernels are not compiled yet: {SLOWER}; python -m ctr_pvs.kernel"
    assert not toy.cache.exists()


@needs_numba
def test_compiled_once_they_are_loaded_from_then_on(toy):
    assert "compiled 2 entry points in " in toy.compile()
    (folder,) = folders(toy)
    assert stat.S_IMODE(folder.stat().st_mode) == stat.S_IMODE(folder.parent.stat().st_mode) == 0o700
    assert toy.say(ADD) == COMPILED
    assert "nothing to compile" in toy.compile()
    assert toy.compile("--where") == f"{folder}\n"
    assert toy.compile("--remove") == f"{folder}\n"
    assert not folder.exists() and toy.say(ADD) == INTERPRETED
    assert toy.compile("--where", code=1) == ""


@needs_numba
def test_an_edit_of_a_callee_is_noticed(toy):
    toy.compile()
    inner = toy.kernel / "inner.py"
    inner.write_text(inner.read_text().replace("2.0", "3.0"))  # as long as before, in another file than the entry
    assert toy.say(ADD) == ["interpreted 9.0"]
    toy.compile()
    assert toy.say(ADD) == ["compiled 9.0"]


@needs_numba
def test_settings_of_numba_have_results_of_their_own(compiled_toy):
    assert compiled_toy.say(ADD, NUMBA_BOUNDSCHECK="1") == INTERPRETED
    assert compiled_toy.say(ADD, NUMBA_CPU_NAME="generic") == INTERPRETED


@needs_numba
def test_a_copy_of_the_package_does_not_take_the_cache_of_the_first(compiled_toy, tmp_path):
    code = shutil.copytree(compiled_toy.code, tmp_path / "code")
    assert compiled_toy.say(ADD, PYTHONPATH=str(code)) == INTERPRETED


@needs_numba
def test_numbas_own_variable_names_the_place(toy, tmp_path):
    place = tmp_path / "named"
    toy.compile(NUMBA_CACHE_DIR=str(place))
    assert [path.name[:8] for path in place.iterdir() if path.is_dir()] == ["ctr_pvs-"]
    program = ADD + "import numba; print(numba.config.CACHE_DIR)\n"
    assert toy.say(program, NUMBA_CACHE_DIR=str(place)) == [*COMPILED, str(place)]
    assert toy.say(ADD) == INTERPRETED and not toy.cache.exists()


@needs_numba
@pytest.mark.parametrize("home", ["/dev/null", "/proc/nothing", ""])
def test_without_a_home_the_virtual_environment_is_the_place(toy, tmp_path, home):
    """Only looked up: compiling here would write into the environment that runs the tests."""
    program = (
        "import sys; from ctr_pvs.kernel.compiler import cache\n"
        f"sys.prefix, sys.base_prefix = {str(tmp_path / 'venv')!r}, '/usr'\n"
        "print(cache.make_place().root)\n"
    )
    assert toy.say(program, XDG_CACHE_HOME=None, HOME=home) == [str(tmp_path / "venv" / "var" / "cache" / "ctr_pvs")]


@needs_numba
@pytest.mark.parametrize("place", ["/proc/nothing", "a file"])
def test_without_a_place_kernels_run_interpreted_and_compiling_says_why(toy, place):
    (toy.folder / "a file").touch()
    named = {"NUMBA_CACHE_DIR": str(toy.folder / place)}
    assert toy.say(ADD, **named) == INTERPRETED
    out = toy.compile(code=1, **named)
    assert out.startswith("kernels could not be compiled: ") and place in out and len(out.splitlines()) == 1


@needs_numba
def test_a_folder_that_others_can_write_to_is_refused(copied_cache):
    toy, place, folder = copied_cache
    for path in (folder, folder.parent):
        path.chmod(0o777)
        line, *rest = toy.say(WHY + ADD, **place)
        assert rest == INTERPRETED and line.startswith(f"compiled kernels are refused ({path} can be written to by")
        path.chmod(0o700)
    target = folder.rename(folder.with_name("elsewhere"))
    folder.symlink_to(target)
    assert toy.say(ADD, **place) == INTERPRETED
    folder.unlink()
    target.rename(folder)
    assert toy.say(ADD, **place) == COMPILED


@needs_numba
@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder to somebody else")
def test_a_folder_of_somebody_else_is_refused(copied_cache):
    toy, place, folder = copied_cache
    os.chown(folder, 65534, 65534)
    line, *rest = toy.say(WHY + ADD, **place)
    assert rest == INTERPRETED and "belongs to another user" in line
    toy.compile(**place)  # puts one of ours in its place
    assert toy.say(ADD, **place) == COMPILED


@needs_numba
@pytest.mark.parametrize("damage", [Path.unlink, lambda path: path.write_bytes(b"no pickle")])
def test_a_damaged_cache_is_not_run_and_is_compiled_again(copied_cache, damage):
    toy, place, folder = copied_cache
    for path in folder.rglob("*.nbc"):
        damage(path)
    line, *rest = toy.say(WHY + ADD, **place)
    assert rest == INTERPRETED and line.startswith("compiled kernels cannot be loaded (")
    assert "compiled 2 entry points" in toy.compile(**place)
    assert toy.say(ADD, **place) == COMPILED


@needs_numba
def test_what_is_long_unused_or_was_left_unfinished_goes(toy):
    root = toy.cache / "ctr_pvs"
    root.mkdir(parents=True, mode=0o700)
    old = time.time() - 40 * 86400
    names = {
        "0" * 32: False, "1" * 32: True, f"{'2' * 32}.abc_12": False, "not ours": True, f"{'3' * 31}g": True,
    }  # fmt: skip
    for name in names:
        (root / name).mkdir(mode=0o700)
        (root / name / "COMPLETE").touch()
        os.utime(root / name / "COMPLETE", None if name == "1" * 32 else (old, old))
        os.utime(root / name, (old, old))
    toy.compile()
    assert {name: (root / name).exists() for name in names} == names
    assert toy.say(ADD) == COMPILED


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
