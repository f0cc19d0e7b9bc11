"""The ROS 2 node around ctr_pvs, its service, and clients.

A command comes in through inputs, where it is read and checked; stream solves for it and decides whether the answer may
go out; outputs sends that, and what became of the command. handler holds the three together. The service has a process
of its own. parameters, node, executable and front make one program of it all; client is for who talks to a node.
"""

import os

# Before numpy is loaded: the solver's matrices are small, and threads of the linear algebra library only get in each
# other's way (a cold four-tube solve on a busy machine takes ten times as long with them).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
