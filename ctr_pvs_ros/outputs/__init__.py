"""What goes out: answers, the status of each command, diagnostics, pictures."""
