"""Commands and wrenches as they come in: read, checked, and refused with a reason."""
