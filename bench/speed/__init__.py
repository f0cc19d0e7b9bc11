"""Speed against accuracy, beside other ways to the same tip."""
