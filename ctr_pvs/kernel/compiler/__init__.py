"""How the kernels are compiled, kept, found again and switched to.

- ``registry``: the two decorators, and what they were put on.
- ``dispatchers``: what Numba makes of the registered functions, from the cache or anew.
- ``cache``: the folder that holds the outcome, and whether it can be trusted.
- ``switch``: which of the two runs in this process, and why.
- ``precompile``, ``worker``: ``python -m ctr_pvs.kernel``, which fills the cache.
- ``background``: the same beside a process that goes on interpreted meanwhile.
- ``child``: how this package starts itself in another process, and ends with the one that started it.

Importing never compiles and never fails: what is wrong with Numba or the cache is told by ``why()``.
"""

from __future__ import annotations

from ctr_pvs.kernel.compiler.background import Background
from ctr_pvs.kernel.compiler.background import compile_in_background
from ctr_pvs.kernel.compiler.registry import compiled
from ctr_pvs.kernel.compiler.registry import entry_point
from ctr_pvs.kernel.compiler.switch import mode
from ctr_pvs.kernel.compiler.switch import start
from ctr_pvs.kernel.compiler.switch import use_compiled
from ctr_pvs.kernel.compiler.switch import use_interpreted
from ctr_pvs.kernel.compiler.switch import why

__all__ = [
    "Background",
    "compile_in_background",
    "compiled",
    "entry_point",
    "mode",
    "start",
    "use_compiled",
    "use_interpreted",
    "why",
]
