"""A response that the middleware drops is sent again."""

import warnings

import pytest

from ctr_pvs_ros.responses import TRIES
from ctr_pvs_ros.responses import send_patiently

WARNING = "failed to send response (timeout): client will not receive response"


class Service:
    """Sends as rclpy's does: the first responses are dropped with a warning."""

    def __init__(self, dropped):
        self.dropped = dropped
        self.tries = []

    def send_response(self, response, header):
        self.tries.append((response, header))
        if len(self.tries) <= self.dropped:
            warnings.warn(WARNING, RuntimeWarning, stacklevel=1)


@pytest.mark.parametrize(("dropped", "tries"), [(0, 1), (3, 4), (1000, TRIES)])
def test_it_is_sent_until_it_has_gone_out(dropped, tries):
    service = Service(dropped)
    with warnings.catch_warnings():
        send_patiently(service)
        service.send_response("response", "header")
    assert service.tries == [("response", "header")] * tries


def test_other_warnings_are_shown():
    with warnings.catch_warnings(), pytest.warns(UserWarning, match="something else"):
        service = Service(0)
        send_patiently(service)
        warnings.warn("something else", UserWarning, stacklevel=1)
