"""Real nodes in real processes, talked to over DDS. Without ROS 2 these tests are skipped, and say so."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

START_TIMEOUT = 20.0  # s


def _installed(package: str) -> bool:
    """Whether it can be imported; a mere folder of that name, such as the one at the root, does not count."""
    spec = find_spec(package)
    return spec is not None and spec.origin is not None


HAVE_ROS = _installed("rclpy") and _installed("ctr_pvs_interfaces")

if HAVE_ROS:
    import rclpy
    from diagnostic_msgs.msg import DiagnosticArray
    from diagnostic_msgs.msg import DiagnosticStatus
    from rcl_interfaces.msg import ParameterDescriptor
    from rcl_interfaces.msg import SetParametersResult
    from rclpy.parameter import Parameter
    from rclpy.parameter import parameter_value_to_python
    from rclpy.parameter_client import AsyncParameterClient
    from sensor_msgs.msg import JointState

    from ctr_pvs_ros.client.client import LATCHED
    from ctr_pvs_ros.client.client import LockStepClient
    from ctr_pvs_ros.process import NodeProcess
    from ctr_pvs_ros.process import isolate
    from ctr_pvs_ros.process import share_file


class SkippedModule(pytest.Module):
    """A test module that is not even imported."""

    def collect(self) -> list[pytest.Item]:
        pytest.skip("ROS 2 with ctr_pvs_interfaces is not sourced: no node tests")


def pytest_pycollect_makemodule(module_path: Path, parent: pytest.Collector) -> pytest.Module | None:
    """Keep modules that import rclpy from being imported where there is none."""
    return None if HAVE_ROS else SkippedModule.from_parent(parent, path=module_path)


class Peer:
    """The other end of a running node's topics, services and parameters.

    Attributes:
        client: commands in lock step.
        ros: the node that this end consists of.
    """

    def __init__(self, namespace: str) -> None:
        self.namespace = namespace
        self.ros = rclpy.create_node("peer", namespace=namespace)
        self.client = LockStepClient(self.ros)
        self._status: DiagnosticStatus | None = None
        self.ros.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, 10)
        self._publisher = self.ros.create_publisher(JointState, "servo_jp", 1)
        self._parameters = AsyncParameterClient(self.ros, "ctr_equilibrium")
        self.client.spin_until(lambda: self._publisher.get_subscription_count() > 0, START_TIMEOUT, "node")
        self.client.wait_for_node(START_TIMEOUT)

    def _on_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name == f"{self.namespace}/ctr_equilibrium: equilibrium".lstrip("/"):
                self._status = status

    def subscribe(self, kind: type, topic: str) -> list[Any]:
        """A list that fills with the messages of an output; its last one comes at once."""
        messages: list[Any] = []
        self.ros.create_subscription(kind, topic, messages.append, LATCHED)
        return messages

    def set_parameter(self, name: str, value: Any) -> SetParametersResult:
        """Set a parameter of the node; what it says to that."""
        future = self._parameters.set_parameters([Parameter(name, value=value)])
        self.wait(future.done, "parameter service")
        return future.result().results[0]

    def get_parameter(self, name: str) -> Any:
        """A parameter's value."""
        future = self._parameters.get_parameters([name])
        self.wait(future.done, "parameter service")
        return parameter_value_to_python(future.result().values[0])

    def describe_parameters(self, names: list[str]) -> list[ParameterDescriptor]:
        """What the node says of its parameters."""
        future = self._parameters.describe_parameters(names)
        self.wait(future.done, "parameter service")
        return future.result().descriptors

    def send(self, message: JointState) -> None:
        """Publish a command as it is."""
        self._publisher.publish(message)

    def wait(self, done: Callable[[], bool], what: str, timeout: float = 5.0) -> None:
        """Handle messages until `done`."""
        self.client.spin_until(done, timeout, what)

    def diagnostics(self, done: Callable[[dict[str, str]], bool] = lambda values: True) -> tuple[Any, dict[str, str]]:
        """The next status whose values are `done`, and the values by key."""
        self._status = None
        self.wait(lambda: self._status is not None and done(self._values()), "diagnostics")
        return self._status, self._values()

    def _values(self) -> dict[str, str]:
        assert self._status is not None
        return {value.key: value.value for value in self._status.values}


class StartedPeer(Peer):
    """A peer of a node that was started for it.

    Attributes:
        process: the node.
        log: path of what the node wrote.
    """

    def __init__(self, namespace: str, parameters: dict[str, str], log: Path) -> None:
        self.log = log
        with log.open("wb") as output:
            self.process = NodeProcess(share_file("config", "renda2021.yaml"), parameters, namespace, output)
        try:
            super().__init__(namespace)
        except Exception:
            self.process.stop()
            raise


@pytest.fixture(scope="session")
def graph() -> Iterator[None]:
    """A ROS graph apart from all others."""
    isolate()
    rclpy.init(args=[])
    yield
    rclpy.try_shutdown()


@pytest.fixture(scope="module")
def start_node(graph: None, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., StartedPeer]]:
    """Start a node with parameters in a namespace; it is stopped at the end of the module."""
    peers: list[StartedPeer] = []

    def start(namespace: str, **parameters: str) -> StartedPeer:
        peers.append(StartedPeer(namespace, parameters, tmp_path_factory.mktemp("node") / "log.txt"))
        return peers[-1]

    yield start
    for peer in peers:
        peer.process.stop()
        peer.ros.destroy_node()


@pytest.fixture
def find_node(graph: None) -> Callable[[str], Peer]:
    """Find a node that something else has started in a namespace."""
    return Peer
