"""The experiment `servo`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.experiments.servo.recording import ServoConfig
from antennate.experiments.servo.run import SEEN, SHOWN, ServoOutcome, run, stalled
from antennate.robots.servos import MODEL_NUMBERS, STEP
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table, shown
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PARAMETERS = (
    Measure("gain_divisor", "gain divisor", form=".1f"),
    Measure("stall_torque", "stall torque", "N·m", form=".3f"),
    Measure("no_load_speed", "no-load speed", "rad/s"),
    Measure("armature", "inertia", "kg·m²", form=".5f"),
    Measure("friction", "friction", "N·m", form=".3f"),
    Measure("load_friction", "friction of load", form=".3f"),
)
ERROR = Measure("error_deg", "mean error", "deg")
RECORDING = (
    Measure("p_gain", "gain", form="g"),
    Measure("error_deg", "error", "deg"),
    Measure("stalled", "stalls", "%", form=".0f", scale=100.0),
    Measure("error_stalled_deg", "then", "deg", form=".1f"),
    Measure("error_else_deg", "else", "deg"),
)
_MOST = 8
"""Recordings drawn."""


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The error of every model, of every recording, and parameters beside the data sheet."""
    whole = result["models"][-1]
    left = [f"{name} left out" for name in whole["held_out_deg"]]
    rows = [
        (model["name"], [ERROR.cell(model), *map(shown, model["held_out_deg"].values())])
        for model in result["models"]
    ]
    title = f"Models of {result['servo']}: {ERROR.title}"
    compared = Table(title, ["all", *left], rows, _note(result))
    recordings = _recordings(result)
    sheet = result["models"][0]
    columns: dict[str, Any] = {sheet["name"]: sheet}
    if not result["fitted"]:
        columns[whole["name"]] = whole
        return compared, recordings, Table.of("Parameters", columns, PARAMETERS)
    for model in result["models"][-2:]:
        columns[model["name"]] = model
        ends = {name: model["interval_95"].get(name) for name in MODEL_NUMBERS}
        columns[f"{model['name']}, 95 %"] = ends
    note = f"Intervals are over {result['interval_over']}."
    return compared, recordings, Table.of("Parameters", columns, PARAMETERS, note)


def _recordings(result: Mapping[str, Any]) -> Table:
    """The error of each recording with the last model: a recording in each line."""
    rows = [
        (row["name"], [measure.cell(row) for measure in RECORDING]) for row in result["recordings"]
    ]
    title = f"Recordings: {result['models'][-1]['name']}"
    return Table(title, [m.title for m in RECORDING], rows, " ".join(_stalls(result)))


def _stalls(result: Mapping[str, Any]) -> list[str]:
    """What is told of recordings in which a real servo stands still at full drive."""
    return [_stall(row) for row in result["recordings"] if (row["stalled"] or 0.0) >= SEEN]


def _stall(row: Mapping[str, Any]) -> str:
    """Why a recording differs: what its servo did not lift, at which supply."""
    volts = row["supply_stalled_v"]
    supply = "" if volts is None or not math.isfinite(volts) else f", at {volts:.1f} V"
    lifted = row["lifted_n_m"]
    more = (
        f" Weight and supply do not explain it: with drive to spare {lifted:.2f} N·m were held."
        if lifted > row["weight_stalled_n_m"]
        else ""
    )
    return (
        f"{row['name']} stalls: for {100 * row['stalled']:.0f} % of its time with torque the drive "
        f"is full and the shaft rests under {row['weight_stalled_n_m']:.2f} N·m of weight{supply}; "
        f"the model, whose motor still pulls, is {row['error_stalled_deg']:.1f}° off then and "
        f"{row['error_else_deg']:.1f}° else.{more}"
    )


def _note(result: Mapping[str, Any]) -> str:
    """How many recordings, and what they tell of gain and supply."""
    known = [row["gain_divisor"] for row in result["recordings"] if row["gain_divisor"] is not None]
    drive = (
        f"Drive over position error at rest tells a divisor of {min(known):.1f} to "
        f"{max(known):.1f}."
        if known
        else "No recording tells the drive at rest: the divisor of the gain is the one given."
    )
    unknown = any(row["supply_v"] is None for row in result["recordings"])
    supply = "\nNo supply is told: taken as nominal; --supply says it." if unknown else ""
    return f"{len(result['recordings'])} recordings; means while torque is on.\n{drive}{supply}"


