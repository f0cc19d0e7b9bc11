"""Colours and signs of the outcomes in all failure charts."""

from __future__ import annotations

from bench.stability.judges import Outcome

#: Good to bad; told apart by lightness too, and by a sign in each cell.  After Okabe and Ito.
COLOURS = {
    Outcome.RIGHT: "#e6eef5",
    Outcome.SNAP: "#9ccbea",
    Outcome.FAILURE: "#f7e08a",
    Outcome.RESUMED: "#e8a82e",
    Outcome.FALSE_ALARM: "#8fbf9f",
    Outcome.WRONG: "#d55e00",
    Outcome.UNSTABLE: "#8e2f74",
    Outcome.NOTHING: "#1a1a1a",
}
SIGNS = {
    Outcome.RIGHT: "",
    Outcome.SNAP: "S",
    Outcome.FAILURE: "F",
    Outcome.RESUMED: "R",
    Outcome.FALSE_ALARM: "A",
    Outcome.WRONG: "W",
    Outcome.UNSTABLE: "U",
    Outcome.NOTHING: "N",
}
PALE = (Outcome.WRONG, Outcome.UNSTABLE, Outcome.NOTHING)
