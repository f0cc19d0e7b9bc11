"""Of the live page: how soon a shape follows a slider, seen from a browser."""
