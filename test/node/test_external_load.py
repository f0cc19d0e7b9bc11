"""The newest wrench acts until the next one; what is refused or late is told, and changes nothing."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from ctr_pvs import Loads
from ctr_pvs_ros.inputs import external_load
from ctr_pvs_ros.inputs.external_load import ExternalLoad
from ctr_pvs_ros.inputs.wrenches import RejectedWrench
from ctr_pvs_ros.inputs.wrenches import TipWrench
from ctr_pvs_ros.inputs.wrenches import WrenchReason

FORCE, MOMENT = (0.1, 0.0, -0.2), (0.0, 1e-3, 0.0)
ON_BASE, ON_TIP = (TipWrench(FORCE, MOMENT, in_tip_frame) for in_tip_frame in (False, True))
QUARTER, HALF = (Rotation.from_euler("x", angle, degrees=True).as_quat() for angle in (90.0, 180.0))
OTHER_FRAME = RejectedWrench(WrenchReason.UNKNOWN_FRAME, "frame_id: expected this, got that")


@pytest.fixture
def clock(monkeypatch):
    """A steady clock [s] that the test sets."""

    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    clock = Clock()
    monkeypatch.setattr(external_load, "time", clock)
    return clock


def test_nothing_acts_before_the_first_wrench():
    load = ExternalLoad()
    assert load.loads is None and load.unanswered is None
    assert load.values()["external force [N]"] == load.values()["external moment [N m]"] == "(0, 0, 0)"


def test_a_wrench_acts_at_once_and_is_answered_by_the_next_solve():
    load = ExternalLoad()
    load.accept(ON_BASE, "stamp", None)
    assert load.loads == Loads(FORCE, MOMENT)
    assert load.unanswered == "stamp"
    load.solved(None)
    assert load.unanswered is None
    assert load.loads == Loads(FORCE, MOMENT)


def test_a_wrench_on_the_tip_is_turned_once_and_dead_from_there_on():
    load = ExternalLoad()
    load.accept(ON_TIP, "stamp", QUARTER)
    turned = load.loads
    assert turned.tip_force == pytest.approx((0.1, 0.2, 0.0), abs=1e-15)
    assert turned.tip_moment == pytest.approx((0.0, 0.0, 1e-3), abs=1e-15)
    load.solved(HALF)
    assert load.loads is turned and load.unanswered is None


def test_a_wrench_on_the_tip_waits_for_the_first_tip_and_is_still_unanswered_then():
    load = ExternalLoad()
    load.accept(ON_TIP, "stamp", None)
    assert load.loads is None and load.unanswered == "stamp"
    load.solved(None)  # no answer came of that solve
    assert load.loads is None and load.unanswered == "stamp"
    load.solved(QUARTER)
    assert load.loads.tip_force == pytest.approx((0.1, 0.2, 0.0), abs=1e-15)
    assert load.unanswered == "stamp"
    load.solved(HALF)
    assert load.unanswered is None
    assert load.loads.tip_force == pytest.approx((0.1, 0.2, 0.0), abs=1e-15)


def test_a_newer_wrench_takes_the_place_of_one_that_waits():
    load = ExternalLoad()
    load.accept(ON_TIP, "first", None)
    load.accept(ON_BASE, "second", None)
    load.solved(QUARTER)
    assert load.loads == Loads(FORCE, MOMENT) and load.unanswered is None


def test_a_refused_wrench_changes_nothing_and_is_counted_and_told_once():
    load = ExternalLoad()
    load.accept(ON_BASE, "stamp", None)
    load.solved(None)
    for _ in range(3):
        load.rejected(OTHER_FRAME)
    load.rejected(RejectedWrench(WrenchReason.NON_FINITE, "force: nan"))
    assert load.loads == Loads(FORCE, MOMENT) and load.unanswered is None
    values = load.values()
    assert values["wrenches accepted"] == "1" and values["wrenches rejected"] == "4"
    assert values["wrenches rejected by reason"] == "non_finite: 1, unknown_frame: 3"
    assert values["last wrench rejection"] == "non_finite: force: nan"
    assert "non_finite" in load.remark(0.0)
    assert load.remark(0.0) == ""


def test_a_wrench_that_stays_away_is_told_and_held(clock):
    load = ExternalLoad()
    load.accept(ON_BASE, "stamp", None)
    clock.now += 0.5
    assert load.remark(1.0) == ""
    clock.now += 0.75
    assert "1.2 s" in load.remark(1.0) and "wrench_timeout is 1 s" in load.remark(1.0)
    assert "held" in load.remark(1.0)
    assert load.values()["time without a wrench [s]"] == "1.250"
    assert load.remark(0.0) == ""  # never
    assert load.loads == Loads(FORCE, MOMENT)
    load.accept(ON_BASE, "stamp", None)
    assert load.remark(1.0) == ""


def test_refused_wrenches_keep_no_load_fresh(clock):
    load = ExternalLoad()
    clock.now += 2.0
    load.rejected(OTHER_FRAME)
    remark = load.remark(1.0)
    assert "unknown_frame" in remark and "no wrench for 2.0 s" in remark and "none has come yet" in remark


def test_the_load_that_acts_is_told():
    load = ExternalLoad()
    load.accept(TipWrench((np.pi, -1e-7, 0.0), (0.0, 0.25, 1.0), False), "stamp", None)
    assert load.values()["external force [N]"] == "(3.14159, -1e-07, 0)"
    assert load.values()["external moment [N m]"] == "(0, 0.25, 1)"
