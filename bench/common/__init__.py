"""What all benches share: clock, tables, robots, commands, whole energies at one degree."""
