"""Who answers what a sub-command hands out: threads of this process, or the workers of a Dask cluster.

Both are a ``concurrent.futures.Executor``, which is all that the tasks know of.  What a worker computes depends on its
versions, and on whether its kernels are compiled: a cluster's workers compare theirs with those of this process before
each task, so that a table has the bits that it would have here.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import pickle
import re
import sys
import threading
import time
from collections.abc import Callable
from collections.abc import Iterator
from concurrent.futures import CancelledError
from concurrent.futures import Executor
from concurrent.futures import Future
from concurrent.futures import InvalidStateError
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING
from typing import Any

from ctr_pvs.cli.version import version
from ctr_pvs.cli.words import UsageError

if TYPE_CHECKING:
    from distributed import Client

#: Seconds for a scheduler to answer; for a first worker to come; without any worker, before what is under way fails;
#: between two looks at whether there is one.
CONNECT, FIRST_WORKER, NO_WORKER, LOOK = 10.0, 30.0, 60.0, 2.0


def declare_scheduler(parser: argparse.ArgumentParser) -> None:
    """Adds the option."""
    parser.add_argument(
        "--scheduler",
        type=_address,
        metavar="ADDRESS",
        help="let the workers of this Dask scheduler do it, such as tcp://host:8786, in place of threads of this "
        "process (needs dask: pip install 'ctr_pvs[cluster]')",
    )


def _address(text: str) -> str:
    """For argparse.  Dask would find out late, and leave something behind that ends badly."""
    if not re.fullmatch(r"(tcp://|tls://)?[^\s/]+:\d+", text):
        raise argparse.ArgumentTypeError(f"expected an address such as tcp://host:8786, got {text!r}")
    return text


@contextmanager
def executor(scheduler: str | None) -> Iterator[Executor]:
    """A thread per processor, or the workers of the Dask scheduler at this address: for functions of this package whose
    arguments and results pickle.

    Raises ``UsageError`` for a scheduler that cannot be reached or has no workers for some while.  So do futures later,
    where no worker is left, or one is not like this process.
    """
    if scheduler is None:
        with ThreadPoolExecutor(os.cpu_count()) as threads:
            yield threads
        return
    client = _client(scheduler)
    try:
        with _Cluster(client, scheduler) as cluster:
            yield cluster
    finally:
        client.close(timeout=LOOK)


def _client(address: str) -> Client:
    """Of a scheduler that has workers."""
    try:
        from distributed import Client
    except ImportError:
        raise UsageError("--scheduler needs Dask (pip install 'ctr_pvs[cluster]')") from None
    try:
        client = Client(address, timeout=CONNECT, set_as_default=False)
    except (OSError, ValueError) as error:
        why = " ".join(str(error).split())
        raise UsageError(
            f"--scheduler: no Dask scheduler answers at {address} ({why}); start one with: dask scheduler"
        ) from None
    try:
        if not client.nthreads():
            told = f"the scheduler at {address} has no workers: waiting {FIRST_WORKER:.0f} s for the first"
            print("ctr-pvs:", told, file=sys.stderr, flush=True)
            client.wait_for_workers(1, timeout=FIRST_WORKER)
    except (OSError, TimeoutError):
        client.close(timeout=LOOK)
        raise UsageError(f"--scheduler: {_no_workers(address, FIRST_WORKER)}") from None
    return client


def _no_workers(address: str, seconds: float) -> str:
    return f"the scheduler at {address} had no workers for {seconds:.0f} s; start some with: dask worker {address}"


class _Cluster(Executor):
    """The workers of a Dask scheduler."""

    def __init__(self, client: Client, address: str) -> None:
        self._client, self._address = client, address
        # Every task is to be done, not looked up among those that look alike.
        self._tasks = client.get_executor(pure=False)
        self._expected = identity()
        self._under_way: set[Future[Any]] = set()
        self._ended = threading.Event()
        threading.Thread(target=self._watch, name="watch for workers", daemon=True).start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        outside: Future[Any] = Future()
        # By a function of the standard library: the scheduler looks into what it passes on, and need not have ctr_pvs;
        # a worker that lacks it can say so, where it would end of a task that it cannot read.
        call = pickle.dumps(_Call(self._expected, fn, args, kwargs))
        inside: Future[Any] = self._tasks.submit(pickle.loads, call)
        self._under_way.add(outside)

        def pass_on(_: Future[Any]) -> None:
            self._under_way.discard(outside)
            with suppress(InvalidStateError):  # given up meanwhile
                try:
                    outside.set_result(inside.result())
                except Exception as error:
                    outside.set_exception(self._explained(error))

        inside.add_done_callback(pass_on)
        return outside

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """Whatever is under way is given up."""
        self._ended.set()
        for future in list(self._under_way):
            future.cancel()

    def _explained(self, error: Exception) -> Exception:
        """What to do about an error that is not the task's own."""
        from distributed import KilledWorker

        if isinstance(error, CancelledError):
            return UsageError(f"the scheduler at {self._address} has ended, or cannot be reached any more")
        if isinstance(error, KilledWorker):
            return UsageError(f"one worker after the other ended at the same task; see what they logged ({error})")
        if isinstance(error, ImportError | AttributeError) and "ctr_pvs" in str(error):
            return UsageError(f"a worker has no ctr_pvs like this one ({error}): install {identity()['ctr_pvs']} there")
        return error

    def _watch(self) -> None:
        """Lets everything under way fail once there have been no workers for a while."""
        seen = time.monotonic()
        while not self._ended.wait(LOOK):
            with suppress(Exception):  # no answer: that of workers, if any are left, will come or not
                if self._client.nthreads():
                    seen = time.monotonic()
            if not self._under_way:
                seen = time.monotonic()
            elif time.monotonic() - seen > NO_WORKER:
                for future in list(self._under_way):
                    with suppress(InvalidStateError):
                        future.set_exception(UsageError(_no_workers(self._address, NO_WORKER)))


class _Call:
    """A call that is made where it is unpickled, which gives its result."""

    def __init__(self, *call: Any) -> None:
        self._call = call

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return _made, self._call


def _made(expected: dict[str, str], fn: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Any:
    """The result of a call, on a worker whose answers have the bits of those of the process that asks."""
    here = identity()
    wrong = [f"{name} {here[name]} in place of {wanted}" for name, wanted in expected.items() if here[name] != wanted]
    if wrong:
        raise UsageError(
            f"the worker on {os.uname().nodename} has {', '.join(wrong)}, so its answers might differ: install "
            "the same versions, and compile the kernels on all machines (python -m ctr_pvs.kernel)"
        )
    return fn(*args, **kwargs)


@cache
def identity() -> dict[str, str]:
    """What the bits of an answer depend on in this process, beside the kind of processor."""
    from ctr_pvs.kernel import compiler

    found = {"ctr_pvs": f"{version()}, sources {_sources()}"}
    for name in ("numpy", "scipy", "numba"):
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "none"
    return {**found, "kernels": compiler.mode()}


def _sources() -> str:
    """Told apart by a few digits: between two releases many have one version."""
    digest = hashlib.sha256()
    folder = Path(__file__).parents[1]
    for path in sorted(folder.rglob("*.py")):
        digest.update(f"{path.relative_to(folder)}\n".encode() + path.read_bytes())
    return digest.hexdigest()[:8]
