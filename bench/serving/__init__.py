"""What serving a robot costs."""
