"""Tables of measurements: read as they are meant, and refused in one line that says where."""

from __future__ import annotations

import numpy as np
import pytest

from ctr_pvs.errors import TableError
from ctr_pvs.tasks.calibration.registration import best_registration
from ctr_pvs.tasks.calibration.registration import left_jacobian
from ctr_pvs.tasks.calibration.registration import matrices
from ctr_pvs.tasks.calibration.registration import quaternion
from ctr_pvs.tasks.calibration.registration import rotation
from ctr_pvs.tasks.calibration.table import Measurements
from ctr_pvs.tasks.calibration.table import read_measurements

HEAD = "alpha_1,alpha_2,D_1,D_2,x,y,z"
ROWS = ["0,170,10,20,1,2,3", "0,-170,10,20,1,2,3", "0,-150,10,20,1,2,4", "0,-130,11,20,1,2,5", "0,-100,12,20,1,2,6"]


def write(tmp_path, head=HEAD, rows=ROWS):
    file = tmp_path / "tips.csv"
    file.write_text("\n".join([head, *rows]) + "\n")
    return file


def test_units_names_and_wraps(tmp_path):
    file = write(tmp_path, HEAD.replace("alpha_2", "theta2").replace("D_2", "beta"), ROWS)
    data = read_measurements(file, 2, {"alpha_2": "theta2", "D_2": "beta"}, degrees=True, mm=True)
    assert np.degrees(data.alpha[:, 1]) == pytest.approx([170, 190, 210, 230, 260])
    assert data.D[0] == pytest.approx([0.01, 0.02]) and data.position[-1] == pytest.approx([0.001, 0.002, 0.006])
    assert data.axes.shape == (5, 0) and data.tip_force is None
    as_written = read_measurements(file, 2, {"alpha_2": "theta2", "D_2": "beta"}, degrees=True, unwrap=False)
    assert np.degrees(as_written.alpha[1, 1]) == pytest.approx(-170)


def test_negative_base_positions(tmp_path):
    rows = [row.replace(",10,20,", ",-10,-20,").replace(",11,20,", ",-11,-20,").replace(",12,20,", ",-12,-20,")
            for row in ROWS]  # fmt: skip
    data = read_measurements(write(tmp_path, rows=rows), 2, mm=True, beta_sign=-1.0)
    assert data.D[:, 1] == pytest.approx(np.full(5, 0.02))


def test_tangents_poses_and_forces(tmp_path):
    rows = [f"{row},1,0,0,0.5,0,0" for row in ROWS]
    data = read_measurements(write(tmp_path, HEAD + ",tx,ty,tz,fx,fy,fz", rows), 2)
    assert data.n_axes == 1 and data.axes[0].tolist() == [1.0, 0.0, 0.0]
    assert data.tip_force[0].tolist() == [0.5, 0.0, 0.0]
    half = np.sqrt(0.5)
    rows = [f"{row},0,0,{half},{half}" for row in ROWS]  # a quarter turn about z
    data = read_measurements(write(tmp_path, HEAD + ",qx,qy,qz,qw", rows), 2)
    assert data.n_axes == 2 and data.axes[0] == pytest.approx([0, 1, 0, -1, 0, 0], abs=1e-12)


@pytest.mark.parametrize(
    ("head", "rows", "place"),
    [
        (HEAD.replace("D_2", "d2"), ROWS, "column D_2"),
        (HEAD, [*ROWS[:3], "0,1,10,20,1,2,nan", ROWS[4]], "column z, row 4"),
        (HEAD, [*ROWS[:2], "0,1,10,20,1,two,3", *ROWS[3:]], "column y, row 3"),
        (HEAD, [*ROWS[:4], "0,1,10"], "row 5"),
        (HEAD, ROWS[:2], "2 rows"),
        (HEAD + ",tx,ty", [row + ",1,0" for row in ROWS], "column tz"),
        (HEAD + ",tx,ty,tz", [row + ",1,1,0" for row in ROWS], "tangent, row 1"),
    ],
)
def test_bad_tables_are_told_in_one_line(tmp_path, head, rows, place):
    with pytest.raises(TableError, match=place) as caught:
        read_measurements(write(tmp_path, head, rows), 2)
    assert "\n" not in str(caught.value)


def test_no_such_file_and_no_such_column(tmp_path):
    with pytest.raises(TableError, match="a CSV file that can be read"):
        read_measurements(tmp_path / "none.csv", 2)
    with pytest.raises(TableError, match="columns: expected one of"):
        read_measurements(write(tmp_path), 2, {"alpha_3": "a"})


def test_arrays_are_checked():
    good = np.zeros((5, 2)), np.zeros((5, 2)), np.zeros((5, 3))
    with pytest.raises(TableError, match="D"):
        Measurements(good[0], np.zeros((5, 3)), good[2])
    with pytest.raises(TableError, match="position, row 2"):
        Measurements(*good[:2], np.array([[0, 0, 0], [0, np.inf, 0], *[[0, 0, 0]] * 3], dtype=float))
    with pytest.raises(TableError, match="at least 4 rows"):
        Measurements(*(part[:2] for part in good))


def test_a_cloud_is_registered():
    rng = np.random.default_rng(1)
    R, t, points = rotation(rng.normal(size=3)), rng.normal(size=3), rng.normal(size=(20, 3))
    found = best_registration(points, points @ R.T + t)
    assert found[0] == pytest.approx(R, abs=1e-12) and found[1] == pytest.approx(t, abs=1e-12)
    flat = points * [1.0, 1.0, 0.0]  # a mirror image would fit as well
    assert np.linalg.det(best_registration(flat, flat @ R.T)[0]) == pytest.approx(1.0)


@pytest.mark.parametrize("size", [0.0, 1e-6, 0.3, 2.5, 3.14])
def test_turns(size):
    v = size * np.array([0.6, -0.48, 0.64])
    R = rotation(v)
    square = R @ R.T
    assert square == pytest.approx(np.eye(3), abs=1e-12)
    assert matrices(quaternion(R)[None])[0] == pytest.approx(R, abs=1e-12)
    for axis in np.eye(3):
        change = (rotation(v + 1e-6 * axis) - rotation(v - 1e-6 * axis)) / 2e-6 @ R.T
        turn = np.array([change[2, 1], change[0, 2], change[1, 0]])
        assert left_jacobian(v) @ axis == pytest.approx(turn, abs=1e-8)
