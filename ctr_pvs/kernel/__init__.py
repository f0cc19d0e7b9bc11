"""The numbers: plain functions of arrays and scalars, which Numba compiles where it is there.

``entries`` and ``outputs`` hold the few functions that the rest of the package calls, always as ``entries.name(...)``,
so that each call meets what is in use at that moment.  Everything else in this room is called from there.  Rules:

- Arguments of entry points are contiguous arrays and scalars, their results scalars: no Python objects.  Inside,
  named tuples of arrays (``arrays``) are the only classes.  Callers see to the scalars: Numba takes 2.7 for an int64
  and makes 2 of it.
- Loops are written out.  No ``@``, ``dot`` or linalg (they warn, and bring threads), no ``parallel``.
- Nothing is allocated: no ``np.empty``, no ``x[:] = y``.  Workspaces come in from outside; views of them are free.
- Nothing is divided by what can be 0: interpreted that would raise or warn, compiled it gives inf.
- Every function carries ``@compiled``, an entry ``@entry_point("its Numba signature")``.  Other functions of the room
  are imported by name: Numba does not find them through their module.

``python -m ctr_pvs.kernel`` compiles all of it, once; until then, and where there is no Numba, the same functions run
interpreted, slower, with the same numbers.  ``compiler`` is the machinery of that.
"""

from __future__ import annotations

from ctr_pvs.kernel import compiler
from ctr_pvs.kernel import entries
from ctr_pvs.kernel import outputs

__all__ = ["compiler", "entries", "outputs"]

compiler.start()
