"""Pages of the docs as scripts: their blocks, and a shell in which they run as they stand.

A block of `sh` is run, one of `python` too, each by itself; any other block with a title is a file.
What stands in `in a terminal of its own` goes on running, and the ports that it prints stand for
those of the page. Each line of a `text` block was said by the commands before it, with `…` for what
may differ. Blocks of other kinds, as of `bash`, are for readers alone.
"""

from __future__ import annotations

import atexit
import functools
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from first_hour import Command, OrderedTwin

DOCS = Path(__file__).parents[1] / "docs"
_OWN_TERMINAL = "in a terminal of its own"
_FENCE = re.compile(r'^```(\w+)(?: title="(.*?)")?\n(.*?)^```$', re.MULTILINE | re.DOTALL)
_SHELL = """\
uv() { shift; while [[ $1 == --* ]]; do shift 2; done; "$@"; }
antennate() { "$PYTHON" -W error -m antennate "$@"; }
python() { "$PYTHON" -W error "$@"; }
"""
_PATIENCE = 300.0
"""Longest that a block may take [s]; the machine may be busy."""


@functools.cache
def made_pages() -> dict[str, Path]:
    """The pages of the site that are not in git, by name, made anew."""
    folder = Path(tempfile.mkdtemp())
    atexit.register(shutil.rmtree, folder)
    words = [sys.executable, "-W", "error", str(DOCS / "pages.py"), str(folder)]
    subprocess.run(words, check=True)
    return {path.name: path for path in folder.iterdir()}


class Block(NamedTuple):
    """A block of code.

    Attributes:
        kind: Its language.
        title: Its title, empty without one.
        text: What it holds.
    """

    kind: str
    title: str
    text: str

    @property
    def words(self) -> list[list[str]]:
        """Words of each of its commands behind `uv run antennate`; none for other commands."""
        shell = self.kind in ("sh", "bash")
        lines = self.text.replace("\\\n", " ").splitlines() if shell else []
        found = [shlex.split(line, comments=True) for line in lines]
        return [words[3:] for words in found if words[:3] == ["uv", "run", "antennate"]]


def blocks(page: str) -> list[Block]:
    """The blocks of a page of the docs, in order."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return [Block(*parts) for parts in _FENCE.findall(text)]


def commands(page: str, begin: str = "") -> Iterator[list[str]]:
    """Words of each command of a page behind `uv run antennate`, in order, from a heading on."""
    text = (DOCS / page).read_text(encoding="utf-8")
    for parts in _FENCE.findall(text.partition(begin)[2] if begin else text):
        yield from Block(*parts).words


class Script:
    """A page on its way through an empty folder; as a context it ends what it has started.

    Args:
        page: The page.
        folder: Where it runs.
        acts: What a person does beside a command, by the command's name.
        patience: Longest that a block may take [s].

    Attributes:
        said: What all commands have said so far, spaces made one.
        twin: What runs in a terminal of its own.
    """

    def __init__(
        self,
        page: str,
        folder: Path,
        acts: Mapping[str, Callable[[Command, Script], None]],
        patience: float = _PATIENCE,
    ) -> None:
        self.blocks = blocks(page)
        self.said = ""
        self.twin: OrderedTwin | None = None
        self._folder, self._acts, self._patience = folder, acts, patience

    def run(self) -> None:
        """Go through all blocks."""
        for block in self.blocks:
            self._take(Block(block.kind, block.title, self._here(block.text)))

    def _take(self, block: Block) -> None:
        words = block.words
        if block.kind == "text":
            self._compare(block.text)
        elif block.title == _OWN_TERMINAL:
            self.twin = OrderedTwin(words[0], self._folder)
        elif block.kind == "sh" and words and words[0][0] in self._acts:
            command = Command(words[0], self._folder)
            self._acts[words[0][0]](command, self)
            assert command.end() == 0, command.text
            self._note_output(command.output + command.text)
        elif block.kind == "sh":
            self._carry_out(["bash", "-euc", _SHELL + block.text])
        elif block.title:
            (self._folder / block.title).write_text(block.text, encoding="utf-8")
        elif block.kind == "python":
            self._carry_out([sys.executable, "-W", "error", "-c", block.text])

    def _here(self, text: str) -> str:
        """A text with the ports that there are."""
        paths = self.twin.paths if self.twin else {}
        ours = {"/dev/pts/1": "esp32", "/dev/pts/2": "bus"}
        return re.sub("|".join(ours), lambda m: paths.get(ours[m[0]], m[0]), text)

    def _carry_out(self, words: list[str]) -> None:
        own = {"PYTHON": sys.executable, "COLUMNS": "100", "MPLBACKEND": "Agg"}
        done = subprocess.run(
            words,
            capture_output=True,
            text=True,
            timeout=self._patience,
            cwd=self._folder,
            env=os.environ | own,
        )
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
        self._note_output(done.stdout + done.stderr)

    def _note_output(self, text: str) -> None:
        self.said += " ".join(text.split()) + " "

    def _compare(self, text: str) -> None:
        for line in filter(None, (" ".join(line.split()) for line in text.splitlines())):
            wanted = ".*".join(map(re.escape, line.split("…")))
            assert re.search(wanted, self.said), f"{line!r} was never said: {self.said[-3000:]}"

    def __enter__(self) -> Script:
        return self

    def __exit__(self, *_: object) -> None:
        if self.twin is not None:
            self.twin.__exit__(None, None, None)
