"""The option --version. The version stands in package.xml, where ROS reads it; setup.py takes it from there, too."""

from __future__ import annotations

import argparse
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from ctr_pvs.robot.shipped import shipped_folder


def version() -> str:
    """The version of the package whose code this is."""
    folder = shipped_folder()
    found = None if folder is None else ET.parse(folder / "package.xml").findtext("version")
    return found or "of unknown version (its package.xml is not there)"


class ShowVersion(argparse.Action):
    """Looks the version up only when somebody asks."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[str] | None,
        option_string: str | None = None,
    ) -> None:
        print("ctr_pvs", version())
        parser.exit()


def declare_version(parser: argparse.ArgumentParser) -> None:
    """Adds the option."""
    parser.add_argument("--version", action=ShowVersion, nargs=0, help="show the version and exit")
