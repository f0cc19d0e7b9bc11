"""ctr-pvs plot: one equilibrium as a picture."""

from __future__ import annotations

import argparse
from typing import Any

from ctr_pvs.cli.command import declare_command
from ctr_pvs.cli.command import declare_robot
from ctr_pvs.cli.command import exit_code
from ctr_pvs.cli.seeing.words import cannot_write
from ctr_pvs.cli.seeing.words import declare_output
from ctr_pvs.cli.seeing.words import solved
from ctr_pvs.cli.words import UsageError


def declare_plot(subcommands: argparse._SubParsersAction[Any]) -> None:
    """Adds the sub-command."""
    plot = subcommands.add_parser(
        "plot",
        allow_abbrev=False,
        help="one equilibrium as a picture: shape, twist, curvature, moments",
        description="Solves for one equilibrium, as solve does, and draws it: three projections with the tubes in "
        "their diameters, twist, curvature and moments along the robot, and what acts (PNG and SVG need "
        "matplotlib); or, as HTML, a page that turns under the mouse and needs nothing but a browser.",
    )
    declare_robot(plot)
    declare_command(plot)
    declare_output(plot, "--output", (".png", ".svg", ".html"), required=True, help="picture: .png, .svg or .html")
    plot.set_defaults(run=_plot)


def _plot(arguments: argparse.Namespace) -> int:
    robot, equilibrium = solved(arguments)

    from ctr_pvs.cli.seeing.drawn import drawn
    from ctr_pvs.cli.seeing.page import save_page
    from ctr_pvs.cli.seeing.plot_figure import save_plot
    from ctr_pvs.renda2021.figures import PictureError

    if not equilibrium.success:
        print(f"{robot.name}: {equilibrium.status.value}: {equilibrium.message}; nothing is drawn")
        return exit_code(equilibrium)
    save = save_page if arguments.output.suffix.lower() == ".html" else save_plot
    try:
        save(drawn(robot, equilibrium), arguments.output)
    except PictureError as error:
        raise UsageError(str(error)) from error
    except OSError as error:
        raise cannot_write("--output", error) from error
    print(arguments.output)
    return exit_code(equilibrium)
