"""What may vary, and the room that limits leave: everything in it keeps them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import yaml
from design_scenes import KNOWN

from ctr_pvs import load_robot
from ctr_pvs.errors import FieldError
from ctr_pvs.robot.dimensions import clearance
from ctr_pvs.robot.dimensions import largest_strain
from ctr_pvs.tasks.bounds import Bounds
from ctr_pvs.tasks.design.parameters import chosen
from ctr_pvs.tasks.design.parameters import robot_with
from ctr_pvs.tasks.design.parameters import stiffening
from ctr_pvs.tasks.design.room import DesignLimits
from ctr_pvs.tasks.design.room import Room
from ctr_pvs.tasks.design.travel import Travel

EVERYTHING = ("curvature=0.5x,3x", "length", "inner_diameter=0.5x,2x", "outer_diameter=0.5x,2x")


def room_of(robot, strain=0.012, **more):
    return Room(robot, chosen(robot, EVERYTHING), DesignLimits(strain, clearance=1e-4, wall=8e-5, **more))


@pytest.mark.parametrize("robot", [KNOWN, load_robot("three_tubes")], ids=["two", "three"])
def test_every_design_of_the_room_keeps_the_limits(robot):
    room, rng = room_of(robot), np.random.default_rng(0)
    corners = rng.integers(0, 2, (20, len(room.parameters)))
    for shares in (*rng.random((40, len(room.parameters))), *corners.astype(float)):
        made = room.robot_at(shares)
        assert max(map(largest_strain, made.tubes)) <= 0.012 * (1.0 + 1e-9)
        for outer, inner in itertools.pairwise(made.tubes):
            assert clearance(outer, inner) >= 1e-4 - 1e-12
        assert all(tube.outer_diameter - tube.inner_diameter >= 1.6e-4 - 1e-12 for tube in made.tubes)
        values = room.values(shares)
        assert all(p.low - 1e-12 <= v <= p.high + 1e-12 for p, v in zip(room.parameters, values, strict=True))


def test_shares_and_values_are_one_another_s_inverse():
    room, rng = room_of(load_robot("three_tubes")), np.random.default_rng(1)
    for shares in rng.random((10, len(room.parameters))):
        assert room.shares(room.values(shares)) == pytest.approx(shares, abs=1e-9)


def test_a_robot_beyond_the_limit_begins_at_it():
    room = Room(KNOWN, chosen(KNOWN, ["curvature:inner"]), DesignLimits(0.008))
    assert room.values(room.shares(np.array([14.0]))) == pytest.approx([0.008 / 0.75e-3])


def test_rates_of_values_are_those_of_differences():
    room, rng, h = room_of(KNOWN), np.random.default_rng(2), 1e-5
    for shares in rng.uniform(0.05, 0.95, (5, len(room.parameters))):
        steps = h * np.eye(len(shares))
        told = np.column_stack([(room.values(shares + s) - room.values(shares - s)) / (2 * h) for s in steps])
        scale = np.array([p.start for p in room.parameters])[:, None]
        assert room.rates(shares) / scale == pytest.approx(told / scale, abs=1e-5)


def test_stiffness_goes_with_diameters_as_that_of_the_material(tmp_path):
    """The same as a robot file with moduli says of the other diameters."""

    def robot(inner, outer):
        tube = {"name": "one", "youngs_modulus": 6e10, "poissons_ratio": 0.3, "inner_diameter": inner,
                "outer_diameter": outer, "segments": [{"length": 0.1, "curvature_y": [5.0]}]}  # fmt: skip
        file = tmp_path / "robot.yaml"
        file.write_text(yaml.safe_dump({"name": "r", "tubes": [tube]}))
        return load_robot(file)

    begin = robot(1e-3, 1.5e-3)
    parameters = chosen(begin, ["inner_diameter", "outer_diameter"])
    (made,) = robot_with(begin, parameters, np.array([1.1e-3, 1.9e-3])).tubes
    (there,) = robot(1.1e-3, 1.9e-3).tubes
    for key in ("bending_stiffness", "torsional_stiffness"):
        assert getattr(made.segments[0], key) == pytest.approx(getattr(there.segments[0], key), rel=1e-12)
    h, told = 1e-9, stiffening(1e-3, 1.5e-3)
    for number, kind in enumerate(("inner_diameter", "outer_diameter")):
        step = np.array([1e-3, 1.5e-3]) + h * np.eye(2)[number]
        stiffer = robot_with(begin, parameters, step).tubes[0].segments[0].bending_stiffness
        assert told[kind] == pytest.approx(np.log(stiffer / begin.tubes[0].segments[0].bending_stiffness) / h, rel=1e-4)


@pytest.mark.parametrize(
    ("vary", "part"),
    [
        (["stiffness"], "vary: expected one of"),
        (["curvature:middle"], "vary: expected one of"),
        (["length:inner:3"], "vary: expected one of"),
        ([], "nothing to design"),
        (["curvature:inner=20,5"], "a lower and a higher bound"),
        (["curvature:inner=5"], "a lower and a higher bound"),
        (["curvature:inner=a,b"], "a lower and a higher bound"),
        (["curvature:inner=nan,5"], "a lower and a higher bound"),
        (["length:inner=1x,1x"], "a lower and a higher bound"),
    ],
)
def test_words_that_cannot_be_meant(vary, part):
    with pytest.raises(FieldError, match=part):
        chosen(KNOWN, vary)


def test_a_later_word_holds():
    parameters = chosen(KNOWN, ["length=0.9x,1.1x", "length:inner:2=0.02,0.05"])
    assert [(p.low, p.high) for p in parameters[:3]] == [
        (pytest.approx(0.9 * p.start), pytest.approx(1.1 * p.start)) for p in parameters[:3]
    ]
    assert (parameters[3].low, parameters[3].high) == (0.02, 0.05)


def test_limits_that_leave_nothing():
    curved = chosen(KNOWN, ["curvature:outer"])
    with pytest.raises(FieldError, match=r"strain: expected at least 0\.0105, the least strain of tube 'inner'"):
        Room(KNOWN, curved, DesignLimits(0.01))
    with pytest.raises(FieldError, match="_diameter:"):
        Room(KNOWN, curved, DesignLimits(clearance=1e-3))
    with pytest.raises(FieldError, match="_diameter:"):
        Room(KNOWN, chosen(KNOWN, ["outer_diameter"]), DesignLimits(wall=1e-3))
    for wrong in ({"strain": 0.0}, {"margin": 1.0}, {"wall": float("nan")}, {"clearance": -1.0}):
        with pytest.raises(FieldError):
            DesignLimits(**wrong)


def test_every_share_of_the_travel_is_a_command():
    robot, rng = load_robot("three_tubes"), np.random.default_rng(3)
    travel, bounds = Travel(robot), Bounds(robot, None)
    shares = np.concatenate([rng.random((50, 3)), rng.integers(0, 2, (10, 3)).astype(float)])
    D = travel.D(shares)
    assert all(bounds.contains(np.zeros(3), row) for row in D)
    assert travel.D(travel.shares(D)) == pytest.approx(D, abs=1e-15)


def test_travel_goes_with_lengths_as_differences_tell():
    robot, rng, h = KNOWN, np.random.default_rng(4), 1e-7
    shares, parameters = rng.random((20, 2)), chosen(robot, ["length"])
    start = np.array([p.start for p in parameters])
    told = Travel(robot).rates(shares)
    for k in range(4):
        longer = Travel(robot_with(robot, parameters, start + h * np.eye(4)[k]))
        assert told[:, :, k] == pytest.approx((longer.D(shares) - Travel(robot).D(shares)) / h, abs=1e-6)
