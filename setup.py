"""Installs the solver, the node, and the data files that ROS looks for under share/ctr_pvs."""

from glob import glob

from setuptools import find_packages
from setuptools import setup

PACKAGE = "ctr_pvs"

setup(
    name=PACKAGE,
    version="0.1.0",
    description="Equilibrium solver for concentric tube robots, and the ROS 2 node that serves it",
    maintainer="ctr_pvs maintainers",
    maintainer_email="maintainers@users.noreply.github.com",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=["ctr_pvs", "ctr_pvs.*", "ctr_pvs_ros", "ctr_pvs_ros.*"]),
    data_files=[
        (f"share/{PACKAGE}", ["package.xml"]),
        (f"share/{PACKAGE}/launch", sorted(glob("launch/*.xml"))),
        (f"share/{PACKAGE}/config", sorted(glob("config/*.yaml"))),
        (f"share/{PACKAGE}/data", ["test/data/reference_values.json"]),
    ],
    # Numba is not in package.xml: some releases of Ubuntu have no package of it, and the solver runs without, slower.
    install_requires=["numpy>=1.26", "scipy>=1.11", "pyyaml>=6", "numba>=0.59"],
    extras_require={"test": ["pytest"], "demo": ["matplotlib"]},
    zip_safe=True,
)
