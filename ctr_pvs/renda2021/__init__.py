"""The robots, numbers, tables and figures of the paper, computed again.

May use all rooms but ``cli``."""
