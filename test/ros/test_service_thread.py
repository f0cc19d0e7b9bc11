"""A response that the middleware drops is sent again."""

import warnings

import pytest

from ctr_pvs_ros.service import service_thread
from ctr_pvs_ros.service.service_thread import TRIES
from ctr_pvs_ros.service.service_thread import send_patiently

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


@pytest.fixture(autouse=True)
def hold_of_warnings():
    """As a service takes hold of them."""
    with warnings.catch_warnings():
        warnings.filterwarnings("always", message=service_thread.DROPPED, category=RuntimeWarning)
        warnings.showwarning = service_thread._notice
        yield


@pytest.mark.parametrize(("dropped", "tries"), [(0, 1), (3, 4), (1000, TRIES)])
def test_it_is_sent_until_it_has_gone_out(dropped, tries):
    service = Service(dropped)
    send_patiently(service.send_response, "response", "header", lambda: False)
    assert service.tries == [("response", "header")] * tries


def test_it_is_not_sent_again_by_a_node_that_ends():
    service = Service(1000)
    send_patiently(service.send_response, "response", "header", lambda: len(service.tries) == 2)
    assert len(service.tries) == 2


def test_other_warnings_are_shown():
    with pytest.warns(UserWarning, match="something else"):
        send_patiently(Service(0).send_response, "response", "header", lambda: False)
        warnings.warn("something else", UserWarning, stacklevel=1)
