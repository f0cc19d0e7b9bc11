"""Responses that also reach clients who have only just found the service.

A client's request can arrive before the way back to it has been discovered. The middleware then waits for 0.1 s, drops
the response, and rclpy tells of it by nothing but a warning; the client would wait for ever.
"""

from __future__ import annotations

import threading
import warnings
from typing import Any

from rclpy.service import Service

TRIES = 20  # 0.1 s each

DROPPED = "failed to send response"  # how the warning begins

_last = threading.local()
_show = warnings.showwarning


def send_patiently(service: Service) -> None:
    """Make a service send each response again until it has gone out. Takes hold of the process's warnings."""
    send = service.send_response

    def send_again(response: Any, header: Any) -> None:
        for _ in range(TRIES):
            _last.dropped = False
            send(response, header)
            if not _last.dropped:
                return

    service.send_response = send_again  # type: ignore[method-assign]
    warnings.filterwarnings("always", message=DROPPED, category=RuntimeWarning)
    warnings.showwarning = _notice


def _notice(message: Warning | str, *details: Any, **more: Any) -> None:
    """What warnings come to. It is called in the thread that sends."""
    if str(message).startswith(DROPPED):
        _last.dropped = True
    else:
        _show(message, *details, **more)
