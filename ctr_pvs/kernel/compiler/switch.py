"""Which kernels run in this process, compiled or interpreted, why, and the change between them."""

from __future__ import annotations

import os
import re
import sys
import threading
from dataclasses import dataclass
from types import FunctionType
from typing import Any
from typing import Literal

from ctr_pvs.kernel.compiler import cache
from ctr_pvs.kernel.compiler import dispatchers

Mode = Literal["compiled", "interpreted"]

#: The oldest Numba that the kernels are compiled with; setup.py names the same.
MINIMUM = (0, 59)
SLOWER = "kernels run interpreted, slower, with the same numbers"


@dataclass(frozen=True)
class _State:
    mode: Mode
    why: str
    #: Interpreted for no other reason than that nothing is compiled yet.
    cold: bool = False


_lock = threading.Lock()
_state = _State("interpreted", f"the kernels are being imported: {SLOWER}")
#: The key of the sources as they were imported; None before that, and where there is no Numba.
_key: str | None = None
#: What stands in the modules under the name of an entry point while compiled kernels run.
_loaded: dict[FunctionType, Any] = {}


def mode() -> Mode:
    """What the next call of an entry point runs."""
    return _state.mode


def why() -> str:
    """Why that is so, and what to do about it: one line for people."""
    return _state.why


def cold() -> bool:
    """Whether kernels are interpreted only because nothing is compiled yet."""
    return _state.cold


def loaded_key() -> str | None:
    """The key of the sources that this process runs; None without Numba."""
    return _key


def start() -> None:
    """Run compiled kernels if they lie in the cache, else interpreted ones.  Never compiles, never fails."""
    global _key, _state
    obstacle = _obstacle()
    if obstacle is not None:
        _state = _State("interpreted", obstacle)
        return
    try:
        _key = cache.key()
    except Exception as error:
        _state = _State("interpreted", f"no folder of compiled kernels can be named ({_brief(error)}): {SLOWER}")
        return
    use_compiled()


def use_compiled() -> bool:
    """Load the compiled kernels from the cache and run them from the next call on; False if they are not there.

    Everything is loaded before anything is changed, so that threads that run meanwhile meet the one or the other.
    Compiles nothing, raises nothing; done already, it does nothing."""
    global _state
    with _lock:
        if _state.mode == "interpreted" and _key is not None:
            try:
                _state = _load(_key)
            except Exception as error:  # Numba's, of any kind
                reason = f"compiled kernels cannot be loaded ({_brief(error)})"
                _state = _State("interpreted", f"{reason}: {SLOWER}; {command()}", cold=True)
        return _state.mode == "compiled"


def use_interpreted() -> None:
    """Run the functions as they are written from the next call on."""
    global _state
    with _lock:
        if _state.mode == "compiled":
            _put({dispatcher: f for f, dispatcher in _loaded.items()})
            _loaded.clear()
            _state = _State("interpreted", f"asked for: {SLOWER}")


def command() -> str:
    """What compiles the kernels."""
    return f"python -m {cache.PACKAGE}"


def _load(key: str) -> _State:
    folder, refused = cache.find(key)
    if folder is None:
        reason = f"compiled kernels are refused ({'; '.join(refused)})" if refused else "kernels are not compiled yet"
        return _State("interpreted", f"{reason}: {SLOWER}; {command()}", cold=True)
    _loaded.update(dispatchers.load(folder))
    _put(_loaded)
    cache.used(folder)
    return _State("compiled", f"kernels were loaded from {folder}")


def _put(instead: dict[Any, Any]) -> None:
    """Replace each key of ``instead`` by its value wherever a module of the kernel holds it, under any name."""
    by_id = {id(old): new for old, new in instead.items()}
    for name, module in list(sys.modules.items()):
        if name == cache.PACKAGE or name.startswith(f"{cache.PACKAGE}."):
            for held, value in list(vars(module).items()):
                if id(value) in by_id:
                    setattr(module, held, by_id[id(value)])


def _obstacle() -> str | None:
    """Why kernels cannot be compiled in this environment; None if they can."""
    if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
        return f"NUMBA_DISABLE_JIT is set: {SLOWER}"
    try:
        import numba

        version = numba.__version__
        disabled = bool(numba.config.DISABLE_JIT)
    except ModuleNotFoundError as error:
        if error.name == "numba":
            return f"Numba is not installed: {SLOWER}; pip install numba"
        return f"Numba cannot be imported ({_brief(error)}): {SLOWER}; pip install --upgrade numba"
    except Exception as error:  # Numba refuses versions of numpy that it does not know, among others
        return f"Numba cannot be imported ({_brief(error)}): {SLOWER}; pip install --upgrade numba"
    if disabled:
        return f"Numba's settings disable it: {SLOWER}"
    digits = re.match(r"(\d+)\.(\d+)", version)
    if digits is None or (int(digits[1]), int(digits[2])) < MINIMUM:
        oldest = ".".join(map(str, MINIMUM))
        return f"Numba {version} is older than {oldest}: {SLOWER}; pip install --upgrade numba"
    return None


def _brief(error: Exception) -> str:
    """``error`` in a line: its kind and the first line of what it says."""
    text = " ".join(str(error).split())
    return f"{type(error).__name__}: {text[:200]}" if text else type(error).__name__
