"""Where the answers go: one latched topic for each, computed for those who listen.

An output with subscribers goes out with every answer. One without is not computed; but a late joiner must find the
last answer, and no older one, waiting. So what has not gone out with an answer is made good a little later, between
commands: when somebody has subscribed since, and where an older answer of that output lies waiting.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING
from typing import Any
from typing import Generic
from typing import Protocol
from typing import TypeVar

from ctr_pvs import Backbone

if TYPE_CHECKING:
    from ctr_pvs import Equilibrium


Item = TypeVar("Item")


class Publisher(Protocol):
    """As much of rclpy's publisher as is needed here."""

    def publish(self, msg: Any) -> None: ...

    def get_subscription_count(self) -> int: ...


@dataclass(eq=False)
class Sent:
    """An answer on its way out.

    equilibrium; stamp: of its command, as it stands in a serialized message; poses: how many its backbone has.
    """

    equilibrium: Equilibrium
    stamp: bytes
    poses: int

    @cached_property
    def backbone(self) -> Backbone:
        """``poses`` poses from the orifice to the tip."""
        return self.equilibrium.backbone(self.poses)


class Output(Generic[Item]):
    """One topic whose messages go out with the answers, or with whatever else they are made of.

    Args:
        publisher: keeps its last message for late joiners.
        encode: the message of an answer, or its bytes.
    """

    def __init__(self, publisher: Publisher, encode: Callable[[Item], Any]) -> None:
        self.encode = encode
        self._publisher = publisher
        self._last: Item | None = None  # whose message waits for late joiners

    @property
    def wanted(self) -> bool:
        """Whether somebody listens."""
        return self._publisher.get_subscription_count() > 0

    def publish(self, answer: Item, message: Any) -> None:
        """Let the message of an answer go."""
        self._publisher.publish(message)
        self._last = answer

    def catch_up(self, answer: Item) -> None:
        """Make good what did not go out with the answer."""
        if self._last is not answer and (self._last is not None or self.wanted):
            self.publish(answer, self.encode(answer))


class Beacon(Output[Sent]):
    """A topic that keeps nothing for late joiners: its last message goes out once more when somebody has joined."""

    def __init__(self, publisher: Publisher, encode: Callable[[Sent], Any]) -> None:
        super().__init__(publisher, encode)
        self._listeners = 0

    def catch_up(self, answer: Sent) -> None:
        """As of an output; and again for whoever has joined since."""
        before, self._listeners = self._listeners, self._publisher.get_subscription_count()
        if self.wanted and (self._last is not answer or self._listeners > before):
            self.publish(answer, self.encode(answer))


class Picture:
    """One topic for the eye: it goes out between commands, only while somebody looks, and is wiped away afterwards.

    Args:
        publisher, encode: as of an `Output`.
        blank: the message that wipes away what was shown.
    """

    def __init__(self, publisher: Publisher, encode: Callable[[Sent], Any], blank: Callable[[], Any]) -> None:
        self._publisher = publisher
        self._encode = encode
        self._blank = blank
        self._last: Sent | None = None
        self._viewers = 0

    def catch_up(self, answer: Sent) -> None:
        """Show the answer to those who have not seen it; viewers need not ask for latched messages."""
        viewers, before = self._publisher.get_subscription_count(), self._viewers
        self._viewers = viewers
        if viewers == 0:
            self.clear()
        elif self._last is not answer or viewers > before:
            self._publisher.publish(self._encode(answer))
            self._last = answer

    def clear(self) -> None:
        """Wipe away what was shown."""
        if self._last is not None:
            self._publisher.publish(self._blank())
            self._last = None


class Outputs:
    """All outputs of a node: those that go out with an answer, the status of each command, and a picture."""

    def __init__(self, outputs: list[Output[Sent]], status: Output[Any], picture: Picture) -> None:
        self._outputs = outputs
        self._status = status
        self._picture = picture
        self._answer: Sent | None = None
        self._outcome: Any = None

    def publish(self, answer: Sent) -> None:
        """Send an answer to all who listen. Nothing goes out where one of its messages cannot be made."""
        ready = [(output, output.encode(answer)) for output in self._outputs if output.wanted]
        for output, message in ready:
            output.publish(answer, message)
        self._answer = answer

    def tell(self, outcome: Any) -> None:
        """Send what became of a command."""
        if self._status.wanted:
            self._status.publish(outcome, self._status.encode(outcome))
        self._outcome = outcome

    def catch_up(self) -> None:
        """To be called now and then: what did not go out with the last answer goes out where it is wanted by now."""
        if self._answer is not None:
            for output in self._outputs:
                output.catch_up(self._answer)
            self._picture.catch_up(self._answer)
        if self._outcome is not None:
            self._status.catch_up(self._outcome)

    def clear(self) -> None:
        """Wipe away what must not outlive the node."""
        self._picture.clear()
