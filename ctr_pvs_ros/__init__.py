"""The ROS 2 node around ctr_pvs: parameters, inputs, commands, wrenches, stream, outputs, report, node; and a service.

That is the order in which a command travels. commands, wrenches, external_load, stream, outputs and turns hold the
decisions and know nothing of ROS; messages, forms and markers make what is sent; inputs and publishers are the topics,
node wires them together, executable runs it. The service has a process of its own. In front of them all is front, which
answers what needs no ROS.
"""

import os

# Before numpy is loaded: the solver's matrices are small, and threads of the linear algebra library only get in each
# other's way (a cold four-tube solve on a busy machine takes ten times as long with them).
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
