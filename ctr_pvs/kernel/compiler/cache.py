"""The folder of compiled kernels: its name, its place, whether it can be trusted, and when it may go.

Numba looks at the file of the entry point alone and would serve a stale result after an edit of a callee.  So the
folder is named by everything that the result depends on.  What lies in it is unpickled and run: only a folder that is
ours, and that nobody else can write to, is read.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import stat
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

#: The package whose sources count (``ctr_pvs.kernel``), and its folder.
PACKAGE = (__package__ or "").rpartition(".")[0]
SOURCES = Path(__file__).absolute().parents[1]
#: Written last: what carries it is complete.  Its time tells when the folder was last used.
MARKER = "COMPLETE"
DAY = 86400.0  # s
#: Complete folders go after this long without use, unfinished ones (of a process that was killed) after this.
UNUSED, UNFINISHED = 30 * DAY, 1 * DAY
#: Settings of Numba that change what it makes of the same source.
SETTINGS = (
    "BOUNDSCHECK", "CPU_FEATURES", "CPU_NAME", "DEBUGINFO_DEFAULT",
    "ENABLE_AVX", "LOOP_VECTORIZE", "OPT", "SLP_VECTORIZE",
)  # fmt: skip


@dataclass(frozen=True)
class Place:
    """A folder in which compiled kernels may lie, as ``root/prefix<key>``.

    ``shared``: the user named it, for others' caches too; else it is made by us and has to be ours alone."""

    root: Path
    prefix: str
    shared: bool

    def folder(self, key: str) -> Path:
        return self.root / f"{self.prefix}{key}"


def key() -> str:
    """What a result depends on, as 32 hexadecimal digits: sources and where they lie, versions, processor, settings."""
    import llvmlite
    import llvmlite.binding as llvm
    import numba
    import numpy

    told = [
        str(SOURCES),  # Numba's own index goes by the path of a source, links in it not followed
        sys.version,
        sys.implementation.cache_tag,
        platform.machine(),
        numba.__version__,
        llvmlite.__version__,
        numpy.__version__,
        llvm.get_host_cpu_name(),
        llvm.get_host_cpu_features().flatten(),
        *(f"{name}={getattr(numba.config, name, None)}" for name in SETTINGS),
    ]
    digest = hashlib.sha256(repr(told).encode())
    for path in sorted(SOURCES.rglob("*.py")):
        text = path.read_bytes()
        digest.update(f"{path.relative_to(SOURCES)} {len(text)}\n".encode())
        digest.update(text)
    return digest.hexdigest()[:32]


def places() -> Iterator[Place]:
    """Where compiled kernels may lie, first choice first.  Never a temporary folder."""
    name = PACKAGE.partition(".")[0]
    if named := os.environ.get("NUMBA_CACHE_DIR"):
        yield Place(Path(named).absolute(), f"{name}-", True)
        return
    base, home = Path(os.environ.get("XDG_CACHE_HOME") or ""), Path(os.path.expanduser("~"))
    if not base.is_absolute() and home.is_absolute() and home != Path("/"):  # else the user has no home
        base = home / ".cache"
    if base.is_absolute():
        yield Place(base / name, "", False)
    if sys.prefix != sys.base_prefix:
        yield Place(Path(sys.prefix) / "var" / "cache" / name, "", False)


def find(key: str) -> tuple[Path | None, list[str]]:
    """The complete folder of ``key`` or None; and why folders that are there were refused, a line each."""
    refused: list[str] = []
    for place in places():
        folder = place.folder(key)
        try:
            if not (folder / MARKER).is_file():
                continue
            reason = _distrust(folder) or (None if place.shared else _distrust(place.root))
        except OSError as error:
            reason = f"{folder}: {error.strerror}"
        if reason is None:
            return folder, refused
        refused.append(reason)
    return None, refused


def make_place() -> Place:
    """The first place in which a folder can be made, made if need be; OSError, all reasons in it, if there is none."""
    reasons = []
    for place in places():
        try:
            place.root.mkdir(mode=0o777 if place.shared else 0o700, parents=True, exist_ok=True)
            reason = None if place.shared else _distrust(place.root)
            if reason is None:
                os.rmdir(private_folder(place, "0" * 32))
                return place
            reasons.append(reason)
        except OSError as error:
            reasons.append(f"{place.root}: {error.strerror or error}")
    raise OSError("; ".join(reasons) or "there is no home folder to put compiled kernels in")


def private_folder(place: Place, key: str) -> Path:
    """A new folder beside the one of ``key``, for one process to fill, 0700."""
    return Path(tempfile.mkdtemp(prefix=f"{place.prefix}{key}.", dir=place.root))


def publish(private: Path, folder: Path) -> None:
    """Mark ``private`` complete and give it its final name, in the place of whatever bears it."""
    (private / MARKER).touch()
    if os.path.lexists(folder):  # damaged, else nothing would have been compiled
        aside = Path(tempfile.mkdtemp(prefix=f"{folder.name}.", dir=folder.parent))
        os.rename(folder, aside / folder.name)
        os.rename(private, folder)
        shutil.rmtree(aside, ignore_errors=True)
    else:
        os.rename(private, folder)


def used(folder: Path) -> None:
    """Note that ``folder`` was used, at most once a day."""
    marker = folder / MARKER
    try:
        if marker.stat().st_mtime < time.time() - DAY:
            os.utime(marker)
    except OSError:
        pass  # it will be pruned earlier than it could be, and compiled again


def prune(place: Place, key: str) -> None:
    """Remove what earlier sources and versions left, and what killed processes left; never the folder of ``key``."""
    ours = re.compile(re.escape(place.prefix) + r"([0-9a-f]{32})(\.\w+)?")
    for path in place.root.iterdir():
        match = ours.fullmatch(path.name)
        if match is None or path.name == place.folder(key).name:
            continue
        try:
            marker = path / MARKER
            complete = match[2] is None and marker.is_file()
            age = time.time() - (marker if complete else path).stat().st_mtime
            if age > (UNUSED if complete else UNFINISHED) and _distrust(path) is None:
                shutil.rmtree(path, ignore_errors=True)
        except OSError:
            continue  # another process was quicker


def _distrust(path: Path) -> str | None:
    """Why the folder ``path`` must not be read from, in a line; None if all is well."""
    status = path.lstat()
    if not stat.S_ISDIR(status.st_mode):
        return f"{path} is not a folder"
    if status.st_uid != os.geteuid():
        return f"{path} belongs to another user"
    if status.st_mode & (stat.S_IWGRP | stat.S_IWOTH):
        return f"{path} can be written to by others"
    return None
