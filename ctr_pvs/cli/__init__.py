"""The command line: its words, and its answers as text, JSON and pictures.

May use all other rooms; none uses it."""
