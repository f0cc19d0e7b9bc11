"""What is computed when, and what late joiners find waiting."""

from types import SimpleNamespace

import pytest

from ctr_pvs_ros.outputs.outputs import Beacon
from ctr_pvs_ros.outputs.outputs import Output
from ctr_pvs_ros.outputs.outputs import Outputs
from ctr_pvs_ros.outputs.outputs import Picture


class Topic:
    """A publisher that remembers, and counts what is computed for it."""

    def __init__(self, subscribers=0):
        self.subscribers = subscribers
        self.messages = []
        self.encoded = 0

    def publish(self, msg):
        self.messages.append(msg)

    def get_subscription_count(self):
        return self.subscribers

    def encode(self, answer):
        self.encoded += 1
        return answer.name


def answer(name):
    return SimpleNamespace(name=name)


@pytest.fixture
def picture():
    return Topic()


def outputs_of(picture, *topics):
    status, outputs = Output(Topic(), str), [Output(topic, topic.encode) for topic in topics]
    return Outputs(outputs, status, Picture(picture, picture.encode, lambda: "blank"))


def test_a_status_goes_out_for_each_command_and_the_last_one_to_late_joiners(picture):
    topic = Topic(1)
    outputs = Outputs([], Output(topic, topic.encode), Picture(picture, picture.encode, lambda: "blank"))
    for name in "ab":
        outputs.tell(answer(name))
    assert topic.messages == ["a", "b"]
    topic.subscribers = 0
    for name in "cd":
        outputs.tell(answer(name))
    assert topic.encoded == 2
    outputs.catch_up()
    assert topic.messages == ["a", "b", "d"]


def test_a_beacon_is_lit_again_for_who_joins(picture):
    topic = Topic(1)
    beacon = Beacon(topic, topic.encode)
    outputs = Outputs([beacon], Output(Topic(), str), Picture(picture, picture.encode, lambda: "blank"))
    outputs.catch_up()
    outputs.publish(answer("a"))
    outputs.catch_up()
    assert topic.messages[-1] == "a"
    sent = len(topic.messages)
    outputs.catch_up()
    assert len(topic.messages) == sent
    topic.subscribers = 2
    outputs.catch_up()
    outputs.catch_up()
    assert topic.messages[sent:] == ["a"]
    topic.subscribers = 0
    outputs.publish(answer("b"))
    outputs.catch_up()
    assert topic.messages[-1] == "a"  # nothing is kept waiting for anybody


def test_what_nobody_listens_to_is_not_computed(picture):
    heard, unheard = Topic(1), Topic()
    outputs = outputs_of(picture, heard, unheard)
    for name in "abc":
        outputs.publish(answer(name))
        outputs.catch_up()
    assert heard.messages == ["a", "b", "c"]
    assert heard.encoded == 3
    assert unheard.encoded == picture.encoded == 0


def test_a_late_joiner_finds_the_last_answer(picture):
    topic = Topic()
    outputs = outputs_of(picture, topic)
    outputs.publish(answer("a"))
    outputs.publish(answer("b"))
    topic.subscribers = 1
    outputs.catch_up()
    outputs.catch_up()
    assert topic.messages == ["b"]


def test_no_old_answer_is_left_waiting_when_listeners_have_gone(picture):
    topic = Topic(1)
    outputs = outputs_of(picture, topic)
    outputs.publish(answer("a"))
    topic.subscribers = 0
    for name in "bcd":
        outputs.publish(answer(name))
    assert topic.messages == ["a"]
    outputs.catch_up()
    assert topic.messages == ["a", "d"]
    assert topic.encoded == 2


def test_there_is_nothing_to_catch_up_with_before_the_first_answer(picture):
    topic = Topic(1)
    outputs_of(picture, topic).catch_up()
    assert topic.messages == []


def test_nothing_goes_out_where_one_message_cannot_be_made(picture):
    class Broken(Topic):
        def encode(self, answer):
            raise ValueError("not finite")

    good, broken = Topic(1), Broken(1)
    outputs = outputs_of(picture, good, broken)
    with pytest.raises(ValueError, match="not finite"):
        outputs.publish(answer("a"))
    outputs.catch_up()
    assert good.messages == broken.messages == []


def test_a_picture_follows_between_commands_and_only_while_somebody_looks(picture):
    outputs = outputs_of(picture)
    picture.subscribers = 1
    outputs.publish(answer("a"))
    outputs.publish(answer("b"))
    assert picture.messages == []
    outputs.catch_up()
    outputs.catch_up()
    assert picture.messages == ["b"]
    picture.subscribers = 2  # and does not ask for what was there before
    outputs.catch_up()
    assert picture.messages == ["b", "b"]
    picture.subscribers = 0
    outputs.publish(answer("c"))
    outputs.catch_up()
    outputs.catch_up()
    assert picture.messages == ["b", "b", "blank"]


@pytest.mark.parametrize("shown", [True, False])
def test_a_picture_does_not_outlive_the_node(picture, shown):
    outputs = outputs_of(picture)
    picture.subscribers = int(shown)
    outputs.publish(answer("a"))
    outputs.catch_up()
    outputs.clear()
    assert picture.messages == (["a", "blank"] if shown else [])
