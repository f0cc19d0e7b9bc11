"""Wrong robot files: whatever is wrong is said with file, key path, value and rule."""

from __future__ import annotations

from pathlib import Path

import pytest
from robot_texts import GOOD
from robot_texts import load_text

from ctr_pvs.errors import RobotFileError
from ctr_pvs.robot.file import load_robot

OUTER, INNER = "tubes[0]", "tubes[1]"


def refusal(tmp_path: Path, text: str | bytes) -> RobotFileError:
    with pytest.raises(RobotFileError) as caught:
        load_text(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(str(tmp_path / "robot.yaml") + ": ")
    assert "expected " in message
    assert ", got " in message
    assert len(message.splitlines()) == 1
    return caught.value


@pytest.mark.parametrize(
    ("old", "new", "field", "words"),
    [
        # keys
        ("name: pair", "", "name", ["nothing", "the robot's name"]),
        ("name: pair", "name:", "name", ["nothing"]),
        ("name: pair", "name: 7", "name", ["7"]),
        ("name: pair", "nmae: pair", "nmae", ["'nmae'", "did you mean 'name'?"]),
        ("name: pair", "name: pair\nunits: mm", "units", ["'units'", "name, tubes, limits", "remove it"]),
        ("name: pair", "name: pair\n7: mm", "7", ["one of the keys"]),
        ("{length: 93.5e-3}", "{lenght: 93.5e-3}", f"{OUTER}.segments[0].lenght", ["did you mean 'length'?"]),
        ("{length: 93.5e-3}", "{}", f"{OUTER}.segments[0].length", ["nothing"]),
        ("    shear_modulus: 21.5e9\n", "", f"{OUTER}.segments[0].shear_modulus", ["nothing", "poissons_ratio"]),
        ("    youngs_modulus: 58.0e9\n", "", f"{OUTER}.segments[0].youngs_modulus", ["nothing"]),
        ("    outer_diameter: 2.39e-3\n", "", f"{OUTER}.segments[0].outer_diameter", ["nothing"]),
        ("    torsional_stiffness: 0.013\n", "", f"{INNER}.segments[0].torsional_stiffness", ["nothing"]),
        ("    bending_stiffness: 0.018\n    torsional_stiffness: 0.013\n", "", f"{INNER}.segments[0].youngs_modulus",
         ["nothing", "bending_stiffness and torsional_stiffness"]),
        ("    shear_modulus: 21.5e9\n", "    sheer_modulus: 21.5e9\n", f"{OUTER}.sheer_modulus",
         ["did you mean 'shear_modulus'?"]),
        ("name: inner", "name: inner\n    name: again", f"{INNER}.name", ["once", "line 12"]),
        ("{length: 0.2}", "{length: 0.2, length: 0.2}", f"{INNER}.segments[0].length", ["once", "line 15"]),
        ("name: inner", "<<: {name: inner}", f"{INNER}.<<", ["one of the keys"]),
        # lengths
        ("length: 93.5e-3", "length: 0", f"{OUTER}.segments[0].length", ["0", "from 1e-07 to 1000 m"]),
        ("length: 93.5e-3", "length: -1e-3", f"{OUTER}.segments[0].length", ["-0.001"]),
        ("length: 93.5e-3", "length: 93500.0", f"{OUTER}.segments[0].length", ["93500", "m"]),
        ("length: 93.5e-3", "length: .nan", f"{OUTER}.segments[0].length", ["nan"]),
        ("length: 93.5e-3", "length: .inf", f"{OUTER}.segments[0].length", ["inf"]),
        ("length: 93.5e-3", "length: -.Inf", f"{OUTER}.segments[0].length", ["-inf"]),
        ("length: 93.5e-3", "length: 1e400", f"{OUTER}.segments[0].length", ["inf"]),
        ("length: 93.5e-3", "length: true", f"{OUTER}.segments[0].length", ["True"]),
        ("length: 93.5e-3", "length: '93.5e-3'", f"{OUTER}.segments[0].length", ["'93.5e-3'", "without quotes"]),
        ("length: 93.5e-3", "length: 93.5 mm", f"{OUTER}.segments[0].length", ["'93.5 mm'"]),
        ("length: 93.5e-3", "length: 1:30", f"{OUTER}.segments[0].length", ["'1:30'"]),
        ("length: 93.5e-3", "length: [0.1]", f"{OUTER}.segments[0].length", ["[0.1]"]),
        ("length: 93.5e-3", "length: " + "9" * 5000, f"{OUTER}.segments[0].length", ["999"]),
        # material
        ("youngs_modulus: 58.0e9", "youngs_modulus: 58.0", f"{OUTER}.youngs_modulus", ["58.0", "Pa"]),
        ("youngs_modulus: 58.0e9", "youngs_modulus: -58.0e9", f"{OUTER}.youngs_modulus", ["-58000000000.0"]),
        ("youngs_modulus: 58.0e9", "youngs_modulus:", f"{OUTER}.youngs_modulus", ["nothing"]),
        ("shear_modulus: 21.5e9", "shear_modulus: .nan", f"{OUTER}.shear_modulus", ["nan"]),
        ("shear_modulus: 21.5e9", "poissons_ratio: 0.51", f"{OUTER}.poissons_ratio", ["0.51", "to 0.5"]),
        ("shear_modulus: 21.5e9", "poissons_ratio: -1", f"{OUTER}.poissons_ratio", ["-1", "above -1"]),
        ("shear_modulus: 21.5e9", "poissons_ratio: -1.5", f"{OUTER}.poissons_ratio", ["-1.5"]),
        ("shear_modulus: 21.5e9", "shear_modulus: 21.5e9\n    poissons_ratio: 0.3", f"{OUTER}.poissons_ratio",
         ["0.3", "not both"]),
        ("bending_stiffness: 0.018", "bending_stiffness: 0", f"{INNER}.bending_stiffness", ["0", "N m^2"]),
        ("torsional_stiffness: 0.013", "torsional_stiffness: -1", f"{INNER}.torsional_stiffness", ["-1"]),
        ("bending_stiffness: 0.018", "bending_stiffness: 0.018\n    youngs_modulus: 58e9", f"{INNER}.bending_stiffness",
         ["0.018", "one way", "youngs_modulus"]),
        ("{length: 0.2}", "{length: 0.2, bending_stiffness: 1, torsional_stiffness: 1, poissons_ratio: 0.3}",
         f"{INNER}.segments[0].torsional_stiffness", ["one way", "poissons_ratio"]),
        ("{length: 93.5e-3}", "{length: 93.5e-3, bending_stiffness: 0.02}",
         f"{OUTER}.segments[0].torsional_stiffness", ["nothing"]),
        # diameters
        ("outer_diameter: 2.39e-3", "outer_diameter: 2.01e-3", f"{OUTER}.outer_diameter",
         ["0.00201", "inner_diameter"]),
        ("outer_diameter: 2.39e-3", "outer_diameter: 1e-3", f"{OUTER}.outer_diameter", ["0.001"]),
        ("outer_diameter: 2.39e-3", "outer_diameter: 23.9", f"{OUTER}.outer_diameter", ["23.9", "m"]),
        ("inner_diameter: 2.01e-3", "inner_diameter: -2.01e-3", f"{OUTER}.inner_diameter", ["-0.00201"]),
        ("{length: 93.5e-3}", "{length: 93.5e-3, outer_diameter: 2e-3}", f"{OUTER}.segments[0].outer_diameter",
         ["0.002", "0.00201"]),
        ("torsional_stiffness: 0.013", "torsional_stiffness: 0.013\n    inner_diameter: 0",
         f"{INNER}.segments[0].outer_diameter", ["nothing", "both diameters"]),
        ("torsional_stiffness: 0.013", "torsional_stiffness: 0.013\n    inner_diameter: 0\n    outer_diameter: 2.02e-3",
         f"{INNER}.outer_diameter", ["0.00202", "bore", "'outer'", "0.00201"]),
        # pre-curvature
        ("curvature_y: [9.9]", "curvature_y: 9.9", f"{OUTER}.segments[1].curvature_y", ["9.9", "write [9.9]"]),
        ("curvature_y: [9.9]", "curvature_y: ", f"{OUTER}.segments[1].curvature_y", ["nothing", "list"]),
        ("curvature_y: [9.9]", "curvature_y: [9.9, .nan]", f"{OUTER}.segments[1].curvature_y[1]", ["nan"]),
        ("curvature_y: [9.9]", "curvature_y: [9.9, x]", f"{OUTER}.segments[1].curvature_y[1]", ["'x'"]),
        ("curvature_y: [9.9]", "curvature_z: [true]", f"{OUTER}.segments[1].curvature_z[0]", ["True"]),
        ("curvature_y: [9.9]", "curvature_z: [9.9e6]", f"{OUTER}.segments[1].curvature_z", ["9900000", "1/m"]),
        ("curvature_y: [9.9]", "curvature_x: [9.9]", f"{OUTER}.segments[1].curvature_x", ["did you mean 'curvature_"]),
        ("curvature_y: [9.9]", "curvature: 9.9", f"{OUTER}.segments[1].turn", ["nothing", "curvature_y: [...]"]),
        ("curvature_y: [9.9]", "turn: 9.9", f"{OUTER}.segments[1].curvature", ["nothing"]),
        ("curvature_y: [9.9]", "curvature: 9.9, turn: .inf", f"{OUTER}.segments[1].turn", ["inf", "rad/m"]),
        ("curvature_y: [9.9]", "curvature: 9.9e6, turn: 1", f"{OUTER}.segments[1].curvature", ["9900000", "1/m"]),
        ("curvature_y: [9.9]", "curvature: [9.9, x], turn: 1", f"{OUTER}.segments[1].curvature[1]", ["'x'"]),
        ("curvature_y: [9.9]", "curvature: [9.9e6], turn: 1", f"{OUTER}.segments[1].curvature", ["9900000", "1/m"]),
        ("curvature_y: [9.9]", "curvature: 9.9, turn: 1, curvature_y: [1]", f"{OUTER}.segments[1].curvature",
         ["9.9", "not both"]),
        ("curvature_y: [9.9]", "turn: 1, curvature_z: [1]", f"{OUTER}.segments[1].turn", ["1", "not both"]),
        # tubes
        ("name: inner", "name: outer", f"{INNER}.name", ["'outer'", "no other tube"]),
        ("name: inner", "name: inner tube", f"{INNER}.name", ["'inner tube'", "ROS"]),
        ("name: inner", "name: 2", f"{INNER}.name", ["2"]),
        ("name: inner", "name: true", f"{INNER}.name", ["True"]),
        ("name: inner", "{}", "", ["valid YAML", "line 12"]),
        ("      - {length: 0.2}\n", "", f"{INNER}.segments", ["nothing", "at least one segment"]),
        ("      - {length: 0.2}\n", "      []\n", f"{INNER}.segments", ["[]", "at least one segment"]),
        ("      - {length: 0.2}\n", "      {length: 0.2}\n", f"{INNER}.segments", ["{'length': 0.2}"]),
        ("- {length: 0.2}", "- 0.2", f"{INNER}.segments[0]", ["0.2", "mapping"]),
        # limits
        ("alpha: {inner: [-3, 3]}", "alfa: {inner: [-3, 3]}", "limits.alfa", ["did you mean 'alpha'?"]),
        ("{inner: [-3, 3]}", "{iner: [-3, 3]}", "limits.alpha.iner", ["did you mean 'inner'?", "tubes outer, inner"]),
        ("[-3, 3]", "[3, -3]", "limits.alpha.inner", ["[3, -3]", "lower"]),
        ("[-3, 3]", "[-3]", "limits.alpha.inner", ["[-3]", "two numbers"]),
        ("[-3, 3]", "3", "limits.alpha.inner", ["3", "two numbers"]),
        ("[-3, 3]", "'ab'", "limits.alpha.inner", ["'ab'", "two numbers"]),
        ("[-3, 3]", "[-3, .nan]", "limits.alpha.inner[1]", ["nan"]),
        ("[-3, 3]", "[-3, x]", "limits.alpha.inner[1]", ["'x'"]),
        ("{inner: [-3, 3]}", "[-3, 3]", "limits.alpha", ["[-3, 3]", "mapping"]),
        ("D: {outer: [0, 0.1]}", "D: {outer: [0.2, 0.3]}", "limits.D.outer", ["0.2, 0.3", "0.1858 m"]),
        ("D: {outer: [0, 0.1]}", "D: {outer: [0.1, 0.2], inner: [0, 0.05]}", "limits.D.inner",
         ["at least 0.1 m", "'outer'"]),
    ],
)  # fmt: skip
def test_a_wrong_value_is_named(tmp_path, old, new, field, words):
    assert GOOD.count(old) >= 1
    error = refusal(tmp_path, GOOD.replace(old, new, 1))
    assert error.field == field, str(error)
    assert (f": {field}: expected" in str(error)) == bool(field)
    missing = [word for word in words if word not in str(error)]
    assert not missing, str(error)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", ["nothing", "mapping"]),
        (b"# only a comment\n", ["nothing"]),
        (b"- 1\n- 2\n", ["[1, 2]", "mapping"]),
        (b"just text", ["'just text'"]),
        (b"name: [unclosed", ["valid YAML", "line 1"]),
        (b"name: a\n\tx: b", ["valid YAML", "line 2"]),
        (b"name: a\n---\nname: b\n", ["valid YAML", "line 2"]),
        (b"name: \xff\xfe", ["UTF-8", "0xff", "offset 6"]),
        (b"name: a\x00b", ["valid YAML"]),
        (b"\x89PNG\r\n\x1a\n", ["UTF-8"]),
        (b"name: *nowhere", ["valid YAML", "nowhere"]),
        (b"name: !!python/object:os.system x", ["tag"]),
        (b"name: !!int x", ["'x'", "int"]),
        (b"? [a, b]\n: 1", ["text as a key", "line 1"]),
        (b"name: &a [*a]", ["contains itself"]),
        (b"[" * 5000, ["nesting"]),
        (b"#" * 2_000_000, ["1000000 bytes"]),
    ],
)
def test_a_file_that_is_no_robot_file_is_refused(tmp_path, content, words):
    error = refusal(tmp_path, content)
    missing = [word for word in words if word not in str(error)]
    assert not missing, str(error)


def test_aliases_of_aliases_do_not_blow_up(tmp_path):
    lines = ["a0: &a0 [x, x]"] + [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 30)]
    error = refusal(tmp_path, "\n".join(lines) + "\nname: *a29\n")
    assert len(str(error)) < 1000


@pytest.mark.parametrize(
    ("path", "words"),
    [("missing.yaml", "No such file"), (".", "directory"), ("nul\0l.yaml", "null"), ("a" * 300, "too long")],
)
def test_a_file_that_cannot_be_opened_is_named(tmp_path, path, words):
    with pytest.raises(RobotFileError, match=words) as caught:
        load_robot(tmp_path / path)
    assert str(caught.value).startswith(str(tmp_path))
    assert len(str(caught.value).splitlines()) == 1
