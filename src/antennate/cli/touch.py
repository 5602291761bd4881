"""`antennate touch`: does the control know when the antenna touches a wall?"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from antennate.cli.study import Study
from antennate.cli.tables import Cell, number, show, span
from antennate.experiments.touch import run as touch
from antennate.experiments.touch.run import TouchConfig, TouchOutcome

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESCRIPTION = """\
Move one antenna along structured walls and compare the contact that the control senses with the
contact of the physics engine, a hundred times a second. All walls, speeds and profiles meet the
same overlaps, springs and noise. Definitions: docs/science/touch.md."""

_95 = "  95 %"


def show_result(result: Mapping[str, Any]) -> None:
    """Print profiles, speeds and walls, and what contact must do to be felt."""
    profiles = result["profiles"]
    needed = result["needed"]
    forces = ", ".join(
        f"{name} {number(1e3 * force if force else None, '.0f')} mN"
        for name, force in needed["tip_force_n"].items()
    )
    show(
        "Contact, sensed against true",
        profiles,
        _ROWS,
        f"{result['trials']} trials of every wall and speed, {result['invalid']} traverses "
        "invalid. Intervals are 95 %, over trials;\nlatencies are medians.\n",
    )
    for title, key, part, form in (
        ("F1 by speed [m/s]", "by_speed", "speed_m_s", "g"),
        ("F1 by wall", "by_wall", "wall", ""),
    ):
        _grid(title, result[key], part, form, profiles)
    angle = needed["flex_rad"]
    show(
        f"Averaging, all profiles (default {result['averaging_time_s']:g} s)",
        {f"{row['averaging_time_s']:g} s": row for row in result["averaging"]},
        _AVERAGING_ROWS,
        f"b reaches theta = {result['threshold']:g} at a flex of {number(angle, '.2f')} rad; "
        f"a steady force normal to the tip\nthat bends so far: {forces}.\n",
    )


def _grid(
    title: str, rows: list[Mapping[str, Any]], part: str, form: str, profiles: Mapping[str, Any]
) -> None:
    """One column per profile and one row per speed or wall."""
    columns = {p: {row[part]: row for row in rows if row["profile"] == p} for p in profiles}
    parts = list(dict.fromkeys(row[part] for row in rows))

    def value(one: Any) -> Cell:
        return lambda column: number(column[one]["f1"], ".2f")

    def interval(one: Any) -> Cell:
        return lambda column: span(column[one]["f1_95"], ".2f")

    lines = [
        line for one in parts for line in ((f"{one:{form}}", value(one)), (_95, interval(one)))
    ]
    show(title, columns, lines, "")


def _interval(key: str, form: str = ".2f") -> Cell:
    return lambda row: span(row[f"{key}_95"], form)


def _latency(which: str) -> Cell:
    def cell(row: Mapping[str, Any]) -> str:
        found = row[which]
        return number(found["median_ms"], ".0f")

    return cell


_ROWS: list[tuple[str, Cell]] = [
    ("time in contact [%]", lambda row: _percent(row["contact_share"])),
    ("F1", lambda row: number(row["f1"], ".2f")),
    (_95, _interval("f1")),
    ("precision", lambda row: number(row["precision"], ".2f")),
    (_95, _interval("precision")),
    ("recall", lambda row: number(row["recall"], ".2f")),
    (_95, _interval("recall")),
    ("contacts", lambda row: str(row["contacts"])),
    ("  missed", lambda row: str(row["missed"])),
    ("  missed per metre", lambda row: number(row["missed_per_m"], ".2f")),
    (_95, _interval("missed_per_m")),
    ("alarms", lambda row: str(row["alarms"])),
    ("  false", lambda row: str(row["false"])),
    ("  false per metre", lambda row: number(row["false_per_m"], ".2f")),
    (_95, _interval("false_per_m")),
    ("onset latency [ms]", _latency("onset")),
    ("  90 % [ms]", lambda row: number(row["onset"]["p90_ms"], ".0f")),
    ("  way until then [mm]", lambda row: number(row["onset"]["median_mm"], ".0f")),
    ("release latency [ms]", _latency("release")),
    ("  90 % [ms]", lambda row: number(row["release"]["p90_ms"], ".0f")),
    ("area under ROC, b", lambda row: number(row["auc"])),
    (_95, _interval("auc", ".3f")),
    ("  flex itself", lambda row: number(row["auc_flex"])),
]

_AVERAGING_ROWS: list[tuple[str, Cell]] = [
    ("F1", lambda row: number(row["f1"])),
    ("recall", lambda row: number(row["recall"])),
    ("false per metre", lambda row: number(row["false_per_m"], ".2f")),
    ("onset latency [ms]", _latency("onset")),
    ("release latency [ms]", _latency("release")),
    ("area under ROC", lambda row: number(row["auc"])),
]


def _percent(share: float | None) -> str:
    return number(None if share is None else 100 * share, ".0f")


def _run(config: TouchConfig, workers: int, on_step: Any, on_row: Any) -> TouchOutcome:
    return touch.run(config, workers, on_step)


def _draw(outcome: TouchOutcome) -> Mapping[str, Figure]:
    from antennate.experiments.touch import figure as figures

    result, example = outcome.result(), outcome.example()
    drawn = {"touch": figures.measures(result), "touch_roc": figures.curves(result)}
    return drawn if example is None else {**drawn, "touch_trace": figures.trace(example)}


STUDY = Study(
    name="touch",
    description=DESCRIPTION,
    model=TouchConfig,
    run=_run,
    result=TouchOutcome.result,
    show=show_result,
    draw=_draw,
    rows=TouchOutcome.rows,
    parts="traverses",
)
command = STUDY.command
