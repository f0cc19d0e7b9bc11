"""Shared by all tests: the seed's robot and its converged reference values."""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy is loaded: the solver's matrices are small

import json
from pathlib import Path

import pytest

from ctr_pvs import Robot
from ctr_pvs import load_robot

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def seed_robot() -> Robot:
    return load_robot(ROOT / "config" / "renda2021.yaml")


@pytest.fixture(scope="session")
def reference() -> dict:
    """Converged values of the standard model for the seed's Fig. 2 and Fig. 4; their origin is told in the file."""
    return json.loads((Path(__file__).parent / "data" / "reference_values.json").read_text())
