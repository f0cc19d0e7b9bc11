"""Rows of words as lines of text, in columns."""

from __future__ import annotations


def aligned(*rows: list[str]) -> list[str]:
    """Lines with columns as wide as their widest cell; the first column left, the others right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.rjust(width) if index else cell.ljust(width)
            for index, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
