"""Where things lie in the repository."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCS, CONFIG = ROOT / "docs", ROOT / "config"
SPEED, STABILITY, LOADS = DOCS / "speed_accuracy.md", DOCS / "stability.md", DOCS / "loads.md"
INVERSE = DOCS / "inverse.md"
FIGURES = DOCS / "figures"
