"""The two decorators of the kernel, and the functions they were put on, in order of definition.

A decorator returns the function itself: what is written is what runs interpreted, and what tests of one function call.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import FunctionType
from typing import Any
from typing import TypeVar

F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True)
class Entry:
    """A function that the rest of the package calls, and the Numba signatures it is compiled for."""

    name: str
    function: FunctionType
    signatures: tuple[str, ...]


# By module and name, so that a module loaded again replaces its functions instead of doubling them.
_functions: dict[str, FunctionType] = {}
_signatures: dict[str, tuple[str, ...]] = {}


def compiled(f: F) -> F:
    """Register ``f``, a function of a kernel's module, to be compiled into the entry points that call it."""
    _register(f)
    return f


def entry_point(*signatures: str) -> Callable[[F], F]:
    """Register a function that the rest of the package calls, for these types of arguments and no others.

    ``signatures`` are Numba's, such as ``"int64(float64[::1], float64[:, ::1], int64)"``."""

    def register(f: F) -> F:
        _signatures[_register(f)] = signatures
        return f

    return register


def functions() -> list[FunctionType]:
    """All registered functions, entry points among them."""
    return list(_functions.values())


def entries() -> list[Entry]:
    """The entry points."""
    return [Entry(name, _functions[name], signatures) for name, signatures in _signatures.items()]


def cost(entry: Entry) -> int:
    """Bytes of code that compiling ``entry`` goes through, all it calls included: a guess at which takes longest."""
    known = set(_functions.values())
    seen: set[FunctionType] = set()
    waiting = [entry.function]
    while waiting:
        f = waiting.pop()
        if f not in seen:
            seen.add(f)
            named = (f.__globals__.get(name) for name in f.__code__.co_names)
            waiting += [g for g in named if isinstance(g, FunctionType) and g in known]
    return sum(len(f.__code__.co_code) for f in seen)


def _register(f: Callable[..., Any]) -> str:
    if not isinstance(f, FunctionType) or f.__closure__ or "<locals>" in f.__qualname__:
        raise TypeError(f"expected a plain function of a module, got {f!r}")
    name = f"{f.__module__}.{f.__qualname__}"
    _functions[name] = f
    return name
