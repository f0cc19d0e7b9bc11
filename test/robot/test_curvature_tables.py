"""Pre-curvature as a table of samples: few segments, within the tolerance, and no swinging between samples."""

from __future__ import annotations

import re

import numpy as np
import pytest
from robot_texts import load_text

from ctr_pvs.errors import RobotFileError
from ctr_pvs.robot.reading.curvature_table import MOST_PIECES
from ctr_pvs.robot.reading.curvature_table import Samples
from ctr_pvs.robot.reading.samples import TOLERANCE
from ctr_pvs.robot.robot import Tube

LENGTH = 0.2
STIFF = "bending_stiffness: 0.02, poissons_ratio: 0.3"


def smooth(s):
    """kappa_y + i kappa_z [1/m]."""
    return 10.0 + 5.0 * np.sin(40.0 * s) + 3j * np.cos(25.0 * s)


def curvature_along(tube: Tube, X):
    """kappa_y + i kappa_z at abscissae X [m] of the whole tube."""
    index = np.clip(np.searchsorted(tube.breaks, X, side="right") - 1, 0, len(tube.segments) - 1)
    pairs = zip(X, index, strict=True)
    return np.array([tube.segments[i].pre_curvature(x - tube.breaks[i]) for x, i in pairs])


def text_of(s, kappa, more="") -> str:
    rows = {"s": s, "kappa_y": kappa.real, "kappa_z": kappa.imag}
    columns = ", ".join(f"{key}: {np.asarray(values).tolist()}" for key, values in rows.items())
    return f"name: r\ntubes: [{{name: t, {STIFF}, curvature_table: {{{columns}{more}}}}}]\n"


@pytest.mark.parametrize("tolerance", [1e-2, 1e-4, 1e-6, 1e-8])
def test_a_smooth_table_takes_few_segments_and_keeps_to_the_curve(tmp_path, tolerance):
    s = np.linspace(0.0, LENGTH, 400)
    tube = load_text(tmp_path, text_of(s, smooth(s), f", tolerance: {tolerance}")).tubes[0]
    assert len(tube.segments) <= 4
    assert tube.length == pytest.approx(LENGTH, abs=1e-15)
    assert np.abs(curvature_along(tube, s) - smooth(s)).max() <= tolerance + 1e-12
    between = np.linspace(0.0, LENGTH, 7919)
    assert np.abs(curvature_along(tube, between) - smooth(between)).max() <= 2.0 * tolerance + 1e-9


def test_the_tolerance_has_a_default(tmp_path):
    s = np.linspace(0.0, LENGTH, 100)
    given, default = (load_text(tmp_path, text_of(s, smooth(s), more)) for more in (f", tolerance: {TOLERANCE}", ""))
    assert given == default


def test_a_polynomial_comes_back_as_one_segment():
    s = np.linspace(0.0, 0.1, 50)
    coefficients = np.array([9.0 + 1j, -200.0, 4e3j])
    (piece,) = Samples(s, np.polynomial.Polynomial(coefficients)(s)).pieces(1e-9)
    np.testing.assert_allclose(piece.coefficients, coefficients, rtol=1e-9)


def test_a_step_takes_a_steep_segment_between_two_samples():
    s = np.linspace(0.0, 0.1, 101)
    before, steep, after = Samples(s, np.where(s < 0.05, 0.0, 12.0) + 0j).pieces(1e-6)
    assert before.length == pytest.approx(0.049, abs=1e-3) and steep.length <= 3e-3
    assert after.coefficients == pytest.approx((12.0,))


def test_places_may_be_uneven():
    s = np.sort(np.concatenate([[0.0, LENGTH], np.random.default_rng(3).uniform(0.0, LENGTH, 300)]))
    pieces = Samples(s, smooth(s)).pieces(1e-5)
    assert pieces is not None and len(pieces) <= 6
    assert sum(piece.length for piece in pieces) == pytest.approx(LENGTH)


def test_few_samples_are_not_swung_through():
    """Nine samples of noise fit a polynomial of degree 8 exactly, which is far off between them."""
    s = np.linspace(0.0, 0.1, 9)
    kappa = np.array([5.0, 5.0, 5.0, 5.0, 6.0, 5.0, 5.0, 5.0, 5.0]) + 0j
    pieces = Samples(s, kappa).pieces(1e-9)
    starts = np.cumsum([0.0, *(piece.length for piece in pieces)])
    for start, piece in zip(starts, pieces, strict=False):
        X = np.linspace(0.0, piece.length, 100)
        off = np.polynomial.Polynomial(piece.coefficients)(X) - np.interp(start + X, s, kappa.real)
        assert np.abs(off).max() <= 0.51  # a quarter of the change of slope, 2, at the peak


def test_noise_is_refused_with_a_tolerance_that_does(tmp_path):
    s = np.linspace(0.0, LENGTH, 400)
    noisy = smooth(s) + np.random.default_rng(1).normal(0.0, 0.3, len(s))
    with pytest.raises(RobotFileError, match=r"tolerance: .* would do") as caught:
        load_text(tmp_path, text_of(s, noisy, ", tolerance: 1e-6"))
    assert caught.value.field == "tubes[0].curvature_table"
    enough = re.search(r"tolerance: (\S+) would do", str(caught.value)).group(1)
    assert 0.1 < float(enough) < 1.0
    tube = load_text(tmp_path, text_of(s, noisy, f", tolerance: {enough}")).tubes[0]
    assert len(tube.segments) <= MOST_PIECES
    assert np.abs(curvature_along(tube, s) - noisy).max() <= float(enough) + 1e-9


