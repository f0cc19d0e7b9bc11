"""A service of a node that is served beside the node's executor.

An executor takes no request while a command of the stream is being solved for; here requests are taken in a thread of
their own, and answered when the answer is there, from other threads.

A client's request can arrive before the way back to it has been discovered. The middleware then waits for 0.1 s, drops
the response, and rclpy tells of it by nothing but a warning; the client would wait for ever. So a dropped response is
sent again.
"""

from __future__ import annotations

import threading
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.node import Node

TRIES = 20  # 0.1 s each
SENDERS = 4  # so that a client who cannot be reached yet holds up no other

DROPPED = "failed to send response"  # how the warning begins

_last = threading.local()
_show = warnings.showwarning

MakeResponse = Callable[[], Any]
Respond = Callable[[MakeResponse], None]


class ServiceThread:
    """Takes hold of the process's warnings.

    Args:
        node: whose service it is.
        service_type, name: of the service.
        on_request: called with each request and with what takes the response to it, or rather what makes that; from a
            thread of its own, one request after the other.
        on_fault: told what went wrong in all that.
    """

    def __init__(
        self,
        node: Node,
        service_type: Any,
        name: str,
        on_request: Callable[[Any, Respond], None],
        on_fault: Callable[[Exception], None],
    ) -> None:
        self._on_request, self._on_fault = on_request, on_fault
        self._service = node.create_service(service_type, name, _never_called)
        node._services.remove(self._service)  # executors look there for what they serve
        self._request_type = service_type.Request
        context = node.context.handle
        assert context is not None, "a node lives in an initialized context"
        with context:
            self._stop_sign = _rclpy.GuardCondition(context)
        self._context = context
        self._stopped = threading.Event()
        self._senders = ThreadPoolExecutor(SENDERS, thread_name_prefix="responses")
        warnings.filterwarnings("always", message=DROPPED, category=RuntimeWarning)
        warnings.showwarning = _notice
        self._thread = threading.Thread(target=self._take_requests, name="requests", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Take and answer no more."""
        self._stopped.set()
        with self._stop_sign:
            self._stop_sign.trigger_guard_condition()
        self._thread.join()
        self._senders.shutdown(wait=True, cancel_futures=True)
        self._service.handle.destroy_when_not_in_use()
        self._stop_sign.destroy_when_not_in_use()

    def _take_requests(self) -> None:
        with self._service.handle, self._stop_sign, self._context:
            wait_set = _rclpy.WaitSet(0, 1, 0, 0, 1, 0, self._context)
            while not self._stopped.is_set():
                wait_set.clear_entities()
                wait_set.add_service(self._service.handle)
                wait_set.add_guard_condition(self._stop_sign)
                wait_set.wait(-1)
                while not self._stopped.is_set() and self._take_one():
                    pass

    def _take_one(self) -> bool:
        """Whether there was a request."""
        try:
            request, header = self._service.handle.service_take_request(self._request_type)
            if request is None:
                return False
            self._on_request(request, lambda make: self._respond(make, header))
        except Exception as error:
            self._on_fault(error)
        return True

    def _respond(self, make: MakeResponse, header: Any) -> None:
        with suppress(RuntimeError):  # stopped: nobody is told any more
            self._senders.submit(self._deliver, make, header)

    def _deliver(self, make: MakeResponse, header: Any) -> None:
        try:
            send_patiently(self._service.send_response, make(), header, self._stopped.is_set)
        except Exception as error:
            self._on_fault(error)


def send_patiently(send: Callable[[Any, Any], None], response: Any, header: Any, stopped: Callable[[], bool]) -> None:
    """Send a response until it has gone out."""
    for _ in range(TRIES):
        _last.dropped = False
        send(response, header)
        if not _last.dropped or stopped():
            return


def _never_called(request: Any, response: Any) -> Any:
    raise AssertionError("an executor serves what is not its own")


def _notice(message: Warning | str, *details: Any, **more: Any) -> None:
    """What warnings come to. It is called in the thread that sends."""
    if str(message).startswith(DROPPED):
        _last.dropped = True
    else:
        _show(message, *details, **more)
