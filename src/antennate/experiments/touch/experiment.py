"""The experiment `touch`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.antenna.statics import about
from antennate.experiments.touch import run as touch
from antennate.experiments.touch.config import TouchConfig
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table, few, shown

_95 = "  95 %"
F1 = Measure("f1", "F1")
ONSET = Measure("onset.median_ms", "onset latency", "ms", form=".0f")
RELEASE = Measure("release.median_ms", "release latency", "ms", form=".0f")
PROFILE = (
    Measure("contact_share", "time in contact", "%", form=".0f", scale=100.0),
    F1,
    Measure("f1_95", _95),
    Measure("precision", "precision"),
    Measure("precision_95", _95),
    Measure("recall", "recall"),
    Measure("recall_95", _95),
    Measure("contacts", "contacts", form="d"),
    Measure("missed", "  missed", form="d"),
    Measure("missed_per_m", "  missed per metre"),
    Measure("missed_per_m_95", _95),
    Measure("alarms", "alarms", form="d"),
    Measure("false", "  false", form="d"),
    Measure("false_per_m", "  false per metre"),
    Measure("false_per_m_95", _95),
    ONSET,
    Measure("onset.p90_ms", "  90 %", "ms", form=".0f"),
    Measure("onset.median_mm", "  way until then", "mm", form=".0f"),
    RELEASE,
    Measure("release.p90_ms", "  90 %", "ms", form=".0f"),
    Measure("auc", "area under ROC, level", form=".3f"),
    Measure("auc_95", _95, form=".3f"),
    Measure("auc_flex", "  flex itself", form=".3f"),
)
AVERAGING = (
    Measure("f1", "F1", form=".3f"),
    Measure("recall", "recall", form=".3f"),
    Measure("false_per_m", "false per metre"),
    ONSET,
    RELEASE,
    Measure("auc", "area under ROC", form=".3f"),
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """Profiles, speeds and walls, and what contact must do to be felt."""
    profiles, needed = result["profiles"], result["needed"]
    forces = ", ".join(
        f"{name} {shown(force or None, '.0f', 1e3)} mN"
        for name, force in needed["tip_force_n"].items()
    )
    return (
        Table.of(
            "Contact, sensed against true",
            profiles,
            PROFILE,
            f"{result['trials']} trials of every wall and speed, {result['invalid']} traverses "
            "invalid. Intervals are 95 %: of counts per\nmetre those of chance counts, of all else "
            "over trials. Latencies are medians.",
            about(profiles),
        ),
        _grid("F1 by speed [m/s]", result["by_speed"], "speed_m_s", "g", profiles),
        _grid("F1 by wall", result["by_wall"], "wall", "", profiles),
        Table.of(
            f"Averaging, all profiles (default {result['averaging_time_s']:g} s)",
            {f"{row['averaging_time_s']:g} s": row for row in result["averaging"]},
            AVERAGING,
            f"The level reaches theta = {result['threshold']:g} at a flex of "
            f"{shown(needed['flex_rad'])} rad; a steady force normal to the tip\nthat bends so "
            f"far: {forces}.",
        ),
    )


def _grid(
    title: str, rows: list[Mapping[str, Any]], part: str, form: str, profiles: Mapping[str, Any]
) -> Table:
    """One column per profile, and F1 with its interval for every speed or wall."""
    found = {(row["profile"], row[part]): row for row in rows}
    lines = []
    for value in dict.fromkeys(row[part] for row in rows):
        for name, label in (("f1", f"{value:{form}}"), ("f1_95", _95)):
            lines.append((label, [shown(found[p, value][name]) for p in profiles]))
    return Table(title, list(profiles), lines)


def sentence(result: Mapping[str, Any]) -> str:
    """How well contact is sensed by each profile."""
    found = ", ".join(
        f"{name} {shown(row['f1'])}" + (f" ({shown(row['f1_95'])})" if row["f1_95"] else "")
        for name, row in result["profiles"].items()
    )
    over = few([result["trials"]]) or f"Intervals are 95 %, over {result['trials']} trials."
    return f"Contact is sensed with an F1 of {found}, 1 being without error. {over}"


CAPTIONS = {
    "touch": "F1 by speed and by wall, and latencies by speed, a colour for each profile.",
    "touch_roc": "True against false contacts for every threshold, with the default "
    "one, and F1 over the threshold.",
    "touch_trace": "One traverse: the wall with shapes of the antenna, flex, bending "
    "level, and contact against truth.",
}

EXPERIMENT = Experiment.of_folder(
    __name__,
    TouchConfig,
    lambda config, workers, on_step, _: touch.run(config, workers, on_step),
    tables,
    sentence,
    filmed=True,
    parts="traverses",
    captions=CAPTIONS,
    explained="docs/results.md",
)
