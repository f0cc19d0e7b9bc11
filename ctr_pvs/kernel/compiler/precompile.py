"""``python -m ctr_pvs.kernel``: compile all entry points into the cache, in two processes.

They compile into a private folder, which takes its final name when all is done and has been loaded once: whoever looks
meanwhile finds all or nothing.  A lock keeps two runs from doing the same work; it ends with the process that holds it.
"""

from __future__ import annotations

import argparse
import fcntl
import json
import os
import selectors
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import NoReturn

from ctr_pvs.kernel.compiler import cache
from ctr_pvs.kernel.compiler import dispatchers
from ctr_pvs.kernel.compiler import switch
from ctr_pvs.kernel.compiler.child import end_with_parent
from ctr_pvs.kernel.compiler.child import spawn
from ctr_pvs.kernel.compiler.registry import cost
from ctr_pvs.kernel.compiler.registry import entries
from ctr_pvs.kernel.compiler.worker import work

PROCESSES = 2
NICE = 10
#: How often a run looks whether another one has finished [s].
LOOK = 0.2


class CompilingError(Exception):
    """The kernels could not be compiled."""


class Stopped(BaseException):
    """A signal asks this process to end."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def main(words: list[str] | None = None) -> int:
    """Compile the kernels, unless it is done; 0 if they can be loaded afterwards, else 1.  A signal ends it."""
    parser = argparse.ArgumentParser(prog=switch.command(), description="Compile the kernels, once for these sources.")
    parser.add_argument("--where", action="store_true", help="only print the folder they lie in; code 1 without one")
    parser.add_argument("--remove", action="store_true", help="only remove that folder, and print which it was")
    # Between processes of this package:
    parser.add_argument("--worker", type=Path, metavar="FOLDER", help=argparse.SUPPRESS)
    parser.add_argument("--beside", type=int, metavar="PROCESS", help=argparse.SUPPRESS)
    asked = parser.parse_args(words)
    if asked.worker is not None:
        work(asked.worker)
    if asked.where or asked.remove:
        return _found(remove=asked.remove)
    try:
        with _stopped_by_signals():
            if asked.beside is not None:
                end_with_parent(asked.beside)
                os.nice(NICE)
            print(_compile())
            return 0
    except (CompilingError, OSError) as error:
        print(f"kernels could not be compiled: {error}")
        return 1
    except Stopped as stop:
        print("compiling the kernels was stopped", flush=True)
        signal.signal(stop.number, signal.SIG_DFL)  # a shell script that called this stops with it
        signal.raise_signal(stop.number)
        return 1


def _found(remove: bool) -> int:
    """Print the folder of what is compiled, if it is, and remove it if asked to; the exit code."""
    key = switch.loaded_key()
    folder = None if key is None else cache.find(key)[0]
    if folder is None:
        return 0 if remove else 1
    if remove:
        shutil.rmtree(folder)
    print(folder)
    return 0


def _compile() -> str:
    """Compile what is missing; returns what was done, in a line."""
    began = time.perf_counter()
    if switch.mode() == "compiled":
        return f"nothing to compile: {switch.why()}"
    key = switch.loaded_key()
    if key is None:
        raise CompilingError(switch.why())
    place = cache.make_place()
    with _only_one(place):
        if switch.use_compiled():
            return f"another process has compiled meanwhile: {switch.why()}"
        cache.prune(place, key)
        private = cache.private_folder(place, key)
        try:
            _fill(private)
            dispatchers.load(private)
            if cache.key() != key:
                raise CompilingError("sources were changed meanwhile; call it again")
            cache.publish(private, place.folder(key))
        except dispatchers.NotInCacheError as error:
            raise CompilingError(f"Numba keeps no result ({error})") from error
        finally:
            shutil.rmtree(private, ignore_errors=True)
    return f"compiled {len(entries())} entry points in {time.perf_counter() - began:.1f} s into {place.folder(key)}"


def _fill(folder: Path) -> None:
    """Compile all entry points into ``folder``: the costliest first, each by the process that is free first."""
    waiting = sorted(entries(), key=cost, reverse=True)
    total, done = len(waiting), 0
    print(f"compiling {total} entry points of the kernels", file=sys.stderr, flush=True)
    pipe = subprocess.PIPE
    count = min(PROCESSES, total, os.cpu_count() or 1)
    workers: list[subprocess.Popen[str]] = []
    try:
        with selectors.DefaultSelector() as selector:
            for _ in range(count):
                workers.append(worker := spawn("--worker", str(folder), stdin=pipe, stdout=pipe))
                selector.register(worker.stdout, selectors.EVENT_READ, worker)  # type: ignore[arg-type]
                _feed(worker, waiting.pop(0).name)
            while done < total:
                for ready, _ in selector.select():
                    told = _answer(ready.data)
                    done += 1
                    print(f"  {done} of {total}: {told}", file=sys.stderr, flush=True)
                    if waiting:
                        _feed(ready.data, waiting.pop(0).name)
                    else:
                        selector.unregister(ready.fileobj)
    finally:
        for worker in workers:
            worker.kill()
        for worker in workers:
            worker.wait()


def _feed(worker: subprocess.Popen[str], name: str) -> None:
    assert worker.stdin is not None
    worker.stdin.write(f"{name}\n")


def _answer(worker: subprocess.Popen[str]) -> str:
    """The entry point that ``worker`` has compiled, and how long that took."""
    assert worker.stdout is not None
    line = worker.stdout.readline()
    if not line:
        raise CompilingError(f"a process that compiled ended with code {worker.wait()}")
    answer = json.loads(line)
    name, error = answer["name"].rpartition(".")[2], answer["error"]
    if error is not None:
        print(error, file=sys.stderr, flush=True)  # all of it: Numba points at the line of source
        raise CompilingError(f"{name}: {' '.join(error.split())[:300]}")
    return f"{name}, {answer['seconds']:.1f} s"


@contextmanager
def _only_one(place: cache.Place) -> Iterator[None]:
    """Wait until no other process compiles in ``place``, and keep others waiting meanwhile."""
    told = False
    with open(place.root / f"{place.prefix}lock", "ab") as lock:
        while True:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                break
            except BlockingIOError:
                if not told:
                    print("another process is compiling the kernels: waiting for it", file=sys.stderr, flush=True)
                told = True
                time.sleep(LOOK)
            except OSError:
                break  # a file system without locks: both do the work, in folders of their own
        yield


@contextmanager
def _stopped_by_signals() -> Iterator[None]:
    """Signals that end a process raise Stopped, so that what is being done is cleaned up; the second one is ignored."""
    numbers = [
        number
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        if number == signal.SIGTERM or signal.getsignal(number) != signal.SIG_IGN  # nohup asks to ignore one
    ]

    def stop(number: int, frame: FrameType | None) -> NoReturn:
        for each in numbers:
            signal.signal(each, signal.SIG_IGN)
        raise Stopped(number)

    before = {number: signal.signal(number, stop) for number in numbers}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