def sentence(result: Mapping[str, Any]) -> str:
    """How far the model is from the real servo, and which recording differs, and why."""
    return " ".join([_misses(result), _spread(result), *_stalls(result)])


def _spread(result: Mapping[str, Any]) -> str:
    """The errors of the single recordings, the largest by its name."""
    rows = sorted(result["recordings"], key=lambda row: row["error_deg"])
    if len(rows) < 2:
        return ""
    *others, worst = rows
    return (
        f"By recording: {worst['name']} {worst['error_deg']:.1f}°, the others "
        f"{others[0]['error_deg']:.1f} to {others[-1]['error_deg']:.1f}°."
    )


def _misses(result: Mapping[str, Any]) -> str:
    """The error on what the model was fitted on and on what it was not."""
    model = result["models"][-1]
    if not result["fitted"]:
        return (
            f"The model as given misses the measured position by {model['error_deg']:.1f}° on "
            "average; --fit identifies it."
        )
    text = f"The whole model misses the measured position by {model['error_deg']:.1f}° where it was"
    known = {name: error for name, error in model["held_out_deg"].items() if error is not None}
    if not known:
        return (
            f"{text} fitted; of no part of the recordings an error could be found with a fit to "
            "the rest: give longer recordings, or several."
        )
    held = ", ".join(f"{error:.1f}° on {name}" for name, error in known.items())
    return f"{text} fitted and, fitted on the rest, by {held}."


@style.styled
def figures(outcome: ServoOutcome) -> dict[str, Figure]:
    """Each recording with two models, the simplest and that of the simulation or of its form."""
    count = min(_MOST, len(outcome.recordings))
    figure = style.canvas(style.WIDTH, 1.0 + 1.6 * count)
    panels = figure.subplots(count, 1, squeeze=False, sharex=True)[:, 0]
    traces = np.degrees(outcome.traces())
    for i, panel in enumerate(panels):
        _draw_course(panel, outcome, i, traces[:, :, i])
    panels[-1].set_xlabel("time [s]")
    figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
    return {"servo": figure}


def _draw_course(panel: Axes, outcome: ServoOutcome, place: int, traces: Floats) -> None:
    recording, names = outcome.recordings[place], [model.name for model in outcome.models]
    t = STEP * SHOWN * np.arange(len(traces))
    inside = t <= recording.t[-1]
    panel.plot(recording.t, np.degrees(recording.goal), color=style.FAINT, label="goal")
    panel.plot(recording.t, np.degrees(recording.position), color=style.INK, label="measured")
    for row, colour in ((0, style.SERIES[4]), (outcome.shown, style.SERIES[0])):
        drawn = traces[inside, row]
        panel.plot(t[inside], drawn, color=colour, linewidth=1.1, label=names[row])
    ends = np.flatnonzero(np.diff(stalled(recording).astype(int), prepend=0, append=0))
    for first, last in ends.reshape(-1, 2):
        begin, end = recording.t[[first, min(last, len(recording.t) - 1)]].tolist()
        panel.axvspan(begin, end, color=style.SERIES[4], alpha=0.15, linewidth=0)
    off = ~recording.torque
    if off.any():
        first = recording.t[int(np.argmax(off))]
        panel.axvline(first, color=style.MUTED, linewidth=0.8, linestyle=":")
        where = {"xycoords": ("data", "axes fraction"), "textcoords": "offset points"}
        aside = {"xytext": (-3, -3), "ha": "right", "va": "top"}
        panel.annotate("torque off", (first, 1), fontsize=8, **aside, **where)
    panel.set_ylabel("position [deg]")
    panel.set_title(f"{recording.name}, gain {recording.p_gain:g}")


EXPERIMENT = Experiment.of_folder(
    __name__,
    ServoConfig,
    lambda config, workers, on_step, _: run(config, on_step),
    tables,
    sentence,
    parts="fits",
    figures=figures,
    captions={
        "servo": "Goals and measured positions of each recording, with those of two models; "
        "shaded: full drive while the shaft rests.",
    },
    explained="docs/results.md",
    on_workers=False,
)
