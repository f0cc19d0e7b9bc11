"""The ROS 2 node around ctr_pvs: parameters, commands, stream, messages, report, service, node.

That is the order in which a command travels. commands, stream and report hold the decisions and know nothing of a ROS
graph; node wires them to topics.
"""

import os

# Before numpy is loaded: the solver's matrices are small, and threads of the linear algebra library only get in each
# other's way (a cold four-tube solve on a busy machine takes ten times as long with them).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
