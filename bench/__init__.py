"""Measurements and charts; run a script from the root of the repository as a module:

    scripts/in_env.sh python3 -m bench.speed.speed_accuracy

Scripts that have a part in ``make bench``, or in a document that says so:

- ``speed``: speed against accuracy beside other methods (``speed_accuracy``).
- ``serving``: what it costs to serve a robot (``serving_cost``), and robots and batches of any size (``hard_cases``).
- ``growth``: what more tubes, sections, poses and commands cost (``cost_growth``).
- ``accuracy``: whether error estimates are true (``effectivity``), how the `full` level converges
  (``full_convergence``).
- ``stability``: ``where_methods_fail``, ``random_sweeps``, ``stability_numbers``, ``stability_cost``.
- ``pvs``: insertion forces, by eq. (41) and by virtual work (``insertion_forces``).
- ``node``: what the node adds to a solve (``node_latency``).

``common`` is what they share.  Modules that draw import those that measure, never the other way.
"""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: all matrices are small
