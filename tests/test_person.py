"""What a person types on a terminal or a script writes into a pipe."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest

from antennate.cli import keys
from antennate.cli.keys import TerminalPerson
from antennate.errors import BadInputError


@pytest.fixture
def pipe(monkeypatch: pytest.MonkeyPatch) -> Iterator[int]:
    """The end of a pipe to write to; standard input is the other one."""
    reader, writer = os.pipe()
    with os.fdopen(reader) as stdin:
        monkeypatch.setattr("sys.stdin", stdin)
        yield writer
    os.close(writer)


def test_lines_are_answers_one_by_one(pipe: int) -> None:
    os.write(pipe, b"\n S \nq\nrest")
    asked = TerminalPerson()
    assert [asked.ask("?"), asked.ask("?"), asked.answer(), asked.answer()] == ["", "s", "q", None]


def test_a_pipe_that_stays_silent_is_told(pipe: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(keys, "PATIENCE", 0.05)
    with pytest.raises(BadInputError, match=r"an answer to 'go on\?', found none in 0.05 s"):
        TerminalPerson().ask("go on?")


def test_no_standard_input_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", None)
    with pytest.raises(BadInputError, match="found no standard input"):
        TerminalPerson().ask("go on?")
