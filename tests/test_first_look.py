"""The executed notebooks in examples: what they show is what their cells give."""

from __future__ import annotations

import ast
import json
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).parents[1] / "examples"
NAMES = ("first_look", "geometry")
RUN_CELLS = """
import ast, contextlib, io, json, sys

shown, names = [], {}
for source in json.load(sys.stdin):
    *first, last = ast.parse(source).body
    value, printed = None, io.StringIO()
    with contextlib.redirect_stdout(printed):
        if not isinstance(last, ast.Expr):
            first.append(last)
        exec(compile(ast.Module(first, []), "cell", "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
    html = value._repr_html_() if hasattr(value, "_repr_html_") else ""
    shown.append([printed.getvalue(), "" if value is None else repr(value), html])
print(json.dumps(shown))
"""
"""Runs cells one after the other; what each prints, and its last value as text and as HTML."""


class Cells(HTMLParser):
    """The cells of all tables of a page, and how many pictures it has."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.texts: list[str] = []
        self.pictures = 0
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.pictures += tag == "img"

    def handle_data(self, data: str) -> None:
        if data.strip():
            self.texts.append(worded(data))


def worded(text: str) -> str:
    """A text with # for each number, as another processor walks other ways; spaces made one."""
    return " ".join(re.sub(r"-?\b\d+(\.\d*)?\b", "#", text).split())


def kept(name: str) -> list[dict[str, Any]]:
    cells = json.loads((FOLDER / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    return [cell for cell in cells if cell["cell_type"] == "code"]


def outputs(cell: dict[str, Any]) -> tuple[str, str, str]:
    """What a cell printed, and its value as text and as HTML."""
    printed, text, page = "", "", ""
    for output in cell["outputs"]:
        assert output["output_type"] in ("stream", "execute_result")
        printed += "".join(output.get("text", ()))
        text += "".join(output.get("data", {}).get("text/plain", ()))
        page += "".join(output.get("data", {}).get("text/html", ()))
    return printed, text, page


@pytest.mark.parametrize(("name", "pictures"), [("first_look", 2), ("geometry", 1)])
def test_a_notebook_is_executed_small_and_says_nothing_of_the_machine(
    name: str, pictures: int
) -> None:
    text = (FOLDER / f"{name}.ipynb").read_text(encoding="utf-8")
    assert len(text) < 300_000
    held = json.loads(text)
    assert [cell["execution_count"] for cell in kept(name)] == [*range(1, len(kept(name)) + 1)]
    assert all(cell["metadata"] == {} for cell in held["cells"])
    assert set(held["metadata"]) == {"kernelspec", "language_info"}
    assert all(any(outputs(cell)) for cell in kept(name))
    without_pictures = re.sub(r"base64,[A-Za-z0-9+/=]+", "", text)
    assert not re.search(
        r"/(home|root|tmp|work|Users)\b|\d\d:\d\d:\d\d|20\d\d-\d\d", without_pictures
    )
    pages = [Cells(outputs(cell)[2]) for cell in kept(name)]
    assert sum(page.pictures for page in pages) == pictures
    ticks = {"level_left", "level_right", "contact_left", "contact_right", "head_x", "head_y"}
    assert name != "first_look" or any(ticks <= set(page.texts) for page in pages)


@pytest.mark.parametrize("name", ["geometry", pytest.param("first_look", marks=pytest.mark.slow)])
@pytest.mark.slow
def test_its_cells_give_what_it_shows(name: str, tmp_path: Path) -> None:
    """In a process of their own; numbers of walks may differ, those of springs may not."""
    sources = ["".join(cell["source"]) for cell in kept(name)]
    assert all(ast.parse(source).body for source in sources)
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", RUN_CELLS],
        input=json.dumps(sources),
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.iterdir()) == []
    for cell, (printed, text, page) in zip(kept(name), json.loads(done.stdout), strict=True):
        before = outputs(cell)
        assert worded(before[0]) == worded(printed)
        if text.startswith("<") or not page:  # the text of a frame depends on the terminal
            assert worded(before[1]) == worded(text)
        assert Cells(before[2]).texts == Cells(page).texts
        assert Cells(before[2]).pictures == Cells(page).pictures
        if "spring_stiffness" in "".join(cell["source"]):
            assert before[1] == text
