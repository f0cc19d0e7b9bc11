"""From a command to an equilibrium: relaxed start, one proven step, path, snap, all equilibria, batches."""
