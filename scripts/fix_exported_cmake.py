"""Make the CMake files of the installed ROS wheels usable on this machine.

The wheels export the include folders of the interpreter and the numpy they were built with
(/opt/python/<build>/include/python3.x and .../numpy/_core/include). CMake refuses targets whose include folders do not
exist, so both are rewritten to those of the running interpreter. Run it with the Python of the environment to mend.
"""

import re
import sys
import sysconfig
from pathlib import Path

import numpy

BUILDER_NUMPY = re.compile(r"/opt/python/[^;\"\s]*/numpy/(?:_core|core)/include")
BUILDER_PYTHON = re.compile(r"/opt/python/[^;\"\s]*/include/python3\.\d+")


def mend(text: str) -> str:
    """Return a CMake file's text with the builder's include folders replaced by this environment's."""
    text = BUILDER_NUMPY.sub(numpy.get_include(), text)
    return BUILDER_PYTHON.sub(sysconfig.get_path("include"), text)


def main() -> None:
    """Mend every exported CMake file under the environment's share folder."""
    for path in Path(sys.prefix, "share").rglob("*.cmake"):
        text = path.read_text(encoding="utf-8")
        mended = mend(text)
        if mended != text:
            path.write_text(mended, encoding="utf-8")


if __name__ == "__main__":
    main()
