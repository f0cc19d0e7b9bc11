"""The numbers: plain functions of arrays and scalars, which Numba compiles where it is there.

``entries`` holds the few functions that the rest of the package calls, always as ``entries.name(...)``, so that each
call meets what is in use at that moment.  Everything else in this room is called from there.  Rules of the room:

- Arguments and results are contiguous float64 or int64 arrays and scalars: no classes of ours, no Python objects.
- Loops are written out.  No ``@``, ``dot`` or linalg (they warn, and bring threads), no ``parallel``.
- Nothing is allocated inside a loop: workspaces come in from outside.
- Nothing is divided by what can be 0: interpreted that would raise or warn, compiled it gives inf.
- Every function carries ``@compiled``, an entry ``@entry_point("its Numba signature")``.  Other functions of the room
  are imported by name: Numba does not find them through their module.

``python -m ctr_pvs.kernel`` compiles all of it, once; until then, and where there is no Numba, the same functions run
interpreted, slower, with the same numbers.  ``compiler`` is the machinery of that.
"""

from __future__ import annotations

from ctr_pvs.kernel import compiler
from ctr_pvs.kernel import entries

__all__ = ["compiler", "entries"]

compiler.start()
