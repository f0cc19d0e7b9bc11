"""ctr-pvs convert: robots of other codes, and what is refused because it cannot be known."""

from __future__ import annotations

import json
import math

import pytest

from ctr_pvs import load_robot
from ctr_pvs.cli import main as cli

LISTS = {
    "OD": [1.1, 1.9], "ID": [0.7, 1.4], "E": 5.0e10, "nu": [0.3, 0.25], "length": [431, 332],
    "length_curved": [103, 113], "curvature": [21.3, 13.1], "units": ["mm", "1/m"],
}  # fmt: skip
TUBES = {
    "tube_0": {"length": 0.431, "length_curved": 0.103, "diameter_inner": 0.7e-3, "diameter_outer": 1.1e-3,
               "stiffness": 1.025e10, "torsional_stiffness": 3.99e9, "x_curvature": 21.3, "y_curvature": 5.0,
               "beta": -0.2, "theta": 90},
    "tube_1": {"length": 0.332, "length_curved": 0.113, "diameter_inner": 1.4e-3, "diameter_outer": 1.8e-3,
               "stiffness": 1.868e10, "torsional_stiffness": 6.8e9, "x_curvature": 13.1, "y_curvature": 0,
               "beta": -0.1, "theta": 0},
}  # fmt: skip


def write(tmp_path, content):
    path = tmp_path / "other.json"
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")
    return str(path)


def convert(capsys, tmp_path, content, *words):
    """The robot, and the text of its file."""
    output = tmp_path / "ours.yaml"
    assert cli.main(["convert", write(tmp_path, content), *words, "--output", str(output)]) == 0
    assert capsys.readouterr().err == ""
    return load_robot(output), output.read_text(encoding="utf-8")


def refused(capsys, tmp_path, content, *words):
    assert cli.main(["convert", write(tmp_path, content), *words]) == cli.BAD_INPUT
    captured = capsys.readouterr()
    assert captured.out == "" and len(captured.err.splitlines()) == 1
    return captured.err


def test_lists_innermost_first_in_millimetres(capsys, tmp_path):
    robot, text = convert(capsys, tmp_path, LISTS)
    outer, inner = robot.tubes
    assert (robot.name, outer.name, inner.name) == ("other", "outer", "inner")
    assert (outer.outer_diameter, outer.inner_diameter, inner.outer_diameter) == (1.9e-3, 1.4e-3, 1.1e-3)
    assert [segment.length for segment in outer.segments] == pytest.approx([0.219, 0.113])
    assert inner.segments[1].curvature == (21.3 + 0j,)
    second_moment = math.pi / 64 * (1.9e-3**4 - 1.4e-3**4)
    assert outer.segments[0].bending_stiffness == pytest.approx(5e10 * second_moment)
    assert outer.segments[0].torsional_stiffness == pytest.approx(5e10 * second_moment / 1.25)
    assert "innermost first" in text and "radius 46.948 mm" in text


def test_a_mapping_for_each_tube_with_directions_and_a_command(capsys, tmp_path):
    robot, text = convert(capsys, tmp_path, TUBES, "--units", "m", "deg")
    outer, inner = robot.tubes
    assert inner.segments[1].curvature == (21.3 + 5j,)
    assert inner.segments[0].length == pytest.approx(0.328)
    assert "--alpha 0 1.57079632679 --D 0.1 0.2" in text
    assert outer.segments[0].torsional_stiffness == pytest.approx(6.8e9 * math.pi / 32 * (1.8e-3**4 - 1.4e-3**4))


def test_the_same_robot_in_other_words_is_the_same(capsys, tmp_path):
    expected, _ = convert(capsys, tmp_path, LISTS)
    rows = [
        {"OD_mm": 1.9, "ID_mm": 1.4, "E": 50, "nu": 0.25, "Ls_mm": 219, "Lc_mm": 113, "radius_mm": 1e3 / 13.1},
        {"OD_mm": 1.1, "ID_mm": 0.7, "E": 50, "nu": 0.3, "Ls_mm": 328, "Lc_mm": 103, "radius_mm": 1e3 / 21.3},
    ]
    robot, _ = convert(capsys, tmp_path, {"tubes": rows, "robot": "other"}, "--units", "GPa")
    for tube, other in zip(robot.tubes, expected.tubes, strict=True):
        assert (tube.inner_diameter, tube.outer_diameter) == pytest.approx((other.inner_diameter, other.outer_diameter))
        for segment, same in zip(tube.segments, other.segments, strict=True):
            assert segment.bending_stiffness == pytest.approx(same.bending_stiffness)
            assert segment.pre_curvature(0.0) == pytest.approx(same.pre_curvature(0.0))


