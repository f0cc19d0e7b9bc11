"""What is compiled is kept, found again and switched to, or not: one rule a test, on a toy, in other processes."""

from __future__ import annotations

import os
import shutil
import stat
import time
from pathlib import Path

import pytest
from toy_fixtures import compiled_toy
from toy_fixtures import copied_cache
from toy_fixtures import toy
from toy_kernel import ADD
from toy_kernel import COMPILED
from toy_kernel import INTERPRETED
from toy_kernel import SLOWER
from toy_kernel import WHY
from toy_kernel import Toy
from toy_kernel import folders
from toy_kernel import needs_numba
from toy_kernel import processes

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
