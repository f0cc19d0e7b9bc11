"""Messages as the bytes that go over the wire: written once as a form, then filled in for every answer.

Python objects for sixty poses take longer to make and to serialize than the poses take to compute. A publisher also
takes the serialized message itself. Everything but the stamp and the numbers is the same in every answer, so a form is
serialized once, by the middleware, with numbers that are easy to find again; the places where they are found are
where the real ones go. Nothing is assumed of the layout but that an array of numbers lies in one piece.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.serialization import serialize_message

#: The stamp of a form: each byte of it other than those beside it.
STAMP = Time(sec=0x01020304, nanosec=0x05060708)
_STAMP = struct.Struct("=iI")
_SMALLEST = 0.5


class FormError(RuntimeError):
    """The middleware does not lay out messages in a way that can be filled in."""


def stamp_bytes(seconds: int, nanoseconds: int) -> bytes:
    """A stamp as it stands in a serialized message."""
    return _STAMP.pack(seconds, nanoseconds)


def placeholders(count: int, run: int = 0) -> list[float]:
    """Numbers for a form: no two alike in one run, no two runs alike."""
    first = _SMALLEST + 1e6 * run
    return [first + number for number in range(count)]


class Form:
    """A serialized message with gaps.

    Args:
        message: the message, with ``STAMP`` and ``placeholders`` where gaps are to be.
        gaps: in the order of the message; each is STAMP or a run of placeholders.

    Raises:
        FormError: a gap is not to be found.
    """

    def __init__(self, message: Any, gaps: Sequence[Time | Sequence[float]]) -> None:
        rest = serialize_message(message)
        # What stays and what is filled in take turns.
        self._parts: list[bytes] = []
        for gap in gaps:
            sought = stamp_bytes(gap.sec, gap.nanosec) if isinstance(gap, Time) else struct.pack(f"={len(gap)}d", *gap)
            before, found, rest = rest.partition(sought)
            if not found:
                raise FormError(f"{type(message).__name__}: this middleware's messages cannot be filled in")
            self._parts += [before, sought]
        self._parts.append(rest)

    def fill(self, *contents: bytes) -> bytes:
        """The message with ``contents`` in its gaps, each as long as what it replaces."""
        parts = self._parts
        parts[1::2] = contents
        return b"".join(parts)
