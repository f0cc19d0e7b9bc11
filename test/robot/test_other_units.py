"""Units and words of others: taken where a key says so, and else refused with the conversion."""

from __future__ import annotations

import math

import pytest
from robot_texts import load_text

from ctr_pvs.errors import RobotFileError
from ctr_pvs.robot.reading.hints import remedy

STIFF = "bending_stiffness: 0.02, torsional_stiffness: 0.015"
NITINOL = "youngs_modulus: 6.0e10, poissons_ratio: 0.3"


def text_of(tube: str, more: str = "") -> str:
    return f"name: r\ntubes: [{{name: t, {tube}}}]\n{more}"


@pytest.mark.parametrize(
    ("tube", "same"),
    [
        (f"{STIFF}, segments: [{{length_mm: 93.5}}]", f"{STIFF}, segments: [{{length: 93.5e-3}}]"),
        (f"{STIFF}, inner_diameter_mm: 1.1, outer_diameter_mm: 1.5, segments: [{{length: 0.1}}]",
         f"{STIFF}, inner_diameter: 1.1e-3, outer_diameter: 1.5e-3, segments: [{{length: 0.1}}]"),
        (f"{NITINOL}, segments: [{{length: 0.1, inner_diameter_mm: 0, outer_diameter_mm: 1.5}}]",
         f"{NITINOL}, segments: [{{length: 0.1, inner_diameter: 0, outer_diameter: 1.5e-3}}]"),
        (f"{STIFF}, segments: [{{length: 0.1, radius: 0.125}}]",
         f"{STIFF}, segments: [{{length: 0.1, curvature_y: [8]}}]"),
        (f"{STIFF}, segments: [{{length: 0.1, radius_mm: -125}}]",
         f"{STIFF}, segments: [{{length: 0.1, curvature_y: [-8]}}]"),
        (f"{STIFF}, straight_length: 0.2, curved_length: 0.1, curvature: 8",
         f"{STIFF}, segments: [{{length: 0.2}}, {{length: 0.1, curvature_y: [8]}}]"),
        (f"{STIFF}, straight_length_mm: 200, curved_length_mm: 100, radius_mm: 125",
         f"{STIFF}, segments: [{{length: 0.2}}, {{length: 0.1, curvature_y: [8]}}]"),
        (f"{STIFF}, straight_length: 0, curved_length: 0.1, radius: 0.125",
         f"{STIFF}, segments: [{{length: 0.1, curvature_y: [8]}}]"),
        (f"{STIFF}, curved_length: 0.1, radius: 0.125", f"{STIFF}, segments: [{{length: 0.1, curvature_y: [8]}}]"),
        (f"{STIFF}, straight_length: 0.2", f"{STIFF}, segments: [{{length: 0.2}}]"),
    ],
)  # fmt: skip
def test_keys_that_say_their_unit_are_the_same_robot(tmp_path, tube, same):
    assert load_text(tmp_path, text_of(tube)) == load_text(tmp_path, text_of(same))


def test_limits_in_degrees_and_millimetres(tmp_path):
    more = "limits: {alpha_deg: {t: [-180, 90]}, D_mm: {t: [0, 50]}}\n"
    limits = load_text(tmp_path, text_of(f"{STIFF}, straight_length: 0.2", more)).limits
    assert limits.alpha[0] == pytest.approx((-math.pi, math.pi / 2))
    assert limits.D[0] == pytest.approx((0.0, 0.05))


