"""CSV files that people bring: with commas, points as decimal marks, and names of columns first."""

from __future__ import annotations

import csv
import io
import itertools
import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from antennate.errors import BadInputError
from antennate.files import decoded
from antennate.messages import shortened

_SEPARATORS = {";": "semicolons", "\t": "tabs", "|": "bars", " ": "spaces"}
"""What may stand between columns in place of commas."""
_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+\s*")
_THOUSANDS = re.compile(r"\s*[+-]?\d{1,3}([,.' ])\d{3}(?:\1\d{3})*(?:[.,]\d*)?\s*")
_UNIT = re.compile(r"[\[(]([^\])]*)[\])]\s*[\"']?\s*$")
"""A unit in brackets at the end of a column's name."""
_SEPARATOR_LINE = re.compile(r"\s*\"?sep=.\"?,*\s*", re.IGNORECASE)
"""First line of a file that tells a spreadsheet what stands between columns."""
_SAMPLE = 100
"""Rows by which the number of cells is compared with that of names."""
MISSING = ("", "nan", "na", "n/a", "#n/a", "null", "none")
"""What stands for no value, in small letters: R writes NA, spreadsheets #N/A."""
LARGEST_WHOLE = 2.0**53
"""Beyond it a number of a file does not tell a whole number from the next one."""
Row = tuple[int, list[str]]
"""Number of the line in which a row ends, and its cells."""


def csv_rows(
    path: Path,
    data: bytes,
    needed: Sequence[str],
    error: type[BadInputError],
    cure: str = "",
    ended: bool = False,
) -> Iterator[Row]:
    """The rows of a file that are not empty, the names of the columns first; any line ends.

    A line `sep=,` before them is skipped. A column without a name is called `column 3` by its
    place, so are cells beyond the last name.

    Args:
        path: The file, for messages.
        data: Its content.
        needed: Columns that have to be there.
        error: What is raised.
        cure: What is said if a column is missing.
        ended: Whether the last row must end with a line break, or else was cut off.
    """
    if not data:
        names = f" with {', '.join(needed)}" if needed else ""
        raise error(f"{path}: row 1: expected a header{names}, found an empty file")
    try:
        text = decoded(path, data, error)
    except BadInputError as cause:
        raise error(f"{cause}; save it as CSV in UTF-8") from None
    reader = csv.reader(io.StringIO(text, newline=None))
    rows = ((reader.line_num, cells) for cells in reader if cells)
    try:
        line, header = next(rows, (1, []))
        if _SEPARATOR_LINE.fullmatch(",".join(header)):
            line, header = next(rows, (line + 1, []))
        header = [name.strip() for name in header]
        sample = list(itertools.islice(rows, _SAMPLE))
        header = _named(header, [cells for _, cells in sample])
        _check_header(path, line, header, needed, error, cure, sample)
        if ended and not data.endswith((b"\n", b"\r")):
            raise error(
                f"{path}: row {len(data.splitlines())}: expected a line break at its end, found "
                "none (truncated); delete the last row, or add the line break if it is whole"
            )
        yield line, header
        yield from itertools.chain(sample, rows)
    except csv.Error as cause:
        raise error(f"{path}: row {reader.line_num}: expected CSV, found {cause}") from None


def _named(header: list[str], sample: Sequence[list[str]]) -> list[str]:
    """Names of all columns: a place where there is no name, also beyond the last name.

    Rows with more cells than names may as well have decimal commas, or a first column of row names
    (R writes no name above it). So two cells more must come with points somewhere, or be empty.
    """
    usual = Counter(map(len, sample)).most_common(1)[0][0] if sample else 0
    more = [cells[len(header) :] for cells in sample if len(cells) == usual]
    empty = not any(cell.strip() for cells in more for cell in cells)
    pointed = any("." in cell for cells in sample for cell in cells)
    longer = usual if len(header) > 1 and (empty or (usual > len(header) + 1 and pointed)) else 0
    names = header + [""] * (longer - len(header))
    return [name or f"column {place}" for place, name in enumerate(names, 1)]


