"""``python -m ctr_pvs.kernel`` compiles the kernels."""

import sys

from ctr_pvs.kernel.compiler.precompile import main

sys.exit(main())
