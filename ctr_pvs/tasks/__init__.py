"""What people do with a robot model as a whole: fit it to measurements, find commands for poses."""
