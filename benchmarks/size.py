"""How large the program is: `python benchmarks/size.py [FOLDER]`, by package.

Lines, and lines of code: those that hold a token of Python other than a docstring, a comment or
part of an import. FOLDER is that of a package, `packages/antennate/src/antennate` unless given.
"""

from __future__ import annotations

import ast
import sys
import tokenize
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
_BLANK = {
    tokenize.COMMENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
    tokenize.INDENT,
    tokenize.NEWLINE,
    tokenize.NL,
}


def code_lines(path: Path) -> int:
    """Lines of code of one file."""
    lines = set[int]()
    with path.open("rb") as file:
        for token in tokenize.tokenize(file.readline):
            if token.type not in _BLANK:
                lines.update(range(token.start[0], token.end[0] + 1))
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import | ast.ImportFrom) or (
            isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ):
            lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    return len(lines)


def main(package: Path) -> None:
    """Print a line for each part, and all of them together."""
    files, lines, code = Counter[str](), Counter[str](), Counter[str]()
    for path in sorted(package.rglob("*.py")):
        parts = path.relative_to(package).parts
        for name in (parts[0] if len(parts) > 1 else "(top)", "all"):
            files[name] += 1
            lines[name] += path.read_text().count("\n")
            code[name] += code_lines(path)
    print(f"{'':14}{'files':>7}{'lines':>9}{'code':>9}")
    for name in sorted(files, key=lambda name: (name == "all", name)):
        print(f"{name:14}{files[name]:7}{lines[name]:9}{code[name]:9}")


if __name__ == "__main__":
    own = ROOT / "packages" / "antennate" / "src" / "antennate"
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else own)
