"""For who talks to a node: commands in lock step, and the executable ctr_client."""
