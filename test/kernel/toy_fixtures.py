"""The toy kernel in the states that tests of the compiler begin with."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from toy_kernel import ENTRIES
from toy_kernel import SLOW
from toy_kernel import Toy


@pytest.fixture
def toy(tmp_path: Path) -> Toy:
    """Nothing is compiled in it."""
    return Toy(tmp_path)


@pytest.fixture(scope="module")
def compiled_toy(tmp_path_factory: pytest.TempPathFactory) -> Toy:
    """All is compiled in it; not to be changed."""
    toy = Toy(tmp_path_factory.mktemp("compiled"))
    toy.compile()
    return toy


@pytest.fixture
def copied_cache(compiled_toy: Toy, tmp_path: Path) -> tuple[Toy, dict[str, str], Path]:
    """The toy in which all is compiled, the variable that leads it to a copy of its cache, and the folder in there."""
    cache = shutil.copytree(compiled_toy.cache, tmp_path / "cache")
    (folder,) = (path for path in (cache / "ctr_pvs").iterdir() if path.is_dir())
    return compiled_toy, {"XDG_CACHE_HOME": str(cache)}, folder


@pytest.fixture
def slow_toy(tmp_path: Path) -> Toy:
    """Compiling it takes about ten seconds."""
    return Toy(tmp_path, ENTRIES + SLOW)
