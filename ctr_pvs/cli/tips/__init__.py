"""ctr-pvs reach and follow: commands for tips."""
