"""A page that is read with a keyboard: its blocks, run in their order as a reader would.

`python` blocks share one namespace, as in one session, unless they begin with the name of a file to save them as;
`bash` blocks are typed into a shell each. A block without a language is what the block before it prints: words to the
letter, numbers with a point to two units of their last place, `...` standing for any number. `sh` blocks install
something, and are not run.
"""

from __future__ import annotations

import contextlib
import io
import re
import subprocess
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from checkout import ROOT

PAGES = ROOT / "docs"
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"# (\w+\.py)\n")
NUMBER = re.compile(r"\.\.\.|[-+]?\d+(?:(\.\d*)?(?:e([-+]?\d+))?)?")
PLACES = 2.5  # units of the last one; half of one for rounding
LANGUAGES = {"python", "bash", "sh"}
TIMEOUT = 600.0  # s, of a block in a shell: a fit takes minutes where the kernels are interpreted


@dataclass(frozen=True)
class Block:
    """code : as it stands on the page; prints : what it should print, None where the page does not say."""

    language: str
    code: str
    prints: str | None
    place: str


def blocks(page: str) -> list[Block]:
    """Those of docs/`page`, in their order."""
    text = (PAGES / page).read_text(encoding="utf-8")
    found: list[Block] = []
    for fence in FENCE.finditer(text):
        place = f"docs/{page}:{1 + text.count(chr(10), 0, fence.start())}"
        if fence[1]:
            assert fence[1] in LANGUAGES, f"{place}: what is {fence[1]}?"
            found.append(Block(fence[1], fence[2], None, place))
        else:
            assert found and found[-1].prints is None, f"{place}: printed by nothing"
            found[-1] = Block(found[-1].language, found[-1].code, fence[2], found[-1].place)
    return found


def run_python(block: Block, session: dict[str, object]) -> str:
    """What the block prints in a session."""
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(block.code, block.place, "exec"), session)
    return printed.getvalue()


def run_shell(block: Block, folder: Path) -> str:
    """What the block prints in a shell, each of whose commands must succeed."""
    command = ["bash", "-euo", "pipefail", "-c", block.code]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert run.returncode == 0, f"{block.place}: {run.stdout}{run.stderr}"
    return run.stdout


def same(told: str, printed: str) -> bool:
    """Whether a page tells what is printed; whatever space there is."""
    if "".join(NUMBER.sub("#", told).split()) != "".join(NUMBER.sub("#", printed).split()):
        return False
    return all(map(_near, NUMBER.finditer(told), NUMBER.finditer(printed)))


def _near(told: re.Match[str], printed: re.Match[str]) -> bool:
    if told[0] == "...":
        return True
    if told[1] is None:
        return told[0] == printed[0]
    unit = 10.0 ** (int(told[2] or 0) + 1 - len(told[1]))
    return abs(float(told[0]) - float(printed[0])) <= PLACES * unit


def check(block: Block, printed: str) -> None:
    """Whether the page says rightly what its block prints."""
    if block.prints is not None:
        assert same(block.prints, printed), f"{block.place} prints\n{printed}and not\n{block.prints}"


def follow(page: str, folder: Path, shell: Callable[[Block, Path], str] = run_shell) -> None:
    """Everything on a page, in a folder; Python runs in this process, which must stand there."""
    session: dict[str, object] = {"__name__": "__main__"}
    for block in blocks(page):
        if file := FILE.match(block.code):
            (folder / file[1]).write_text(block.code, encoding="utf-8")
        elif block.language == "python":
            check(block, run_python(block, session))
        elif block.language == "bash":
            check(block, shell(block, folder))
