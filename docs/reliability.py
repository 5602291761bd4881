"""Write docs/reliability.md from docs/reliability.toml and the names of tests.

A test shows the rows with which its name begins: `test_B7_T5_servos_stop` shows B7 and T5.
"""

import re
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

from generated import finish

ROOT = Path(__file__).parent
HEAD = """\
# Reliability

What breaks, what must happen then, what happened, and which test shows it. Nothing here was
measured on a real servo or board: faults are injected into the bytes of the [twin](twin.md), or
into invented time. A row without a test is not shown yet. `tests/test_guards.py` lists every guard
between bytes and motion, switches each off alone, and sees a test fail. The last column counts the
tests that have the row in their name; `grep -rnE 'test_(\\w+_)?L1_' tests packages` finds those of
L1. The column `measured` is written by hand from their runs and those of `benchmarks/`.

{count}

| row | fault | required | measured | tests |
|---|---|---|---|---|
"""
FOLDERS = (ROOT.parent / "tests", *ROOT.parent.glob("packages/*/tests"))
_TEST = re.compile(r"^(?:def )?test_((?:[LESTBGKMWX]\d+_)+)", re.MULTILINE)


def shown() -> dict[str, dict[str, int]]:
    """How many tests of which file show a row."""
    found: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for path in [p for tests in FOLDERS for p in sorted(tests.glob("test_*.py"))]:
        for match in _TEST.finditer(path.read_text()):
            for row in match[1].strip("_").split("_"):
                found[row][path.name] += 1
    return found


def page() -> str:
    """Return the content of the page.

    Raises:
        SystemExit: A test names a row that the table lacks.
    """
    rows, tests = tomllib.loads((ROOT / "reliability.toml").read_text()), shown()
    if unknown := sorted(set(tests) - set(rows)):
        sys.exit(f"docs/reliability.toml: expected rows {', '.join(unknown)}, which tests name")
    lines, tested, unmet = list[str](), 0, 0
    for name, row in rows.items():
        count = sum(tests[name].values())
        measured = row.get("measured", "-") if count else "-"
        tested += bool(count)
        unmet += "not met: " in measured
        lines.append(
            f"| {name} | {row['fault']} | {row['required']} | {measured} | {count or '-'} |"
        )
    count = f"{len(rows)} rows, {tested} with tests, {unmet} not met in full (`not met` says what)."
    return HEAD.format(count=count) + "\n".join(lines) + "\n"


def main() -> None:
    """Write the page, or check it."""
    finish(__file__, page(), source="`docs/reliability.toml`")


if __name__ == "__main__":
    main()
