"""A robot's file keeps what else stands in it when keys of it are set."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from antennate.errors import ConfigError
from antennate.hardware.setup.robot_toml import change
from antennate.params.toml_text import edited

MINE = """\
# my robot
controller = "closed"   # ours

[robot]
baud = 1000000
[robot.yaw]             # head first
zeros = [
    2048, 2048,         # two
    2048, 2048, 2048,
]
limit = 1.2             # rad

[control.gait]
frequency = 0.4
"""


def test_comments_and_all_else_stay() -> None:
    values = {
        ("robot", "yaw", "zeros"): [1, 2, 3, 4, 5],
        ("robot", "yaw", "directions"): [1, -1, 1, 1, 1],
        ("robot", "baud"): 57600,
        ("ports", "bus"): "/dev/serial/by-id/usb-FTDI_é",
        ("duration",): 3.5,
    }
    text = edited(MINE, values)
    assert (
        text
        == """\
# my robot
controller = "closed"   # ours
duration = 3.5

[robot]
baud = 57600
[robot.yaw]             # head first
zeros = [1, 2, 3, 4, 5]
limit = 1.2             # rad
directions = [1, -1, 1, 1, 1]

[control.gait]
frequency = 0.4

[ports]
bus = "/dev/serial/by-id/usb-FTDI_é"
"""
    )
    assert edited(text, values) == text


def test_a_comment_behind_a_changed_value_stays() -> None:
    assert edited('a = "x # y"  # why\n', {("a",): "z"}) == 'a = "z"  # why\n'


@pytest.mark.parametrize(
    "text",
    [
        'robot = "mine.toml"\n',
        "robot.yaw = 3\n",
        "a = [\n",
    ],
)
def test_a_file_of_another_form_is_refused_and_stays(text: str, tmp_path: Path) -> None:
    file = tmp_path / "robot.toml"
    file.write_text(text)
    with pytest.raises(ConfigError, match=r"write by hand: robot\.yaw\.zeros = \[2\]"):
        change(file, {("robot", "yaw", "zeros"): [2]})
    assert file.read_text() == text


@pytest.mark.parametrize(
    ("text", "changed"),
    [
        ("robot.yaw.zeros = [1] # mine\n", "robot.yaw.zeros = [2] # mine\n"),
        ("robot = {yaw = {zeros = [1]}}\n", "robot = {yaw = {zeros = [2]}}\n"),
        ("robot = {baud = 57600}\n", "robot = {baud = 57600,yaw = {zeros = [2]}}\n"),
        ("[robot]\n\n[control]\n\n[robot.yaw]\nzeros=[ 1 ]\n", None),
    ],
)
def test_other_forms_of_a_table_stay(text: str, changed: str | None) -> None:
    found = edited(text, {("robot", "yaw", "zeros"): [2]})
    assert found == (changed or text.replace("zeros=[ 1 ]", "zeros=[2]"))


def test_a_file_is_made_where_there_is_none(tmp_path: Path) -> None:
    file = tmp_path / "robot.toml"
    change(file, {("setup", "done"): ("yaw1",), ("robot", "yaw", "ids"): [3]})
    assert file.read_text() == '[setup]\ndone = ["yaw1"]\n\n[robot.yaw]\nids = [3]\n'


NAMES = st.text("abc_", min_size=1, max_size=3)
VALUES = st.one_of(
    st.integers(-9, 9),
    st.booleans(),
    st.text('aé"#\\\n =[]', max_size=5),
    st.lists(st.integers(-9, 9), max_size=3),
)


@given(
    st.dictionaries(st.tuples(NAMES), VALUES, max_size=3),
    st.dictionaries(st.tuples(st.just("t"), NAMES, NAMES), VALUES, max_size=4),
)
def test_what_is_written_is_read(first: dict, then: dict) -> None:
    text = edited("", first)
    if ("t",) in first:
        return
    for key, value in then.items():
        text = edited(text, {key: value})
    table = tomllib.loads(text)
    for key, value in (first | then).items():
        found = table
        for part in key:
            found = found[part]
        assert found == value


@pytest.mark.parametrize("mark", [b"", b"\xef\xbb\xbf"], ids=["plain", "byte order mark"])
def test_a_file_of_an_editor_for_windows_keeps_its_line_ends_and_its_mark(
    mark: bytes, tmp_path: Path
) -> None:
    path = tmp_path / "robot.toml"
    path.write_bytes(mark + '# mein Käfer\r\n[record]\r\nunit = "mm"  # so\r\n'.encode())
    change(path, {("robot", "yaw", "zeros"): [1, 2], ("setup", "done"): ("yaw1", "yaw2")})
    change(path, {("robot", "yaw", "zeros"): [3, 4]})
    lines = [b"[robot.yaw]", b"zeros = [3, 4]", b"", b"[setup]", b'done = ["yaw1", "yaw2"]', b""]
    before = mark + '# mein Käfer\r\n[record]\r\nunit = "mm"  # so\r\n\r\n'.encode()
    assert path.read_bytes() == before + b"\r\n".join(lines)
