"""Tables of motion capture: markers or poses over time, as their files hold them.

Layouts are those of OptiTrack's page "Data Export: CSV", of ASCII files of Vicon Nexus, and of
OpenSim's page "Marker (.trc) Files". A marker that was not seen has empty cells there.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from antennate.csv_files import MISSING, Row, csv_rows, number_of, unit_of, wrong_count
from antennate.errors import BadInputError
from antennate.files import decoded, read_limited
from antennate.messages import shortened
from antennate.types import Floats

_LARGEST = 10**9
"""No file is longer [bytes]."""
_LENGTHS = {"m": 1.0, "meters": 1.0, "cm": 0.01, "centimeters": 0.01, "mm": 0.001}
_UNITS = _LENGTHS | {"millimeters": 0.001, "rad": 1.0, "deg": np.pi / 180, "°": np.pi / 180}
_UNITS |= {"s": 1.0, "seconds": 1.0, "ms": 1e-3}
_COLUMN = re.compile(r"(?:(.+)[ _.:-])?(t|time|timestamp|frame|x|y|z|q[wxyz]|heading|yaw)", re.I)
_CALLED = {"t": "time", "timestamp": "time", "yaw": "heading"}
_NEEDED = (
    "a column time, and columns of a pose (x, y, and heading or qw, qx, qy, qz) or of markers "
    "(NAME_x, NAME_y)"
)
Columns = dict[tuple[str, str], Floats]
"""Numbers by the name of a marker or body, empty for the only one, and by `x`, `qw` and so on."""
Layout = tuple[Sequence[str], Iterable[Row], str, float]
"""Labels of the columns, rows of numbers, unit of lengths, and frames a second, 0 if unknown."""


def read(path: Path, unit: float | None) -> tuple[Floats, Columns]:
    """Times [s], rising, shape (n,), and columns of a table in SI, NaN where a cell is empty.

    Args:
        path: The file, CSV or TRC.
        unit: Length of the table's unit [m]; None for what it says, else 1.

    Raises:
        BadInputError: It is no such table, or damaged.
    """
    if path.suffix.lower() == ".c3d":
        raise BadInputError(f"{path}: expected CSV or TRC, found C3D: export it as TRC")
    labels, rows, length, rate = _layout(path, read_limited(path, _LARGEST))
    places, scales = dict[tuple[str, str], int](), list[float]()
    for place, label in enumerate(labels):
        said = unit_of(label, _UNITS)
        found = _COLUMN.fullmatch(
            re.sub(r"[\[(].*", "", label).strip(" \"'").removesuffix(f"_{said}")
        )
        if found is None:
            continue
        word = found[2].lower()
        of_length = word in ("x", "y", "z")
        said = said.lower() or (length if of_length else "s")
        if said not in _UNITS:
            raise BadInputError(f"{path}: expected a unit of {', '.join(_UNITS)}, found {said}")
        places[found[1] or "", _CALLED.get(word, word)] = place
        scales.append(unit if unit and of_length else _UNITS[said])
    numbers = [_numbers(path, line, labels, cells, places.values()) for line, cells in rows]
    values = np.array(numbers).reshape(len(numbers), len(places)) * scales
    columns = dict(zip(places, values.T, strict=True))
    if rate and ("", "time") not in columns:
        columns["", "time"] = columns["", "frame"] / rate
    if ("", "time") not in columns or not any(word == "y" for _, word in columns):
        raise BadInputError(f"{path}: expected {_NEEDED}, found {shortened(', '.join(labels))}")
    t = columns["", "time"]
    if len(t) < 2 or not (np.diff(t) > 0).all():
        raise BadInputError(f"{path}: expected rows of rising times, found others")
    return t, columns


def _layout(path: Path, data: bytes) -> Layout:
    """What stands where, by what the file begins with."""
    text = decoded(path, data)
    mark = "\t" if text.startswith("PathFileType") else ","
    lines = [cells or [""] for cells in csv.reader(io.StringIO(text, newline=None), delimiter=mark)]
    begins = [cells[0].strip() for cells in lines]
    try:
        if begins[:1] == ["PathFileType"]:
            unit = dict(zip(lines[1], lines[2], strict=False))["Units"]
            labels = _labels(lines[3], lines[4])
            return labels, _padded(lines, 5, len(labels)), unit.strip().lower(), 0.0
        if begins[:1] == ["Format Version"]:
            return _motive(lines, begins.index("Frame"))
        if "Trajectories" in begins:
            first = begins.index("Trajectories")
            rate, names, axes, units = lines[first + 1 : first + 5]
            labels = _labels(names, axes)
            return labels, _padded(lines, first + 5, len(labels)), units[2].strip(), float(rate[0])
    except (LookupError, ValueError) as error:
        raise BadInputError(f"{path}: expected the header of {begins[0]}, found: {error}") from None
    rows = csv_rows(path, data, (), BadInputError, ended=True)
    return next(rows)[1], rows, "m", 0.0


def _motive(lines: Sequence[list[str]], axes: int) -> Layout:
    """OptiTrack Motive: rows of names and of kinds above that of the axes."""
    said = dict(zip(lines[0][::2], lines[0][1::2], strict=False))
    names = next((row for row in lines[:axes] if row[1:2] == ["Name"]), lines[3])
    kinds = {"Position": "", "Rotation": "q"}
    labels = [
        f"{name} {kinds[kind]}{axis}" if kind in kinds else ""
        for name, kind, axis in zip(names, lines[axes - 1], lines[axes], strict=False)
    ]
    labels[:2] = "frame", "time"
    unit = said.get("Length Units", "meters").lower()
    return labels, _padded(lines, axes + 1, len(labels)), unit, 0.0


def _labels(names: Sequence[str], axes: Sequence[str]) -> Sequence[str]:
    """Labels of columns where the names of markers stand above the first of their axes."""
    labels, name = ["frame", "time" if "Time" in names[:2] else ""], ""
    for place, axis in enumerate(axes[2:], 2):
        name = "".join(names[place : place + 1]).strip() or name
        labels.append(f"{name} {axis.strip()[:1]}")
    return labels


def _padded(lines: Sequence[list[str]], first: int, width: int) -> Iterable[Row]:
    """Rows of numbers from a line on to an empty one, as wide as the labels."""
    for number, cells in enumerate(lines[first:], first + 1):
        if any(cells):
            yield number, [*cells, *[""] * (width - len(cells))][:width]
        elif number > first + 1:  # one may stand below the header
            return


def _numbers(
    path: Path, line: int, labels: Sequence[str], cells: Sequence[str], places: Iterable[int]
) -> list[float]:
    """Numbers of a row, NaN for a cell without one."""
    if why := wrong_count(labels, cells, "; are there decimal commas? write points"):
        raise BadInputError(f"{path}: row {line}: {why}")
    numbers = [number_of(cells[place]) for place in places]
    for place, number in zip(places, numbers, strict=True):
        if np.isnan(number) and cells[place].strip().lower() not in MISSING:
            raise BadInputError(
                f"{path}: row {line}: expected a number, found {shortened(cells[place])}"
            )
    return numbers
