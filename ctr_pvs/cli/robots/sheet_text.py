"""The sheet of a robot for people: mm, and tables."""

from __future__ import annotations

from typing import Any

from ctr_pvs.renda2021.columns import aligned

PAIR_NOTE = (
    "Each two tubes by themselves, with all that is straight before their curved parts in the guide. Lambda is how\n"
    "hard they pull at each other (docs/stability.md), - where no one number says it; above the critical they can snap."
)


def sheet_as_text(sheet: dict[str, Any]) -> str:
    """`sheet` as ``sheet.sheet`` makes it."""
    lines = [
        f"{sheet['robot']}: {len(sheet['tubes'])} tubes, outermost first",
        "",
        *_tubes(sheet),
        "",
        *_segments(sheet),
    ]
    if sheet["clearances"]:
        lines += ["", *_clearances(sheet), "", *_pairs(sheet), PAIR_NOTE]
    lines += ["", *_limits(sheet)]
    if sheet["warnings"]:
        lines += ["", *(f"Warning: {warning}" for warning in sheet["warnings"])]
    return "\n".join(lines)


def _tubes(sheet: dict[str, Any]) -> list[str]:
    header = ["tube", "length [mm]", "inside [mm]", "outside [mm]", "curvature [1/m]", "radius [mm]", "strain [%]"]
    rows = []
    for tube in sheet["tubes"]:
        curvature = tube["largest_curvature"]
        rows.append([
            tube["name"],
            _mm(tube["length"]),
            _mm(tube["inner_diameter"]),
            _mm(tube["outer_diameter"]),
            f"{curvature:.4g}",
            _mm(1.0 / curvature) if curvature else "-",
            "?" if tube["largest_strain"] is None else f"{100.0 * tube['largest_strain']:.2f}",
        ])  # fmt: skip
    return [
        *aligned(header, *rows),
        "Curvature is the largest pre-curvature; strain is that of the wall, straightened.",
    ]


def _segments(sheet: dict[str, Any]) -> list[str]:
    header = ["segment", "from [mm]", "to [mm]", "K [N m^2]", "GJ [N m^2]", "GJ/K", "kappa_y [1/m]", "kappa_z [1/m]",
              "turn [rad/m]"]  # fmt: skip
    rows = []
    for tube in sheet["tubes"]:
        for number, segment in enumerate(tube["segments"], start=1):
            bending, torsional = segment["bending_stiffness"], segment["torsional_stiffness"]
            ends = zip(segment["curvature_at_base"], segment["curvature_at_tip"], strict=True)
            stiffnesses = [f"{bending:.4g}", f"{torsional:.4g}", f"{torsional / bending:.3f}"]
            rows.append([
                f"{tube['name']} {number}",
                _mm(segment["from"]),
                _mm(segment["to"]),
                *stiffnesses,
                *(_span(*pair) for pair in ends),
                f"{segment['turn']:g}",
            ])  # fmt: skip
    return aligned(header, *rows)


def _span(first: float, last: float) -> str:
    """A curvature at both ends; once where that is the same."""
    begin, end = f"{first:.4g}", f"{last:.4g}"
    return begin if begin == end else f"{begin} .. {end}"


def _clearances(sheet: dict[str, Any]) -> list[str]:
    return [
        f"Clearance of {gap['inner']} in {gap['outer']}: "
        + (
            "not known, for want of diameters"
            if gap["diametral"] is None
            else f"{_mm(gap['diametral'])} mm in diameter"
        )
        for gap in sheet["clearances"]
    ]


def _pairs(sheet: dict[str, Any]) -> list[str]:
    verdicts = {True: "never snaps", False: "can snap", None: "not known"}
    rows = []
    for pair in sheet["pairs"]:
        known = pair["lambda"] is not None
        numbers = [f"{pair[key]:.4g}" for key in ("lambda", "b", "critical_lambda")] if known else ["-"] * 3
        bases = "-" if pair["D"] is None else " ".join(_mm(D) for D in pair["D"])
        rows.append([f"{pair['outer']}, {pair['inner']}", bases, *numbers, verdicts[pair["snap_free"]]])
    return aligned(["pair", "D [mm]", "lambda", "b", "critical", ""], *rows)


def _limits(sheet: dict[str, Any]) -> list[str]:
    rows = []
    for limits in sheet["limits"]:
        alpha = "any" if limits["alpha"] is None else "{:g} .. {:g}".format(*limits["alpha"])
        rows.append([limits["name"], alpha, " .. ".join(_mm(end) for end in limits["D"])])
    return aligned(["limits", "alpha [rad]", "D [mm]"], *rows)


def _mm(value: float | None) -> str:
    return "?" if value is None else f"{round(1e3 * value, 4):g}"
