"""The launch file, the parameter file and the package files agree with one another. Read as data: no ROS needed."""

import ast
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import yaml
from checkout import entry_points
from setuptools import find_packages

ROOT = Path(__file__).parents[2]
OWN = {"ctr_pvs", "ctr_pvs_interfaces"}
WITHOUT_DEFAULT = {"robot_file", "initial_command", "rotation_limits", "translation_limits"}
LAUNCH = ROOT / "launch" / "equilibrium.launch.xml"


def setup_arguments() -> dict[str, ast.expr]:
    """The keyword arguments of setup() in setup.py."""
    tree = ast.parse((ROOT / "setup.py").read_text(encoding="utf-8"))
    call = next(node for node in ast.walk(tree) if isinstance(node, ast.Call) and ast.unparse(node.func) == "setup")
    return {keyword.arg: keyword.value for keyword in call.keywords}


def package_description(folder: Path) -> ET.Element:
    """The root of a package.xml."""
    return ET.parse(folder / "package.xml").getroot()


def needed(package: ET.Element, *kinds: str) -> set[str | None]:
    """What a package depends on in one of these ways; <depend> is all of them."""
    return {element.text for kind in (*kinds, "depend") for element in package.iter(kind)}


def declared_parameters() -> dict[str, object]:
    """The names in the table in ctr_pvs_ros/parameters.py, and their defaults."""
    tree = ast.parse((ROOT / "ctr_pvs_ros" / "parameters.py").read_text(encoding="utf-8"))
    table = next(
        node.value
        for node in tree.body
        if isinstance(node, ast.AnnAssign) and ast.unparse(node.target) == "PARAMETERS" and node.value is not None
    )
    rules = zip(table.keys, table.values, strict=True)
    return {ast.literal_eval(key): ast.literal_eval(rule.args[0]) for key, rule in rules}


def test_every_entry_point_exists():
    for target in entry_points().values():
        module, function = target.split(":")
        tree = ast.parse((ROOT / Path(*module.split("."))).with_suffix(".py").read_text(encoding="utf-8"))
        assert function in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


def test_the_launch_file_starts_the_node_with_declared_parameters_only():
    launch = ET.parse(LAUNCH).getroot()
    (node,) = launch.iter("node")
    assert node.get("pkg") == "ctr_pvs"
    assert node.get("exec") in entry_points()
    assert node.get("name") == "ctr_equilibrium"
    names = {element.get("name") for element in launch.iter("param")}
    assert names - {None} <= set(declared_parameters()) | {"use_sim_time"}


def test_every_launch_argument_is_used_and_described():
    text = LAUNCH.read_text(encoding="utf-8")
    arguments = list(ET.fromstring(text).iter("arg"))
    assert {argument.get("name") for argument in arguments} >= {
        "robot_file",
        "namespace",
        "params_file",
        "use_sim_time",
        "initial_command",
    }
    for argument in arguments:
        assert f"$(var {argument.get('name')})" in text
        assert argument.get("description")


def test_files_that_the_launch_file_names_are_installed():
    installed = ast.unparse(setup_arguments()["data_files"])
    for argument in ET.parse(LAUNCH).getroot().iter("arg"):
        default = argument.get("default", "")
        if default.startswith("$(find-pkg-share ctr_pvs)/"):
            folder, _, name = default.partition(")/")[2].rpartition("/")
            assert (ROOT / folder / name).is_file()
            assert f"glob('{folder}/*{Path(name).suffix}')" in installed


def test_the_parameter_file_shows_every_parameter_and_sets_none():
    """A value in it would stand where the command line gives one of a wrong type."""
    text = (ROOT / "config" / "equilibrium_node.yaml").read_text(encoding="utf-8")
    assert yaml.safe_load(text) == {"/**": {"ros__parameters": {"use_sim_time": False}}}
    shown = yaml.safe_load(re.sub(r"^    # (?=\w+:)", "    ", text, flags=re.MULTILINE))["/**"]["ros__parameters"]
    defaults = declared_parameters()
    assert set(shown) == set(defaults) | {"use_sim_time"}
    for name, value in shown.items():
        if name not in WITHOUT_DEFAULT | {"use_sim_time"}:
            assert value == defaults[name], name


def test_what_the_interfaces_need_is_needed_by_the_package_that_builds_them():
    package, interfaces = package_description(ROOT), package_description(ROOT / "ctr_pvs_interfaces")
    for kind in ("buildtool_depend", "build_depend", "exec_depend"):
        assert needed(interfaces, kind) <= needed(package, kind)
    for other in (package, interfaces):
        assert other.findtext("member_of_group") == "rosidl_interface_packages"
        assert other.findtext("export/build_type") == "ament_cmake"
        names = {element.text for element in other.iter() if element.tag.endswith("depend")}
        assert not names & OWN  # neither colcon nor rosdep would find them
    assert package.findtext("version") == interfaces.findtext("version")


def test_package_xml_names_every_ros_package_that_is_imported():
    named = needed(package_description(ROOT), "exec_depend")
    imported = set()
    for path in (ROOT / "ctr_pvs_ros").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and node.module:
                imported.add(node.module.split(".")[0])
    ros = {
        name for name in imported if name.endswith(("_msgs", "_interfaces")) or name in ("rclpy", "ament_index_python")
    }
    assert "rclpy" in ros
    assert ros - OWN <= named


def test_every_folder_of_python_modules_is_installed():
    found = setup_arguments()["packages"]
    assert ast.unparse(found.func) == "find_packages"
    (include,) = (ast.literal_eval(keyword.value) for keyword in found.keywords if keyword.arg == "include")
    packages = set(find_packages(str(ROOT), include=include))
    folders = (path.parent for top in ("ctr_pvs", "ctr_pvs_ros") for path in (ROOT / top).rglob("__init__.py"))
    assert packages == {".".join(folder.relative_to(ROOT).parts) for folder in folders}


def test_numba_comes_with_pip_from_one_version_on_and_rosdep_does_not_ask_for_it():
    tree = ast.parse((ROOT / "ctr_pvs" / "kernel" / "compiler" / "switch.py").read_text(encoding="utf-8"))
    (minimum,) = (
        ast.literal_eval(node.value)
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "MINIMUM"
    )
    required = f"numba>={minimum[0]}.{minimum[1]}"
    assert required in ast.literal_eval(setup_arguments()["install_requires"])
    assert required in (ROOT / "scripts" / "requirements-compiler.txt").read_text(encoding="utf-8").splitlines()
    assert "numba" not in (ROOT / "package.xml").read_text(encoding="utf-8")
