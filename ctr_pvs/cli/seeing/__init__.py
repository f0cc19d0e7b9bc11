"""Sub-commands that show: one shape as a picture, many commands as a table, the reach of a robot, a live page."""