def test_without_output_the_file_goes_to_standard_output(capsys, tmp_path):
    assert cli.main(["convert", write(tmp_path, LISTS)]) == 0
    captured = capsys.readouterr()
    (tmp_path / "out.yaml").write_text(captured.out, encoding="utf-8")
    assert load_robot(tmp_path / "out.yaml") == convert(capsys, tmp_path, LISTS)[0]


def test_a_converted_robot_that_looks_wrong_is_warned_of(capsys, tmp_path):
    file = write(tmp_path, {**LISTS, "curvature": [21.3, 131]})
    assert cli.main(["convert", file]) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"ctr-pvs: warning: {file}: tube ") and "12.4 %" in line


@pytest.mark.parametrize(
    ("changes", "words", "said"),
    [
        ({"units": ["1/m"]}, [], ["length", "known unit", "--units m"]),
        ({"units": ["mm"]}, [], ["curvature", "1/m, 1/mm"]),
        ({"E": 50}, [], ["[0].E", "Pa, MPa, GPa"]),
        ({"units": ["mm", "m"]}, [], ["units", "one of each kind"]),
        ({"units": ["mm", "1/m", "furlong"]}, [], ["'furlong'"]),
        ({}, ["--units", "m"], ["units"]),
        ({"innermost_first": False}, [], ["innermost_first", "1.1 mm to 1.9 mm"]),
        ({}, ["--order", "outermost-first"], ["1.1 mm to 1.9 mm"]),
        ({"length_curved": [103]}, [], ["length_curved", "as many entries"]),
        ({"length_curved": [500, 113]}, [], ["length", "curved (0.5 m)"]),
        ({"length_curved": None}, [], ["length_curved", "a number"]),
        ({"colour": ["red", "blue"]}, [], ["colour", "one of the keys"]),
        ({"G": 2e10}, [], ["G", "one of them"]),
        ({"radius": [40, 70]}, [], ["curvature", "one of"]),
        ({"beta": [0.2, 0.1], "units": ["m", "1/m"], "length": [0.4, 0.3], "length_curved": [0.1, 0.1]}, [],
         ["beta", "D = -beta"]),
        ({"theta": [10, 20]}, [], ["theta", "rad, deg"]),
        ({"nu": [0.6, 0.3]}, [], ["poissons_ratio", "0.6"]),
        ({"ID": [0.7, 1.0]}, [], ["bore"]),
        ({"OD": ["a", "b"]}, [], ["OD", "'a'", "a number"]),
        ({}, ["--from", "tubes"], ["a mapping for each tube"]),
    ],
)  # fmt: skip
def test_what_cannot_be_known_is_refused(capsys, tmp_path, changes, words, said):
    err = refused(capsys, tmp_path, {**LISTS, **changes}, *words)
    assert not [word for word in said if word not in err], err


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("[]", "a mapping of lists"),
        ("7", "a mapping, or a list"),
        ('{"OD": 1.1}', "a mapping of lists"),
        ('{"tubes": [{"segments": []}]}', "segments"),
        ('{"tubes": [{}], "description": "x"}', "beside tubes"),
        ('{"tubes": [{"OD": 1}]}', "two of length"),
    ],
)
def test_other_shapes_are_refused(capsys, tmp_path, content, said):
    assert said in refused(capsys, tmp_path, content)


def test_a_file_that_cannot_be_written_is_named(capsys, tmp_path):
    words = ["convert", write(tmp_path, LISTS), "--output", str(tmp_path / "no" / "such.yaml")]
    assert cli.main(words) == cli.BAD_INPUT
    assert "--output: cannot write" in capsys.readouterr().err
