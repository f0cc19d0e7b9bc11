"""Parameters of which only some are tried in a short run of the tests."""

from __future__ import annotations

from collections.abc import Collection
from collections.abc import Sequence
from typing import Any

import pytest


def some(values: Sequence[Any], keep: Collection[int]) -> list[Any]:
    """``values`` as parameters: now those whose places are in ``keep``, the others in the long run (``make soak``)."""
    return [v if i in keep else pytest.param(v, marks=pytest.mark.soak) for i, v in enumerate(values)]
