"""Where methods fail under external loads, sweeps, and an independent tracker that judges them."""
