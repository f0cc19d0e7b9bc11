"""ctr-pvs design: robots for targets."""