@pytest.mark.parametrize(
    ("tube", "field", "words"),
    [
        ("segments: [{length: 0.1, length_mm: 100}]", "segments[0].length_mm", ["not both"]),
        ("segments: [{length_mm: -5}]", "segments[0].length_mm", ["-5", "mm"]),
        ("segments: [{length_mm: x}]", "segments[0].length_mm", ["'x'", "mm"]),
        ("segments: [{length: 0.1, radius: 0}]", "segments[0].radius", ["0", "straight"]),
        ("segments: [{length: 0.1, radius_mm: .inf}]", "segments[0].radius_mm", ["inf", "mm"]),
        ("segments: [{length: 0.1, radius: 0.1, curvature_z: [1]}]", "segments[0].radius", ["not both"]),
        ("segments: [{length: 0.1, radius: 0.1, radius_mm: 100}]", "segments[0].radius_mm", ["not both"]),
        ("segments: [{length: 0.1, straight_length: 0.1}]", "segments[0].straight_length", ["write length"]),
        ("segments: [{length: 0.1}], curved_length: 0.1", "curved_length", ["segments", "not both"]),
        ("segments: [{length: 0.1}], radius: 0.1", "curvature", ["segments", "not both"]),
        ("curved_length: 0.1", "curvature", ["1/m", "radius"]),
        ("straight_length: 0.1, radius: 0.1", "curved_length", ["nothing"]),
        ("radius: 0.1", "curved_length", ["nothing"]),
        ("straight_length: 0", "straight_length", ["curved_length"]),
        ("curved_length: 0.1, curvature: [1]", "curvature", ["[1]"]),
    ],
)  # fmt: skip
def test_what_contradicts_itself_is_named(tmp_path, tube, field, words):
    with pytest.raises(RobotFileError) as caught:
        load_text(tmp_path, text_of(f"{STIFF}, {tube}"))
    assert caught.value.field == f"tubes[0].{field}"
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


@pytest.mark.parametrize(
    ("limits", "field", "words"),
    [
        ("alpha_deg: {t: [180, -180]}", "alpha_deg.t", ["[180, -180]", "deg", "lower"]),
        ("alpha_deg: {t: [-180]}", "alpha_deg.t", ["two numbers"]),
        ("alpha_deg: {t: [-180, x]}", "alpha_deg.t[1]", ["'x'"]),
        ("alpha_deg: {t: [-9, 9]}, alpha: {t: [-1, 1]}", "alpha_deg", ["not both"]),
        ("alpha_deg: {u: [-9, 9]}", "alpha_deg.u", ["tubes t"]),
        ("D_mm: {t: [0]}", "D_mm.t", ["two numbers in mm"]),
        ("beta: {t: [-0.1, 0]}", "beta", ["D = -beta", "[-high, -low]"]),
        ("theta: {t: [-1, 1]}", "theta", ["write alpha"]),
        ("theta_deg: {t: [-1, 1]}", "theta_deg", ["write alpha in rad", "0.01745"]),
    ],
)  # fmt: skip
def test_wrong_limits_are_named(tmp_path, limits, field, words):
    with pytest.raises(RobotFileError) as caught:
        load_text(tmp_path, text_of(f"{STIFF}, straight_length: 0.2", f"limits: {{{limits}}}\n"))
    assert caught.value.field == f"limits.{field}"
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


TUBE = ("name", "youngs_modulus", "shear_modulus", "poissons_ratio", "inner_diameter", "outer_diameter", "density")


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("inner_diameter_mm", ["inner_diameter in m", "1 mm is 1e-3 m"]),
        ("inner_diameter_cm", ["inner_diameter in m", "1e-2 m"]),
        ("OD", ["outer_diameter", "SI"]),
        ("OD_mm", ["outer_diameter in m", "1e-3 m"]),
        ("E", ["youngs_modulus", "SI"]),
        ("E_GPa", ["youngs_modulus in Pa", "1e9 Pa"]),
        ("density_g_cm3", ["density in kg/m^3", "1e3"]),
        ("outer_radius", ["2 * outer_radius"]),
        ("beta", ["D = -beta"]),
        ("u_x", ["curvature_y"]),
        ("inner_diameter_ft", ["'inner_diameter', in SI units"]),
        ("inner_diametre", ["did you mean 'inner_diameter'?"]),
        ("colour", ["remove it"]),
    ],
)  # fmt: skip
def test_a_key_of_others_is_answered_with_its_conversion(key, words):
    said = remedy(key, TUBE)
    assert not [word for word in words if word not in said], said
