"""Options that take several values: one way in all commands, words separated by spaces."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from antennate.cli import commands, described, main
from antennate.cli.arguments import read_words
from antennate.cli.options import Option
from antennate.errors import ConfigError

COMMAS = {"--files", "--recording", "--beside", "--slurm", "--compare", "--shards"}
"""Lists of files, and what SLURM is asked for: a comma may be part of a value."""


def lists() -> Iterator[tuple[str, Option]]:
    for name in sorted(commands()):
        found = described(name)
        yield from ((name, each) for each in [*found.others, *found.parameters] if each.many)


EVERY = list(lists())


def test_every_list_takes_words_and_adds_those_of_a_flag_given_again() -> None:
    assert len(EVERY) > 100
    for name, each in EVERY:
        two = (each.choices * 2)[:2] or ("1", "2")
        first, last = map(str, two)
        values = read_words([each.flag, first, last], [each])
        assert values[each.path] == (each.value(first), each.value(last)), (name, each.flag)
        assert read_words([each.flag, first, each.flag, last], [each]) == values
        assert read_words([f"{each.flag}={first}", last], [each]) == values


def test_no_list_is_one_word_with_commas() -> None:
    for name, each in EVERY:
        words = [each.flag, "a,b"]
        if each.flag in COMMAS:
            assert list(map(str, read_words(words, [each])[each.path])) == ["a,b"], name
        else:
            with pytest.raises(ConfigError, match=f"^{each.flag}: expected .* separated by spaces"):
                read_words(words, [each])


def test_a_name_of_code_may_have_a_comma_in_its_path(
    tmp_path: Path, refused: Callable[..., str]
) -> None:
    assert "a,b.py" in refused("tunnel", "--controllers", f"{tmp_path}/a,b.py:C", "--trials=1")


@pytest.mark.parametrize("how", ["--help", "--help-all"])
def test_the_help_says_how_a_list_is_given(how: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["twin", how]) == 0
    said = capsys.readouterr().out
    assert "A list (...) is words separated by spaces." in said
    assert "--fault TEXT..." in said
