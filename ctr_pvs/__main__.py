"""`python -m ctr_pvs` is `ctr-pvs`."""

import sys

from ctr_pvs.cli.main import main

sys.exit(main())
