"""CSV as other programs write it: taken, or refused in a line that names what it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from antennate.cli import main
from antennate.errors import BadInputError
from antennate.experiments.calibrate.recording import RecordingParams, read
from antennate.studies.run_directory import RunDirectory

ROWS = "".join(f"{i / 100},{1800 - 4 * i},{i / 100}\n" for i in range(100))
GOOD = f"time,counts,bend\n{ROWS}"
NAMES = "expected the names of the columns"
COMMAS = "expected columns separated by commas, and points as decimal marks, found"
BAD = {
    "empty": (b"", "row 1: expected a header with time, counts, bend, found an empty file"),
    "utf-16": (GOOD.encode("utf-16"), "expected UTF-8 text, found byte 0xff at 0; save it as CSV"),
    "utf-16 without a mark": (GOOD.encode("utf-16-le"), "row 1: expected UTF-8 text, found a zero"),
    "matlab": (b"MATLAB 5.0 MAT-file\0\0\1IM\n", "row 1: expected UTF-8 text, found a zero byte"),
    "spreadsheet": (b"PK\3\4\x14\0\6\0\x08\0!\xdd", "expected UTF-8 text, found byte 0xdd at 11"),
    "semicolons": (GOOD.replace(",", ";").encode(), f"row 1: {COMMAS} semicolons"),
    "tabs": (GOOD.replace(",", "\t").encode(), f"row 1: {COMMAS} tabs"),
    "spaces": (GOOD.replace(",", " ").encode(), f"row 1: {COMMAS} spaces"),
    "german": (
        GOOD.replace(",", ";").replace(".", ",").encode(),
        f"row 1: {COMMAS} semicolons",
    ),
    "no names": (ROWS.encode(), f"row 1: {NAMES}, such as time, counts, bend, found numbers"),
    "no names, tabs": (ROWS.replace(",", "\t").encode(), f"row 1: {NAMES}, such as time"),
    "comment": (b"# of today\n" + GOOD.encode(), f"row 1: {NAMES}, found a comment, # of today"),
    "quoted commas": (
        b'time,counts,bend\n"0,00",1800,0\n',
        "row 2: expected a point as decimal mark in time, found '0,00'\n",
    ),
    "thousands": (
        b'time,counts,bend\n0,"1,037.3",0\n',
        "row 2: expected a number without marks between thousands in counts, found '1,037.3'\n",
    ),
    "german thousands": (
        b'time,counts,bend\n0,"1.037,3",0\n',
        "row 2: expected a number without marks between thousands in counts, found '1.037,3'\n",
    ),
    "one reading": (b"time,counts,bend\n0,1800,0\n", "row 2: expected at least 20 readings"),
    "millivolts": (
        GOOD.replace("counts", "counts [mV]").encode(),
        "row 1: expected counts [mV] in counts unless declared, found mV; declare its unit",
    ),
    "bare commas": (
        b"time,counts,bend\n0,00,1800,0,0\n",
        "row 2: expected 3 cells, found 5; are there decimal commas? write points",
    ),
    "a long cell": (
        b"time,counts,bend\n0," + b"9" * 200_000 + b",0\n",
        "row 2: expected CSV, found field larger than field limit",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_named(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content, why = BAD[name]
    file, out = tmp_path / "theirs.csv", tmp_path / "out"
    file.write_bytes(content)
    assert main(["calibrate", "--recording", str(file), "--out", str(out)]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"error: {file}: {why}" in said
    assert not out.exists()


@pytest.mark.parametrize("end", ["\r", "\r\n", "\n\n"])
def test_any_line_end_is_one(end: str, tmp_path: Path) -> None:
    file = tmp_path / "theirs.csv"
    file.write_bytes(GOOD.replace("\n", end).encode())
    found = read(file, RecordingParams())
    assert found.t[:3].tolist() == [0.0, 0.01, 0.02]
    assert found.samples.counts.tolist() == [1800 - 4 * i for i in range(100)]


def test_a_row_without_its_end_is_counted_with_any_line_end(tmp_path: Path) -> None:
    file = tmp_path / "theirs.csv"
    file.write_bytes(GOOD.replace("\n", "\r").encode()[:-2])
    with pytest.raises(BadInputError, match=r"row 101: expected a line break at its end"):
        read(file, RecordingParams())


@pytest.mark.parametrize(
    ("table", "found"),
    [
        ("trial\n1\r2\n", "new-line character"),
        ("trial,seed\n1,2\n3,4,5\n", "3 of 2 cells in row 2"),
        ("trial,seed\n1\n", "1 of 2 cells in row 1"),
        ('trial,reason\n1,"it st', "unexpected end of data"),
    ],
)
def test_a_damaged_table_of_a_run_is_refused(table: str, found: str, tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text("{}")
    (tmp_path / "trials.csv").write_bytes(table.encode())
    with pytest.raises(BadInputError, match=rf"trials\.csv: expected a whole file .*{found}"):
        RunDirectory.open(tmp_path).rows()