def column(header: Sequence[str], name: str) -> int | None:
    """Place of a column: its exact name, or the only one that differs in case, quotes or unit.

    `Time [s]`, `"time"` and `TIME` are taken for `time` if no column has that name itself.
    """
    if name in header:
        return header.index(name)
    same = [place for place, cell in enumerate(header) if _plain(cell) == _plain(name)]
    return same[0] if len(same) == 1 else None


def unit_of(cell: str, known: Collection[str]) -> str:
    """The unit that a column's name gives in brackets, as `Time [s]`, or at its end, as `time_s`.

    Args:
        cell: The name.
        known: Units that are looked for at the end, those of a letter or more.
    """
    bracketed = "".join(_UNIT.findall(cell)[-1:]).strip()
    ends = (unit for unit in known if unit.isascii() and not unit.isdigit())
    ends = [unit for unit in ends if cell.rstrip("\"' ").endswith("_" + unit.replace("/", "_"))]
    return bracketed or max(ends, key=len, default="")


def _plain(cell: str) -> str:
    bare = _UNIT.sub("", cell).strip(" \t\"'\ufeff").casefold()
    return re.sub(r"[\s-]+", "_", bare)


def wrong_count(header: Sequence[str], cells: Sequence[str], surplus: str) -> str:
    """What was expected of a row with too many or too few cells and found; empty if it has neither.

    Args:
        header: Names of the columns.
        cells: Cells of the row.
        surplus: What is said of too many cells that hold decimal points.
    """
    if len(cells) == len(header):
        return ""
    why = "; are there decimal commas? write points"
    if len(cells) < len(header):
        why = " (truncated); delete the row"
    elif any("." in cell for cell in cells):
        why = surplus
    return f"expected {len(header)} cells, found {len(cells)}{why}"


def number_of(cell: str) -> float:
    """The number of a cell, NaN if it holds none."""
    try:
        return float(cell)
    except ValueError:
        if _DECIMAL_COMMA.fullmatch(cell):
            raise ValueError("a point as decimal mark") from None
        if _THOUSANDS.fullmatch(cell):
            raise ValueError("a number without marks between thousands") from None
        return float("nan")


def _check_header(
    path: Path,
    row: int,
    header: list[str],
    needed: Sequence[str],
    error: type[BadInputError],
    cure: str,
    sample: Sequence[Row],
) -> None:
    """Refuse a header that lacks a column, or is all one where no single column serves."""
    missing = [name for name in needed if column(header, name) is None]
    if not missing and (needed or len(header) != 1):
        return
    line = ",".join(header)
    mark, other = next(((m, what) for m, what in _SEPARATORS.items() if m in line), ("", ""))
    if "\0" in line:
        why = "UTF-8 text, found a zero byte; save it as CSV in UTF-8"
    elif line.startswith("#"):
        why = f"the names of the columns, found a comment, {shortened(line)}; delete that row"
    elif header and all(map(_is_number, header)):
        wanted = ", ".join(needed)
        why = f"the names of the columns, such as {wanted}, found numbers; add that row"
    elif len(header) == 1 and other:
        why = f"columns separated by commas, and points as decimal marks, found {other}"
        cells = (cell for _, row in sample for cell in ",".join(row).split(mark))
        if any(map(_DECIMAL_COMMA.fullmatch, cells)):
            why += f" and decimal commas; replace commas by points, then {other} by commas"
    elif not missing:
        why = f"the names of several columns, found {shortened(line)}"
    else:
        found = shortened(", ".join(header)) if line else "nothing"
        why = f"a column {missing[0]}, found {found}{cure}"
    raise error(f"{path}: row {row}: expected {why}")


def _is_number(cell: str) -> bool:
    """Whether every part of a cell is a number, whatever stands between them."""
    parts = re.split(r"[;\t| ]+", cell.replace(",", "."))
    try:
        return bool([float(part) for part in parts if part])
    except ValueError:
        return False