def test_a_segment_may_have_a_table_between_others(tmp_path):
    text = (
        f"name: r\ntubes:\n  - {{name: t, {STIFF}, segments: [{{length_mm: 50}}, "
        "{curvature_table: {s: [0, 0.01, 0.03], kappa_z: [1, 2, 4]}, bending_stiffness: 0.01}, {length: 0.01}]}\n"
    )
    tube = load_text(tmp_path, text).tubes[0]
    assert tube.breaks.tolist() == pytest.approx([0.0, 0.05, 0.08, 0.09])
    assert tube.segments[1].bending_stiffness == 0.01
    np.testing.assert_allclose(tube.segments[1].pre_curvature([0.0, 0.03]), [1j, 4j], atol=1e-9)


def test_a_table_may_stand_in_a_csv_file_beside_the_robot_file(tmp_path):
    s = np.linspace(0.0, LENGTH, 50)
    rows = [
        f"{place!r},{kappa.imag!r},{kappa.real!r}" for place, kappa in zip(s.tolist(), smooth(s).tolist(), strict=True)
    ]
    (tmp_path / "measured.csv").write_text("\n".join([" s,kappa_z ,kappa_y", *rows]) + "\n", encoding="utf-8")
    text = f"name: r\ntubes: [{{name: t, {STIFF}, curvature_table: {{file: measured.csv, tolerance: 1e-3}}}}]\n"
    assert load_text(tmp_path, text) == load_text(tmp_path, text_of(s, smooth(s), ", tolerance: 1e-3"))


SAMPLES = "s: [0, 0.01], kappa_y: [1, 2]"


@pytest.mark.parametrize(
    ("table", "field", "words"),
    [
        ("kappa_y: [1, 2]", ".s", ["nothing", "in m"]),
        ("s: [0, 0.01]", ".kappa_y", ["nothing", "1/m"]),
        ("s: [0], kappa_y: [1]", ".s", ["two places"]),
        ("s: [0.01, 0.02], kappa_y: [1, 2]", ".s[0]", ["0.01", "base"]),
        ("s: [0, 0.02, 0.01], kappa_y: [1, 2, 3]", ".s[2]", ["0.01", "after", "0.02"]),
        ("s: [0, 10, 2000], kappa_y: [1, 2, 3]", ".s[2]", ["2000"]),
        ("s: [0, 0.01], kappa_y: [1]", ".kappa_y", ["1 values", "2, one for each s"]),
        ("s: [0, 0.01], kappa_z: [1, .nan]", ".kappa_z[1]", ["nan"]),
        ("s: [0, 0.01], kappa_x: [1, 2]", ".kappa_x", ["did you mean 'kappa_"]),
        (f"{SAMPLES}, tolerance: 0", ".tolerance", ["0", "1/m"]),
        (f"{SAMPLES}, file: a.csv", ".s", ["either file or s"]),
        ("file: 7", ".file", ["7", "name of a CSV file"]),
    ],
)
def test_a_wrong_table_is_named(tmp_path, table, field, words):
    with pytest.raises(RobotFileError) as caught:
        load_text(tmp_path, f"name: r\ntubes: [{{name: t, {STIFF}, curvature_table: {{{table}}}}}]\n")
    assert caught.value.field == f"tubes[0].curvature_table{field}"
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


@pytest.mark.parametrize(
    ("segment", "field", "words"),
    [
        (f"length: 0.02, curvature_table: {{{SAMPLES}}}", "length", ["0.02", "0.01 m"]),
        (f"curvature_y: [1], curvature_table: {{{SAMPLES}}}", "curvature_y", ["not both"]),
        ("curvature_table: [1]", "curvature_table", ["mapping"]),
    ],
)
def test_a_table_replaces_length_and_polynomials(tmp_path, segment, field, words):
    with pytest.raises(RobotFileError) as caught:
        load_text(tmp_path, f"name: r\ntubes: [{{name: t, {STIFF}, segments: [{{{segment}}}]}}]\n")
    assert caught.value.field == f"tubes[0].segments[0].{field}"
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (None, ["No such file", "CSV"]),
        ("", ["s", "nothing"]),
        ("s,kappa_y\n0,1\n0.01\n", ["line 3", "2 numbers"]),
        ("s,kappa_y\n0,1\n0.01,x\n", ["line 3, kappa_y", "'x'"]),
        ("s,kappa_y\n0,1\n0.01,inf\n", ["kappa_y[1]", "inf"]),
        ("s,s\n0,1\n", ["once"]),
        ("s_mm,kappa_y\n0,1\n", ["s_mm", "1e-3 m"]),
        ("kappa_y\n1\n", ["s", "nothing"]),
    ],
)
def test_a_wrong_csv_file_is_named(tmp_path, content, words):
    if content is not None:
        (tmp_path / "a.csv").write_text(content, encoding="utf-8")
    with pytest.raises(RobotFileError, match=r"a\.csv: ") as caught:
        load_text(tmp_path, f"name: r\ntubes: [{{name: t, {STIFF}, curvature_table: {{file: a.csv}}}}]\n")
    assert not [word for word in words if word not in str(caught.value)], str(caught.value)
