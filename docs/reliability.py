"""Write docs/reliability.md from docs/reliability.toml and the names of tests; --check only looks.

A test shows the rows with which its name begins: `test_B7_T5_servos_stop` shows B7 and T5.
"""

import re
import sys
import tomllib
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parent
PAGE = ROOT / "reliability.md"
HEAD = """\
# Reliability

What breaks, what must happen then, what happened, and which test shows it. Nothing here was measured on a real servo
or board: the faults are injected into the bytes of the [twin](hardware.md), or into invented time. A row without a
test is not shown yet. This page is generated: `python docs/reliability.py`.

| row | fault | required | measured | tests |
|---|---|---|---|---|
"""
_TEST = re.compile(r"^(?:def )?test_((?:[LESTB]\d+_)+)", re.MULTILINE)


def shown() -> dict[str, dict[str, int]]:
    """How many tests of which file show a row."""
    found: dict[str, dict[str, int]] = defaultdict(lambda: defaultdict(int))
    for path in sorted((ROOT.parent / "tests").glob("test_*.py")):
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
    lines = []
    for name, row in rows.items():
        files = ", ".join(f"`{file}` ({count})" for file, count in tests[name].items())
        measured = row.get("measured", "-") if files else "-"
        lines.append(
            f"| {name} | {row['fault']} | {row['required']} | {measured} | {files or '-'} |"
        )
    return HEAD + "\n".join(lines) + "\n"


def main() -> None:
    """Write the page, or check it."""
    text = page()
    if "--check" not in sys.argv:
        PAGE.write_text(text)
    elif PAGE.read_text() != text:
        sys.exit("docs/reliability.md: expected what docs/reliability.py writes; run it")


if __name__ == "__main__":
    main()
