"""The service ~/solve: the node's end of it, and the process that solves."""
