"""Columns of rows and results: each is said once, and all else follows from it."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import get_args, get_type_hints

import pytest

from antennate import experiments
from antennate.errors import ConfigError
from antennate.studies.columns import (
    Column,
    Ends,
    column,
    column_of,
    columns,
    content,
    named,
    shown,
    tabular,
    typed,
)
from antennate.studies.pooling import (
    by,
    count,
    frame,
    largest,
    mean,
    median,
    pooled,
    share,
    smallest,
    total,
)
from antennate.studies.statistics import wilson
from antennate.studies.tables import Table


@tabular
class Shares:
    """Shares of time."""

    hold: float | None = column("hold", "%", mean, form=".0f", scale=100.0)


@tabular
class Measured:
    """Of one throw, and of many."""

    way_m: float | None = column("way", "m", median, interval="way_95", default=None)
    falls: int = column("falls", pool=total, form="d", default=0)


@tabular
class Throw(Measured):
    """A throw."""

    trial: int
    kind: str
    outcome: str
    share_hold: float | None = None
    reason: str = ""


@tabular
class Thrown(Measured):
    """Many throws."""

    trials: int
    invalid: int
    first_reason: str | None
    won: int = column("won", pool=count("outcome", "success"), form="d")
    won_share: float | None = column("  share", "%", share("outcome", "success"), scale=100.0)
    wilson95: Ends | None = wilson()
    share: Shares = column("of the time")
    way_95: Ends | None = None
    secret: int = 7


THROWS = [
    Throw(trial=0, kind="a", outcome="success", way_m=3.0, falls=1, share_hold=0.5),
    Throw(trial=1, kind="a", outcome="timeout", way_m=1.0, falls=1, share_hold=None),
    Throw(trial=2, kind="a", outcome="invalid", way_m=9.0, falls=5, share_hold=0.9, reason="lost"),
    Throw(trial=0, kind="b", outcome="success", falls=2, share_hold=0.25),
]


def test_rows_are_pooled_as_their_columns_say_and_invalid_ones_only_counted() -> None:
    groups = by(frame(THROWS), "kind", ["b", "a", "c"])
    assert list(groups) == ["b", "a", "c"]
    found = pooled(Thrown, groups["a"], way_95=(0.0, 4.0))
    assert (found.trials, found.invalid, found.first_reason) == (3, 1, "lost")
    assert (found.way_m, found.falls, found.won, found.won_share) == (2.0, 2, 1, 0.5)
    assert found.share.hold == 0.5
    # Wilson (1927) for 1 of 2: 0.5 +- 1.96 / 2 * sqrt((0.25 + 1.96**2 / 8) / 2) / (1 + 1.96**2 / 2)
    assert found.wilson95 == pytest.approx((0.0945, 0.9055), abs=1e-4)
    none = pooled(Thrown, groups["c"])
    assert (none.trials, none.falls, none.won, none.way_m, none.wilson95) == (0, 0, 0, None, None)


def test_a_table_shows_the_columns_that_have_a_label_each_interval_below_its_number() -> None:
    made = pooled(Thrown, by(frame(THROWS), "kind")["a"], way_95=(0.5, 4.0))
    table = Table.of("Throws", {"a": made})
    assert table.columns == ["a"]
    assert [(name, *cells) for name, cells in table.rows] == [
        ("way [m]", "2.00"),
        ("  95 % [m]", "0.50 to 4.00"),
        ("falls", "2"),
        ("won", "1"),
        ("  share [%]", "50.00"),
        ("  Wilson 95 % [%]", "9 to 91"),
        ("hold of the time [%]", "50"),
    ]
    lines = Table.lines("Throws", {"a": made, "b": made})
    assert (lines.columns[0], lines.rows[1][0], lines.rows[1][1][0]) == ("way [m]", "b", "2.00")


def test_a_result_goes_to_json_and_back_and_one_of_another_version_is_one_line() -> None:
    made = pooled(Thrown, frame(THROWS), way_95=(0.5, 4.0))
    assert content(made) == asdict(made)
    assert typed(Thrown, content(made)) == made
    assert content({"a": 1}) == {"a": 1}
    with pytest.raises(ValueError, match=r"share\.hold: field required") as found:
        typed(Thrown, {**content(made), "share": {}})
    assert "\n" not in str(found.value)


def test_each_way_of_pooling_leaves_out_what_is_not_known() -> None:
    rows = frame([{"x": 4, "y": None}, {"x": 1, "y": 2.0}, {"x": 1, "y": float("nan")}])
    assert [pool(rows, "x") for pool in (mean, median, largest, smallest, total)] == [2, 1, 4, 1, 6]
    assert [pool(rows, "y") for pool in (mean, median, largest, smallest)] == [2.0] * 4
    assert type(largest(rows, "x")) is int
    assert type(total(rows, "x")) is int
    assert len(frame([], Throw).columns) == 7


def test_numbers_are_written_with_their_form_and_what_is_not_known_is_a_dash() -> None:
    assert [shown(None), shown(math.nan), shown((0.25, 1.0)), shown((None, 1.0))] == [
        *("-", "-"),
        *("0.25 to 1.00", "-"),
    ]
    assert shown((-0.004, 0.004), ".0f", 100.0) == "0 to 0"
    assert [shown(-0.004), shown(-0.006), shown(-10, "d")] == ["0.00", "-0.01", "-10"]
    of = Column("share.hold", "hold", "%", form=".0f", scale=100.0)
    assert of.cell({"share": {"hold": 1.5}}) == "150"
    assert of.cell({}) == "-"


def test_a_name_tells_words_and_unit() -> None:
    assert (named("contact_force_n").title, named("speed_m_s").title, named("won").title) == (
        *("contact force [N]", "speed [m/s]"),
        "won",
    )


def test_what_a_trial_and_a_profile_of_the_wall_share_is_one_column() -> None:
    """The class of the rows and that of the summaries inherit it."""
    row, hints = experiments.load("wall").row, get_type_hints(experiments.load("wall").result)
    _, summary = get_args(hints["profiles"])
    assert row is not None
    of_row = {each.name: each for each in columns(row)}
    shared = [each for each in columns(summary) if each.name in of_row]
    assert [each.name for each in shared if each.unit == "mm"] == [
        "least_advance_mm",
        "longest_stick_mm",
    ]
    assert all(each == of_row[each.name] for each in shared)


def test_what_cannot_be_pooled_is_told_by_class_and_field() -> None:
    @tabular
    class Odd:
        way_m: float | None = column("way", pool=mean)

    for rows, said in (
        (frame([{"way_m": "far"}]), r"Odd\.way_m: expected rows with numbers in a column way_m"),
        (frame([{"other": 1.0}]), r"Odd\.way_m: .* found .*way_m"),
    ):
        with pytest.raises(ConfigError, match=said):
            pooled(Odd, rows)
    with pytest.raises(ConfigError, match=r"Thrown: expected a column, one of .*, found wy"):
        column_of(Thrown, "wy")


def test_whole_numbers_stay_whole_where_some_are_not_known() -> None:
    rows = frame([{"x": 3}, {"x": None}])
    assert [repr(pool(rows, "x")) for pool in (largest, smallest, total)] == ["3"] * 3
    assert shown(3.0, "d") == "3"
    groups = by(frame([{"c": None, "x": 1}, {"c": "a", "x": 2}]), "c")
    assert [some["x"].tolist() for some in groups.values()] == [[1], [2]]
