"""What the node adds to a solve."""
