"""The experiment `servo`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.robots.servos import STEP
from antennate.studies.columns import column_of, columns, shown
from antennate.studies.experiment import Experiment
from antennate.studies.tables import Table
from antennate.types import Floats
from antennate_lab.servo.recording import ServoConfig
from antennate_lab.servo.result import (
    ModelSummary,
    Parameters,
    RecordingRow,
    ServoResult,
)
from antennate_lab.servo.run import SEEN, SHOWN, ServoOutcome, run, stalled

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 8
"""Recordings drawn."""


def tables(result: ServoResult) -> Sequence[Table]:
    """The error of every model, of every recording, and parameters beside the data sheet."""
    sheet, whole = result.models[0], result.models[-1]
    error = column_of(ModelSummary, "error_deg")
    left = [f"{name} left out" for name in whole.held_out_deg]
    rows = [
        (each.name, [error.cell(each), *map(shown, each.held_out_deg.values())])
        for each in result.models
    ]
    title = f"Models of {result.servo}: {error.title}"
    compared = Table(title, ["all", *left], rows, _note(result))
    beside: dict[str, Any] = {sheet.name: sheet}
    note = ""
    if result.fitted:
        for each in result.models[-2:]:
            beside |= {each.name: each, f"{each.name}, 95 %": each.interval_95}
        note = f"Intervals are over {result.interval_over}."
    else:
        beside[whole.name] = whole
    parameters = Table.of("Parameters", beside, columns(Parameters), note)
    return compared, _recordings(result), parameters


def _recordings(result: ServoResult) -> Table:
    """The error of each recording with the last model: a recording in each line."""
    measures = [each for each in columns(RecordingRow) if each.label]
    rows = [(row.name, [each.cell(row) for each in measures]) for row in result.recordings]
    title = f"Recordings: {result.models[-1].name}"
    return Table(title, [each.title for each in measures], rows, " ".join(stalls(result)))


def stalls(result: ServoResult) -> list[str]:
    """What is told of recordings in which a real servo stands still at full drive."""
    return [_stall(row) for row in result.recordings if (row.stalled or 0.0) >= SEEN]


def _stall(row: RecordingRow) -> str:
    """Why a recording differs: what its servo did not lift, at which supply."""
    volts, lifted = row.supply_stalled_v, row.lifted_n_m
    supply = "" if volts is None else f", at {volts:.1f} V"
    weight = row.weight_stalled_n_m or 0.0
    more = (
        f" Weight and supply do not explain it: with drive to spare {lifted:.2f} N·m were held."
        if lifted > weight
        else ""
    )
    return (
        f"{row.name} stalls: for {100 * (row.stalled or 0.0):.0f} % of its time with torque the "
        f"drive is full and the shaft rests under {weight:.2f} N·m of weight{supply}; the model, "
        f"whose motor still pulls, is {shown(row.error_stalled_deg, '.1f')}° off then and "
        f"{shown(row.error_else_deg, '.1f')}° else.{more}"
    )


def _note(result: ServoResult) -> str:
    """How many recordings, and what they tell of gain and supply."""
    known = [row.gain_divisor for row in result.recordings if row.gain_divisor is not None]
    drive = (
        f"Drive over position error at rest tells a divisor of {min(known):.1f} to "
        f"{max(known):.1f}."
        if known
        else "No recording tells the drive at rest: the divisor of the gain is the one given."
    )
    unknown = any(row.supply_v is None for row in result.recordings)
    supply = "\nNo supply is told: taken as nominal; --supply says it." if unknown else ""
    return f"{len(result.recordings)} recordings; means while torque is on.\n{drive}{supply}"


def sentence(result: ServoResult) -> str:
    """How far the model is from the real servo, and which recording differs, and why."""
    return " ".join(filter(None, [_misses(result), _spread(result), *stalls(result)]))


def _spread(result: ServoResult) -> str:
    """The errors of the single recordings, the largest by its name."""
    errors = [(row.error_deg, row.name) for row in result.recordings if row.error_deg is not None]
    if len(errors) < 2:
        return ""
    *others, (worst, name) = sorted(errors, key=lambda pair: pair[0])
    return (
        f"By recording: {name} {worst:.1f}°, the others {others[0][0]:.1f} to {others[-1][0]:.1f}°."
    )


def _misses(result: ServoResult) -> str:
    """The error on what the model was fitted on and on what it was not."""
    model = result.models[-1]
    missed = f"misses the measured position by {shown(model.error_deg, '.1f')}°"
    if not result.fitted:
        return f"The model as given {missed} on average; --fit identifies it."
    text = f"The whole model {missed} where it was fitted"
    known = {name: error for name, error in model.held_out_deg.items() if error is not None}
    if not known:
        return (
            f"{text}; of no part of the recordings an error could be found with a fit to the rest: "
            "give longer recordings, or several."
        )
    held = ", ".join(f"{error:.1f}° on {name}" for name, error in known.items())
    return f"{text} and, fitted on the rest, by {held}."


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
    result=ServoResult,
    row=RecordingRow,
    figures=figures,
    captions={
        "servo": "Goals and measured positions of each recording, with those of two models; "
        "shaded: full drive while the shaft rests.",
    },
    workers="none",
)
