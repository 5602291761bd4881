"""Compare two folders of results value by value: `python benchmarks/same_numbers.py OLD NEW`.

Each is a run directory, or holds some at any depth, as those of `golden.py` do. Not one bit may
differ: cells of tables are compared as text. Columns of `trials.csv` may be renamed or added, and
the new run may have fewer trials. Every number of the old `result.json` must be in the new one; its
keys may be renamed. Other tables, and bytes, are compared as they are. Ends with 1 if anything
differs or is missing.
"""

import csv
import json
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

RENAMED = {
    "arm": ("controller", "profile"),
    "fate": ("outcome",),
    "fate_after_start": ("outcome_after_start",),
    "status": ("outcome",),
}
KEYS = (
    "point",
    "part",
    "cell",
    "scene",
    "arm",
    "controller",
    "kind",
    "wall",
    "speed_m_s",
    "profile",
    "condition",
    "trial",
    "side",
)
VERSIONED = ("schema",)
SHOWN = 10


def table(path: Path) -> list[dict[str, str]]:
    """The rows of a CSV file."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def differing_rows(old: list[dict[str, str]], new: list[dict[str, str]]) -> tuple[int, list[str]]:
    """Number of values compared, and a line for each that differs."""
    lines = list[str]()
    names = dict[str, str]()
    for column in old[0]:
        found = [n for n in (column, *RENAMED.get(column, ())) if n in new[0]]
        if found:
            names[column] = found[0]
        else:
            lines.append(f"column {column} is missing, new columns: {', '.join(new[0])}")
    keys = [k for k in KEYS if k in names]
    by_key = {tuple(row[k] for k in keys): row for row in old}
    if len(by_key) < len(old):
        lines.append(f"{len(old)} rows have {len(by_key)} different values of {', '.join(keys)}")
    count = 0
    for row in new:
        key = tuple(row[names[k]] for k in keys)
        if key not in by_key:
            lines.append(f"{key}: not in the old run")
            continue
        for column, name in names.items():
            count += 1
            if by_key[key][column] != row[name]:
                lines.append(f"{key} {column}: {by_key[key][column]} -> {row[name]}")
    return count, lines


def numbers(value: object) -> Iterator[float]:
    """All numbers of a JSON value but versions of its schema."""
    if isinstance(value, dict):
        for key, item in value.items():
            if key not in VERSIONED:
                yield from numbers(item)
    elif isinstance(value, list):
        for item in value:
            yield from numbers(item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value


def compare(old: Path, new: Path) -> bool:
    """Compare two run directories, print, and say whether they are the same."""
    count, lines, fewer = 0, list[str](), False
    if (old / "trials.csv").exists():
        before, after = table(old / "trials.csv"), table(new / "trials.csv")
        fewer = len(after) < len(before)
        count, lines = differing_rows(before, after)
    if not fewer:
        known = list(numbers(json.loads((old / "result.json").read_text())))
        missing = Counter(known) - Counter(numbers(json.loads((new / "result.json").read_text())))
        count += len(known)
        lines += [f"result.json: {value} is missing {n} times" for value, n in missing.items()]
    for line in lines[:SHOWN]:
        print(line)
    print(f"{old} and {new}: {count} values compared, {len(lines)} differ")
    return not lines


def same_file(old: Path, new: Path) -> bool:
    """Compare two files byte by byte, print, and say whether they are the same."""
    first, second = old.read_bytes(), new.read_bytes()
    if first == second:
        print(f"{old} and {new}: {len(first)} bytes compared, none differs")
        return True
    at = next(
        (i for i, (a, b) in enumerate(zip(first, second, strict=False)) if a != b),
        min(len(first), len(second)),
    )
    print(f"{old} and {new}: {len(first)} and {len(second)} bytes, the first differs at {at}")
    return False


def main(old: Path, new: Path) -> int:
    """Compare all that lies in two folders and return the exit code."""
    runs = sorted(path.parent for path in old.rglob("result.json"))
    files = sorted(
        path
        for kind in ("*.csv", "*.bytes")
        for path in old.rglob(kind)
        if path.name != "trials.csv"
    )
    if not runs and not files:
        sys.exit(f"expected result.json, tables or bytes in {old}, found none")
    same = True
    for path in (*runs, *files):
        other = new / path.relative_to(old)
        if not other.exists() or (path.is_dir() and not (other / "result.json").exists()):
            print(f"{other}: missing")
            same = False
        else:
            same &= compare(path, other) if path.is_dir() else same_file(path, other)
    return int(not same)


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("expected two folders: OLD NEW")
    sys.exit(main(Path(sys.argv[1]), Path(sys.argv[2])))
