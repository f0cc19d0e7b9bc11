"""Installs the solver, the node's Python code, and the files under share/ctr_pvs, for pip.

colcon does not come here (see CMakeLists.txt): it also builds the messages, without which the node does not run.
"""

import xml.etree.ElementTree as ET
from glob import glob
from pathlib import Path

from setuptools import find_packages
from setuptools import setup

PACKAGE = "ctr_pvs"
HERE = Path(__file__).parent

setup(
    name=PACKAGE,
    version=ET.parse(HERE / "package.xml").findtext("version"),
    description="Equilibrium solver for concentric tube robots, and the ROS 2 node that serves it",
    long_description=(HERE / "README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    maintainer="ctr_pvs maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=["ctr_pvs", "ctr_pvs.*", "ctr_pvs_ros", "ctr_pvs_ros.*"]),
    data_files=[
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", sorted(glob("launch/*.xml"))),
        (f"share/{PACKAGE}/config", sorted(glob("config/*.yaml") + glob("config/*.rviz") + glob("config/*.json"))),
        (f"share/{PACKAGE}/data", ["test/data/reference_values.json"]),
    ],
    # Numba is not in package.xml: some releases of Ubuntu have no package of it, and the solver runs without, slower.
    install_requires=["numpy>=1.26", "scipy>=1.11", "pyyaml>=6", "numba>=0.59"],
    extras_require={
        "test": ["pytest"],
        "plot": ["matplotlib>=3.8"],
        "view": ["viser>=1.0"],
        "cluster": ["distributed>=2024.5"],
    },
)
