"""What the scripts that write a page share: write it, or with --check only compare it."""

import re
import sys
from html import escape
from pathlib import Path

_BAR = re.compile(r"`([^`]*\|[^`]*)`|\|")


def finish(script: str, page: str, name: str | None = None) -> None:
    """Write the page beside a script, of the same name or another; with --check only look.

    Raises:
        SystemExit: The page is not what the script would write.
    """
    path = Path(script).with_name(name or f"{Path(script).stem}.md")
    if "--check" not in sys.argv[1:]:
        path.write_text(page, encoding="utf-8")
    elif not path.exists() or path.read_text(encoding="utf-8") != page:
        sys.exit(f"docs/{path.name} is out of date: run `python docs/{Path(script).name}`")


def row(*cells: object) -> str:
    """A row of a table in Markdown."""
    return "| " + " | ".join(_BAR.sub(_without_bar, str(cell)) for cell in cells) + " |"


def _without_bar(found: re.Match[str]) -> str:
    """Code, or a bar alone, without a character that would end the cell."""
    code = found[1]
    if code is None:
        return "&#124;"
    return f"<code>{escape(code, quote=False).replace('|', '&#124;')}</code>"


def heads(*names: str) -> str:
    """The first two lines of a table."""
    return row(*names) + "\n" + "|" + "---|" * len(names)
