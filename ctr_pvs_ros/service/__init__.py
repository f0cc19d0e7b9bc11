"""The services ~/solve and ~/inverse: the node's end of them, and the process that solves."""
