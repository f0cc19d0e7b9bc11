"""From state to command: one proven step, the path of many, and cold starts."""
