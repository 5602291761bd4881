"""The experiment `servo`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.servo import run as servo
from antennate.experiments.servo.config import ServoConfig
from antennate.robots.servo_model import NAMES
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Measure, Table, shown

PARAMETERS = (
    Measure("gain_divisor", "gain divisor", form=".1f"),
    Measure("stall_torque", "stall torque", "N·m", form=".3f"),
    Measure("no_load_speed", "no-load speed", "rad/s"),
    Measure("armature", "inertia", "kg·m²", form=".5f"),
    Measure("friction", "friction", "N·m", form=".3f"),
    Measure("load_friction", "friction of load", form=".3f"),
)
ERROR = Measure("error_deg", "mean error", "deg")


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The error of every model, and the parameters of the last ones beside the data sheet."""
    whole = result["models"][-1]
    left = [f"{name} left out" for name in whole["held_out_deg"]]
    rows = [
        (model["name"], [ERROR.cell(model), *map(shown, model["held_out_deg"].values())])
        for model in result["models"]
    ]
    title = f"Models of {result['servo']}: {ERROR.title}"
    compared = Table(title, ["all", *left], rows, _note(result))
    sheet = result["models"][0]
    columns: dict[str, Any] = {sheet["name"]: sheet}
    if not result["fitted"]:
        columns[whole["name"]] = whole
        return compared, Table.of("Parameters", columns, PARAMETERS)
    for model in result["models"][-2:]:
        columns[model["name"]] = model
        ends = {name: model["interval_95"].get(name) for name in NAMES}
        columns[f"{model['name']}, 95 %"] = ends
    note = f"Intervals are over {result['interval_over']}."
    return compared, Table.of("Parameters", columns, PARAMETERS, note)


def _note(result: Mapping[str, Any]) -> str:
    told = [row["gain_divisor"] for row in result["recordings"] if row["gain_divisor"] is not None]
    drive = (
        f"Drive over position error at rest tells a divisor of {min(told):.1f} to {max(told):.1f}."
        if told
        else "No recording tells the drive at rest: the divisor of the gain is the one given."
    )
    unknown = any(row["supply_v"] is None for row in result["recordings"])
    supply = "\nNo supply is told: taken as nominal; --supply says it." if unknown else ""
    return f"{len(result['recordings'])} recordings; means while torque is on.\n{drive}{supply}"


def sentence(result: Mapping[str, Any]) -> str:
    """How far the model is from the real servo, on what it was fitted on and on what it was not."""
    model = result["models"][-1]
    if not result["fitted"]:
        return (
            f"The model as given misses the measured position by {model['error_deg']:.1f}° on "
            "average; --fit identifies it."
        )
    text = f"The whole model misses the measured position by {model['error_deg']:.1f}° where it was"
    known = {name: each for name, each in model["held_out_deg"].items() if each is not None}
    if not known:
        return (
            f"{text} fitted; of no part of the recordings an error could be found with a fit to "
            "the rest: give longer recordings, or several."
        )
    held = ", ".join(f"{error:.1f}° on {name}" for name, error in known.items())
    return f"{text} fitted and, fitted on the rest, by {held}."


CAPTIONS = {
    "servo": "Goals and measured positions of each recording, with those of two models.",
}

EXPERIMENT = Experiment.of_folder(
    __name__,
    ServoConfig,
    lambda config, workers, on_step, _: servo.run(config, on_step),
    tables,
    sentence,
    parts="fits",
    captions=CAPTIONS,
    explained="docs/results-bench.md",
    on_workers=False,
)
