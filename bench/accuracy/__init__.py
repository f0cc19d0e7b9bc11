"""Whether answers are as near as they say."""
