"""Robot files: what is read from them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from robot_texts import GOOD
from robot_texts import load_text
from robot_texts import one_tube

from ctr_pvs.robot.file import load_robot
from ctr_pvs.robot.robot import Limits

CONFIG = Path(__file__).parents[2] / "config"


def test_renda2021_is_table_1_and_figure_3():
    robot = load_robot(CONFIG / "renda2021.yaml")
    assert [tube.name for tube in robot.tubes] == ["outer", "inner"]
    outer, inner = robot.tubes
    assert [segment.length for segment in outer.segments] == [93.5e-3, 92.3e-3]
    assert [segment.length for segment in inner.segments] == [218.5e-3, 85.0e-3]
    assert [segment.curvature for segment in outer.segments] == [(), (9.9 + 0j,)]
    assert [segment.curvature for segment in inner.segments] == [(), (13.8 + 0j,)]
    assert (outer.inner_diameter, outer.outer_diameter) == (2.01e-3, 2.39e-3)
    assert (inner.inner_diameter, inner.outer_diameter) == (0.0, 1.6e-3)
    quarter = np.pi / 64  # I = pi/64 (d_o^4 - d_i^4)
    for tube in robot.tubes:
        second_moment = quarter * (tube.outer_diameter**4 - tube.inner_diameter**4)
        for segment in tube.segments:
            assert segment.bending_stiffness == pytest.approx(58e9 * second_moment, rel=1e-14)
            assert segment.torsional_stiffness == pytest.approx(21.5e9 * 2 * second_moment, rel=1e-14)
    assert robot.limits == Limits((None, None), (None, None))


def test_renda2021_fig2_has_the_same_tubes_wholly_curved():
    robot = load_robot(CONFIG / "renda2021_fig2.yaml")
    reference = load_robot(CONFIG / "renda2021.yaml")
    for tube, other, length, curvature in zip(robot.tubes, reference.tubes, (0.14, 0.2), (9.9, 13.8), strict=True):
        (segment,) = tube.segments
        assert (segment.length, segment.curvature) == (length, (curvature + 0j,))
        assert segment.bending_stiffness == other.segments[0].bending_stiffness
        assert segment.torsional_stiffness == other.segments[0].torsional_stiffness


def test_three_tubes_uses_what_a_robot_file_offers():
    robot = load_robot(CONFIG / "three_tubes.yaml")
    outer, middle, inner = robot.tubes
    assert outer.segments[1].bending_stiffness == pytest.approx(2 * 1.3 / 2 * outer.segments[1].torsional_stiffness)
    plain, patterned, bent = middle.segments
    assert patterned.bending_stiffness == pytest.approx(0.5 * plain.bending_stiffness, rel=2e-3)
    assert patterned.torsional_stiffness == pytest.approx(0.7 * plain.torsional_stiffness, rel=2e-3)
    assert bent.curvature == (6j, 80 + 0j)
    assert inner.segments[1].turn == 20.0
    assert robot.limits.D[1] == (0.01, 0.21)


def test_limits_go_to_the_tubes_they_name(tmp_path):
    assert load_text(tmp_path, GOOD).limits == Limits((None, (-3.0, 3.0)), ((0.0, 0.1), None))


@pytest.mark.parametrize(
    ("material", "segment", "expected"),
    [
        ("{bending_stiffness: 2, torsional_stiffness: 1}", "length: 0.1", (2.0, 1.0)),
        ("{bending_stiffness: 2, torsional_stiffness: 1}", "length: 0.1, bending_stiffness: 3", (3.0, 1.0)),
        ("{}", "length: 0.1, bending_stiffness: 3, torsional_stiffness: 4", (3.0, 4.0)),
        ("{bending_stiffness: 2}", "length: 0.1, torsional_stiffness: 4", (2.0, 4.0)),
        ("{bending_stiffness: 2, poissons_ratio: 0.25}", "length: 0.1", (2.0, 1.6)),
        ("{bending_stiffness: 2, poissons_ratio: 0.25}", "length: 0.1, bending_stiffness: 5", (5.0, 4.0)),
        ("{bending_stiffness: 2, poissons_ratio: 0.25}", "length: 0.1, torsional_stiffness: 4", (2.0, 4.0)),
        ("{bending_stiffness: 2, torsional_stiffness: 1}", "length: 0.1, poissons_ratio: 0", (2.0, 2.0)),
        # E I = 1 N m^2 with I = pi/64 d^4, d = 0.02 m, so that G J = 2 G / E
        ("{youngs_modulus: &E 1.2732395447351628e8, shear_modulus: *E, inner_diameter: 0, outer_diameter: 0.02}",
         "length: 0.1", (1.0, 2.0)),
        ("{youngs_modulus: 1.2732395447351628e8, poissons_ratio: 0.25, inner_diameter: 0, outer_diameter: 0.02}",
         "length: 0.1", (1.0, 0.8)),
        ("{youngs_modulus: 1.2732395447351628e8, poissons_ratio: 0.25, inner_diameter: 0, outer_diameter: 0.02}",
         "length: 0.1, youngs_modulus: 2.5464790894703255e8", (2.0, 1.6)),
        ("{youngs_modulus: 1.2732395447351628e8, poissons_ratio: 0.25, inner_diameter: 0, outer_diameter: 0.02}",
         "length: 0.1, shear_modulus: 1.2732395447351628e8", (1.0, 2.0)),
        ("{youngs_modulus: 1.2732395447351628e8, poissons_ratio: 0.25, inner_diameter: 0, outer_diameter: 0.02}",
         "length: 0.1, outer_diameter: 0.04", (16.0, 12.8)),
        ("{youngs_modulus: 1.2732395447351628e8, poissons_ratio: 0.25, inner_diameter: 0, outer_diameter: 0.02}",
         "length: 0.1, bending_stiffness: 3, torsional_stiffness: 4", (3.0, 4.0)),
        ("{bending_stiffness: 2, torsional_stiffness: 1, inner_diameter: 0, outer_diameter: 0.02}",
         "length: 0.1, youngs_modulus: 1.2732395447351628e8, poissons_ratio: 0.25", (1.0, 0.8)),
    ],
)  # fmt: skip
def test_stiffness_is_given_either_way_and_overridden_by_segments(tmp_path, material, segment, expected):
    text = f"name: r\ntubes: [{{name: t, {material[1:-1]}{', ' * (material != '{}')}segments: [{{{segment}}}]}}]\n"
    (only,) = load_text(tmp_path, text).tubes[0].segments
    assert (only.bending_stiffness, only.torsional_stiffness) == pytest.approx(expected, rel=1e-14)


def test_diameters_that_vary_count_with_the_narrowest_bore_and_the_widest_outside(tmp_path):
    text = one_tube("inner_diameter: 1e-3\n    outer_diameter: 2e-3", "length: 0.1, inner_diameter: 0.5e-3").replace(
        "    segments:\n", "    youngs_modulus: 6e10\n    poissons_ratio: 0.3\n    segments:\n      - {length: 0.1}\n"
    )
    text += "      - {length: 0.1, outer_diameter: 3e-3}\n"
    tube = load_text(tmp_path, text).tubes[0]
    assert (tube.inner_diameter, tube.outer_diameter) == (0.5e-3, 3e-3)
    assert len({segment.bending_stiffness for segment in tube.segments}) == 3


@pytest.mark.parametrize(
    ("segment", "curvature", "turn"),
    [
        ("length: 0.1", (), 0.0),
        ("length: 0.1, curvature_y: []", (), 0.0),
        ("length: 0.1, curvature_y: [9.9]", (9.9 + 0j,), 0.0),
        ("length: 0.1, curvature_z: [-3]", (-3j,), 0.0),
        ("length: 0.1, curvature_y: [1, 2, 3], curvature_z: [4, 0]", (1 + 4j, 2 + 0j, 3 + 0j), 0.0),
        ("length: 0.1, curvature: 8, turn: -20", (8 + 0j,), -20.0),
        ("length: 0.1, curvature: [8], turn: -20", (8 + 0j,), -20.0),
        ("length: 0.03, curvature: [16.7, -550.0], turn: 60", (16.7 + 0j, -550.0 + 0j), 60.0),
    ],
)
def test_pre_curvature(tmp_path, segment, curvature, turn):
    (only,) = (
        load_text(tmp_path, one_tube("bending_stiffness: 1\n    torsional_stiffness: 1", segment)).tubes[0].segments
    )
    assert (only.curvature, only.turn) == (curvature, turn)


@pytest.mark.parametrize(
    ("written", "value"),
    [
        ("58.0e9", 58e9),
        ("1e5", 1e5),
        ("1E+5", 1e5),
        ("+5e4", 5e4),
        ("60000", 6e4),
        ("050000", 5e4),
        ("0x10000", 65536.0),
        ("70000.", 7e4),
        (".5e6", 5e5),
    ],
)
def test_numbers_are_those_of_yaml_1_2(tmp_path, written, value):
    text = one_tube(
        f"youngs_modulus: {written}\n    poissons_ratio: 0.5\n    inner_diameter: 0\n    outer_diameter: 0.1"
    )
    (segment,) = load_text(tmp_path, text).tubes[0].segments
    assert segment.bending_stiffness == pytest.approx(value * np.pi / 64 * 1e-4, rel=1e-14)


def test_words_that_yaml_1_1_took_for_booleans_are_names(tmp_path):
    robot = load_text(tmp_path, GOOD.replace("name: outer", "name: on").replace("{outer:", "{on:"))
    assert robot.tubes[0].name == "on"


def test_anchors_and_a_byte_order_mark_are_read(tmp_path):
    text = one_tube("bending_stiffness: 1\n    torsional_stiffness: 1").replace("- {length", "- &s {length")
    text += "      - *s\n"
    robot = load_text(tmp_path, b"\xef\xbb\xbf" + text.encode())
    assert robot.tubes[0].length == 0.2


def test_the_path_may_be_text_or_a_path():
    assert load_robot(str(CONFIG / "renda2021.yaml")) == load_robot(CONFIG / "renda2021.yaml")
