"""What Numba makes of the registered functions: its dispatchers.

Each is made of a *copy* of its function, whose globals hold dispatchers where the module's hold functions.  So callees
are compiled into the entry points while the modules stay as they are written: the interpreted functions stay whole,
down to the last callee, and a test that calls one of them never waits for a compiler.

This module is the only one that calls Numba, apart from the questions whether it is there and which one.
"""

from __future__ import annotations

from pathlib import Path
from types import FunctionType
from typing import Any

from ctr_pvs.kernel.compiler.registry import Entry
from ctr_pvs.kernel.compiler.registry import entries
from ctr_pvs.kernel.compiler.registry import functions

#: A Numba dispatcher; Numba has no types to name it by.
Dispatcher = Any
#: All threads may run kernels at once; 0/0 gives nan instead of raising, as in numpy; nothing calls kernels through C.
#: And no counting of references to arrays: with it, a tuple of thirty arrays handed to a function costs more than most
#: functions do, and LLVM can hardly inline.  Whatever would allocate then is an error of compiling.
OPTIONS = {"nogil": True, "error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": False}


class NotInCacheError(Exception):
    """An entry point would have had to be compiled where only loading is allowed."""


def make(folder: Path) -> dict[FunctionType, Dispatcher]:
    """A dispatcher of every registered function; nothing is compiled yet.  Entry points will be kept in ``folder``."""
    import numba

    signed = {entry.function for entry in entries()}
    copies = _copies()
    kept = numba.config.CACHE_DIR
    try:
        # Read when a dispatcher with a cache is made, and only then; other users of Numba keep their own folder.
        numba.config.CACHE_DIR = str(folder)
        # Python calls entry points only; what takes arguments from it is half of the compiling.
        made = {
            f: numba.njit(cache=f in signed, no_cpython_wrapper=f not in signed, **OPTIONS)(copy)
            for f, copy in copies.items()
        }
    finally:
        numba.config.CACHE_DIR = kept
    for namespace in {id(copy.__globals__): copy.__globals__ for copy in copies.values()}.values():
        for name, value in namespace.items():
            if isinstance(value, FunctionType) and value in made:
                namespace[name] = made[value]
    return made


def prepare(entry: Entry, dispatcher: Dispatcher) -> None:
    """Load ``entry`` from the cache, else compile it; afterwards other types of arguments raise TypeError at once."""
    for signature in entry.signatures:
        dispatcher.compile(signature)
    # Otherwise an array that came in read-only or strided would compile for seconds in mid-stream.
    dispatcher.disable_compile()
    dispatcher.py_func = entry.function  # the interpreted one, not the copy that calls dispatchers


def load(folder: Path) -> dict[FunctionType, Dispatcher]:
    """Dispatchers of the entry points, ready to run, all from the cache in ``folder``; else NotInCacheError."""
    from numba.core import event

    made = make(folder)
    ours = list(made.values())

    class Refusal(event.Listener):
        """Numba tells that it starts to compile; raising here stops it."""

        def on_start(self, event: Any) -> None:
            if any(event.data["dispatcher"] is dispatcher for dispatcher in ours):
                raise NotInCacheError(f"{folder} does not hold {event.data['dispatcher'].__name__}")

        def on_end(self, event: Any) -> None:
            pass

    with event.install_listener("numba:compile", Refusal()):
        for entry in entries():
            prepare(entry, made[entry.function])
    return {entry.function: made[entry.function] for entry in entries()}


def _copies() -> dict[FunctionType, FunctionType]:
    """A copy of every registered function; those of one module share a copy of its globals."""
    namespaces: dict[int, dict[str, Any]] = {}
    copies = {}
    for f in functions():
        namespace = namespaces.setdefault(id(f.__globals__), dict(f.__globals__))
        copy = FunctionType(f.__code__, namespace, f.__name__, f.__defaults__)
        copy.__module__, copy.__qualname__, copy.__doc__ = f.__module__, f.__qualname__, f.__doc__
        copy.__kwdefaults__, copy.__annotations__ = f.__kwdefaults__, f.__annotations__
        copies[f] = copy
    return copies
