"""Options that need another one, and options that take several values."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import antennate
from antennate.cli import commands, described, main
from antennate.cli.arguments import read_words
from antennate.cli.options import Option
from antennate.errors import ConfigError

NEEDS = {
    "--accept": ["--ros"],
    "--foxglove-port": ["--foxglove"],
    "--gait": ["--export mjcf"],
    "--goals.release": ["--accept"],
    "--key": ["--udp"],
    "--markers": ["--poses"],
    "--mirrored": ["--poses"],
    "--overwrite": ["--out"],
    "--resume": ["--out"],
    "--retry": ["--out"],
    "--ros-domain": ["--ros"],
    "--ros-network": ["--ros"],
    "--scene": ["--export mjcf"],
    "--log": ["--compare"],
    "--seed": ["--scene"],
    "--slurm": ["--engine slurm"],
    "--teleop.gamepad-silence": ["--gamepad"],
    "--unit": ["--poses"],
    "--up": ["--poses"],
    "--video-trial": ["--video"],
    "--video-view": ["--video"],
    "--view-paused": ["--view"],
    "--view-port": ["--view"],
    "--view-speed": ["--view", "--foxglove", "--ros"],
    "--yes": ["--fix"],
}
"""What stands for nothing alone; `--overwrite` of `log` has a file of its own, and with `--key` of
the robot's commands its robot.toml may name the port."""
ELSEWHERE = {("report", "--overwrite"): ["--out", "--compare"]}


def dependents() -> Iterator[tuple[str, Option]]:
    """Every option of every command that needs another one."""
    for name in sorted(commands()):
        found = described(name)
        yield from ((name, each) for each in [*found.others, *found.parameters] if each.needs)


DEPENDENT = list(dependents())


def test_the_options_that_need_another_one_are_these() -> None:
    assert {each.flag for _, each in DEPENDENT} == NEEDS.keys()
    for name, each in DEPENDENT:
        assert list(each.needs) == ELSEWHERE.get((name, each.flag), NEEDS[each.flag])


@pytest.mark.parametrize("name", sorted(commands()))
def test_what_is_needed_is_there_and_a_longer_name_needs_the_shorter(name: str) -> None:
    others = described(name).others
    flags = {each.flag for each in others}
    for each in others:
        assert {need.partition(" ")[0] for need in each.needs} <= flags
        shorter = [flag for flag in flags if each.flag.startswith(f"{flag}-")]
        assert set(shorter) <= set(each.needs), each.flag


@pytest.mark.parametrize(
    ("name", "option"), DEPENDENT, ids=[f"{name} {each.flag}" for name, each in DEPENDENT]
)
def test_each_is_refused_alone(
    name: str,
    option: Option,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    refused: Callable[..., str],
) -> None:
    """With its own default, too: it was said, and nothing would come of it."""
    monkeypatch.chdir(tmp_path)
    known = {"DOMAIN": "7", "TEXT": "x", "FILE": "x", "NAME": "x", "NAME=VALUE": "a=1"}
    default = option.default or next(iter(option.choices), "1")
    value = known.get(option.metavar, default)
    words = [option.offered, *([value] if option.metavar else [])]
    err = refused(*name.split(), *words)
    needed = " or ".join(option.needs)
    assert err == (
        f"antennate {name}: error: {option.offered}: expected {needed} beside it, found none\n"
    )
    assert not list(tmp_path.iterdir())


def test_python_refuses_what_is_for_a_run_directory_without_one() -> None:
    with pytest.raises(ConfigError, match="overwrite: expected out beside it, found none"):
        antennate.run("antenna", overwrite=True)
    with pytest.raises(ConfigError, match="resume: expected out beside it, found none"):
        antennate.run("antenna", resume=True)


COMMAS = {"--files", "--poses", "--recording", "--beside", "--slurm", "--compare", "--shards"}
"""Lists of files, and what SLURM is asked for: a comma may be part of a value."""


def lists() -> Iterator[tuple[str, Option]]:
    for name in sorted(commands()):
        found = described(name)
        yield from ((name, each) for each in [*found.others, *found.parameters] if each.many)


LISTS = list(lists())


def test_every_list_takes_words_and_adds_those_of_a_flag_given_again() -> None:
    assert len(LISTS) > 100
    for name, each in LISTS:
        two = (each.choices * 2)[:2] or ("1", "2")
        first, last = map(str, two)
        values = read_words([each.flag, first, last], [each])
        assert values[each.path] == (each.value(first), each.value(last)), (name, each.flag)
        assert read_words([each.flag, first, each.flag, last], [each]) == values
        assert read_words([f"{each.flag}={first}", last], [each]) == values


def test_no_list_is_one_word_with_commas() -> None:
    for name, each in LISTS:
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


def test_a_number_of_a_controller_may_be_a_list_with_commas() -> None:
    timed = "schedule+schedule.reverse_times=[2, 4, 6]+gait.frequency=0.7"
    lists = [each for _, each in LISTS if each.flag == "--controllers"]
    for each in lists:
        assert read_words([each.flag, "open", timed], [each])[each.path] == ("open", timed)
        with pytest.raises(ConfigError, match="separated by spaces"):
            read_words([each.flag, f"{timed},open"], [each])
    assert lists


@pytest.mark.parametrize("how", ["--help", "--help-all"])
def test_the_help_says_how_a_list_is_given(how: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["twin", how]) == 0
    said = capsys.readouterr().out
    assert "A list (...) is words separated by spaces." in said
    assert "--fault TEXT..." in said
