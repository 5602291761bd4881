"""Touching walls: the sensed state of contact against the engine's, by wall, speed and profile."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations, product
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate.antenna import sensor
from antennate.antenna.statics import Chain, Profile, about, equilibrium, with_profile
from antennate.control.conditioning import bending_level
from antennate.errors import BadInputError
from antennate.experiments.touch.measures import Pool, roc
from antennate.experiments.touch.physics import TouchConfig, Traverse, run_traverse
from antennate.experiments.touch.sensing import Comparison, compare, readings
from antennate.sim.bench import Bench
from antennate.studies.experiment import Experiment, OnStep, no_step
from antennate.studies.measures import Measure, Table, few, shown
from antennate.studies.pool import Workers, gather
from antennate.types import Floats

if TYPE_CHECKING:
    from antennate.telemetry.film import Film

_FLEX = np.linspace(0.0, 2.0 * np.pi, 20001)
_STRONGEST = 1.0
"""Largest force tried at the tip [N]."""
_SHORT = ("f1", "f1_95", "precision", "recall", "contacts", "missed", "false_per_m")
_AVERAGED = (*_SHORT, "onset", "release", "auc", "auc_95")


@dataclass(frozen=True, slots=True)
class TouchRow:
    """One traverse in the table; empty cells where the physics is invalid."""

    seed: int
    trial: int
    wall: str
    speed_m_s: float
    profile: str
    status: str
    overlap_m: float
    contact_share: float | None = None
    f1: float | None = None
    contacts: int | None = None
    missed: int | None = None
    alarms: int | None = None
    false: int | None = None
    largest_flex_rad: float | None = None
    largest_force_n: float | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True)
class TouchOutcome:
    """All traverses in the order of walls, speeds, profiles and trials, and what was sensed.

    Attributes:
        comparisons: For each what was sensed; None where the physics is invalid.
    """

    config: TouchConfig
    traverses: list[Traverse]
    comparisons: list[Comparison | None]
    summary: dict[str, Any]

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return self.summary

    @property
    def rows(self) -> list[TouchRow]:
        """The rows of trials.csv."""
        return list(map(_row, self.traverses, self.comparisons))

    def example(self) -> tuple[Traverse, Comparison] | None:
        """Trial 0 of one traverse: a gap, the middle speed and `descending` where there are."""
        config = self.config
        profile = "descending" if "descending" in config.profiles else config.profiles[0]
        wanted = (*config.example(), profile, 0)
        for traverse, comparison in zip(self.traverses, self.comparisons, strict=True):
            plan = traverse.plan
            if comparison and (plan.wall, plan.speed, plan.profile, plan.trial) == wanted:
                return traverse, comparison
        return None


def _row(traverse: Traverse, comparison: Comparison | None) -> TouchRow:
    plan = traverse.plan
    key = (plan.config.seed, plan.trial, plan.wall, plan.speed, plan.profile)
    if comparison is None:
        return TouchRow(*key, "invalid", plan.overlap, reason=traverse.reason)
    truth, alarm, matches = comparison.truth, comparison.alarm, comparison.matches
    whole = int(truth.sum() + alarm.sum())
    return TouchRow(
        *(*key, "valid", plan.overlap),
        contact_share=float(truth.mean()),
        f1=2.0 * int((truth & alarm).sum()) / whole if whole else None,
        contacts=len(matches.contacts),
        missed=int((~matches.found).sum()),
        alarms=matches.alarms,
        false=matches.false,
        largest_flex_rad=float(abs(traverse.flex).max()),
        largest_force_n=float(abs(traverse.force).max()),
    )


def run(config: TouchConfig, workers: int | Workers = 1, on_step: OnStep = no_step) -> TouchOutcome:
    """Run all traverses, then let the control read them.

    Raises:
        WorkerError: A worker died.
    """
    trials = range(config.trials)
    tasks = list(product([config], config.walls, config.speeds, config.profiles, trials))
    traverses = gather(run_traverse, tasks, workers, on_step)
    comparisons = compare(config, traverses)
    return TouchOutcome(config, traverses, comparisons, _summary(config, traverses, comparisons))


def _summary(
    config: TouchConfig, traverses: Sequence[Traverse], comparisons: Sequence[Comparison | None]
) -> dict[str, Any]:
    """The content of result.json."""
    valid = [c for c in comparisons if c is not None]
    pool = Pool(valid, config.trials, config.antenna.sensor.rate)

    def of(**wanted: Any) -> dict[str, Any]:
        group = [v for v in valid if all(getattr(v, k) == w for k, w in wanted.items())]
        names = {"speed_m_s" if k == "speed" else k: w for k, w in wanted.items()}
        return {**names, **pool.measure(group)}

    walls, speeds, profiles = config.walls, config.speeds, config.profiles
    mine = {p: [v for v in valid if v.profile == p] for p in profiles}
    return {
        "schema": 1,
        "command": "touch",
        "seed": config.seed,
        "trials": config.trials,
        "invalid": len(traverses) - len(valid),
        "rate_hz": config.antenna.sensor.rate,
        "travel_m": config.travel,
        "contact_force_n": config.contact_force,
        "merge_time_s": config.merge_time,
        "averaging_time_s": config.conditioning.averaging_time,
        "threshold": config.rule.threshold,
        "hysteresis": config.rule.hysteresis,
        "needed": _needed(config),
        "profiles": {p: of(profile=p) for p in profiles},
        "by_speed": [of(profile=p, speed=s) for p in profiles for s in speeds],
        "by_wall": [of(profile=p, wall=w) for p in profiles for w in walls],
        "cells": [of(wall=w, speed=s, profile=p) for w in walls for s in speeds for p in profiles],
        "pairs": {
            f"{a}-{b}": pool.f1_difference(mine[a], mine[b]) for a, b in combinations(profiles, 2)
        },
        "roc": {p: _with_flex(config, roc(mine[p], config.rule.threshold)) for p in profiles},
        "averaging": [_averaged(config, traverses, time) for time in config.averaging_times],
        "truths": [_with_truth(config, traverses, *way) for way in _truths(config)],
    }


def _needed(config: TouchConfig) -> dict[str, Any]:
    """Flex at which b reaches theta, and the force normal to the tip that bends so far."""
    angle = _flex_at(config, config.rule.threshold)
    forces = {p: None if angle is None else _tip_force(config, p, angle) for p in config.profiles}
    return {"flex_rad": angle, "tip_force_n": forces}


def _flex_at(config: TouchConfig, level: float) -> float | None:
    """Least steady flex without noise at which b reaches a level [rad]; None if none does."""
    b = bending_level(config.conditioning, sensor.counts(config.antenna.sensor, _FLEX))
    enough = np.flatnonzero(b >= level)
    return float(_FLEX[enough[0]]) if len(enough) else None


def _with_flex(config: TouchConfig, curve: dict[str, Any]) -> dict[str, Any]:
    """Beside the thresholds that stand out, the flex that reaches them."""
    for name in ("default", "best_f1"):
        curve[name]["flex_rad"] = _flex_at(config, curve[name]["theta"])
    return curve


def _tip_force(config: TouchConfig, profile: str, angle: float) -> float | None:
    """Force that turns with the tip and bends the flex sensor by an angle [rad]; None above 1 N."""
    antenna = with_profile(config.antenna, profile)
    chain = Chain.of(antenna)
    force = np.geomspace(1e-4, _STRONGEST, 400)
    load = np.stack([np.zeros_like(force), force], axis=1)
    rest = equilibrium(chain, np.full(len(force), chain.length), load, follower=True)
    bent = rest.angles[:, : antenna.sensed_hinges].sum(axis=1)
    within = (abs(rest.angles) < antenna.range).all(axis=1) & rest.solved
    enough = np.flatnonzero(bent >= angle)
    if not len(enough) or not within[: enough[0] + 1].all():
        return None
    return float(np.interp(angle, bent[: enough[0] + 1], force[: enough[0] + 1]))


def _measured_anew(config: TouchConfig, traverses: Sequence[Traverse]) -> dict[str, Any]:
    """All profiles together, with another configuration of the control or the truth."""
    valid = [c for c in compare(config, traverses) if c is not None]
    return Pool(valid, config.trials, config.antenna.sensor.rate).measure(valid)


def _averaged(config: TouchConfig, traverses: Sequence[Traverse], time: float) -> dict[str, Any]:
    """With another T_avg."""
    conditioning = config.conditioning.model_copy(update={"averaging_time": time})
    changed = config.model_copy(update={"conditioning": conditioning})
    pooled = _measured_anew(changed, traverses)
    return {"averaging_time_s": time, **{key: pooled[key] for key in _AVERAGED}}


def _truths(config: TouchConfig) -> list[tuple[float, float]]:
    """Other ways to tell the truth: force [N] and merge time [s]."""
    force, merge = config.contact_force, config.merge_time
    return [(force, merge), (0.0, merge), (10 * force, merge), (force, 0.0), (force, 2 * merge)]


def _with_truth(
    config: TouchConfig, traverses: Sequence[Traverse], force: float, merge: float
) -> dict[str, Any]:
    changed = config.model_copy(update={"contact_force": force, "merge_time": merge})
    pooled = _measured_anew(changed, traverses)
    keys = ("contact_share", *_SHORT)
    return {"contact_force_n": force, "merge_time_s": merge, **{key: pooled[key] for key in keys}}


F1 = Measure("f1", "F1", interval="f1_95")
ONSET = Measure("onset.median_ms", "onset latency", "ms", form=".0f")
RELEASE = Measure("release.median_ms", "release latency", "ms", form=".0f")
PROFILE = (
    Measure("contact_share", "time in contact", "%", form=".0f", scale=100.0),
    F1,
    Measure("precision", "precision", interval="precision_95"),
    Measure("recall", "recall", interval="recall_95"),
    Measure("contacts", "contacts", form="d"),
    Measure("missed", "  missed", form="d"),
    Measure("missed_per_m", "  missed per metre", interval="missed_per_m_95"),
    Measure("alarms", "alarms", form="d"),
    Measure("false", "  false", form="d"),
    Measure("false_per_m", "  false per metre", interval="false_per_m_95"),
    ONSET,
    Measure("onset.p90_ms", "  90 %", "ms", form=".0f"),
    Measure("onset.median_mm", "  way until then", "mm", form=".0f"),
    RELEASE,
    Measure("release.p90_ms", "  90 %", "ms", form=".0f"),
    Measure("auc", "area under ROC, level", form=".3f", interval="auc_95"),
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
    cells = {(row["profile"], row[part]): row for row in rows}
    lines = []
    for value in dict.fromkeys(row[part] for row in rows):
        for name, label in (("f1", f"{value:{form}}"), ("f1_95", "  95 %")):
            lines.append((label, [shown(cells[p, value][name]) for p in profiles]))
    return Table(title, list(profiles), lines)


def sentence(result: Mapping[str, Any]) -> str:
    """How well contact is sensed by each profile."""
    scores = ", ".join(
        f"{name} {shown(row['f1'])}" + (f" ({shown(row['f1_95'])})" if row["f1_95"] else "")
        for name, row in result["profiles"].items()
    )
    over = few([result["trials"]]) or f"Intervals are 95 %, over {result['trials']} trials."
    return f"Contact is sensed with an F1 of {scores}, 1 being without error. {over}"


def films(config: TouchConfig, trial: int) -> dict[str, Callable[[], Film]]:
    """A film of each profile, at the wall and the speed of the example."""
    return {profile: partial(record, config, profile, trial) for profile in config.profiles}


def record(config: TouchConfig, profile: Profile, trial: int) -> Film:
    """Run one traverse and record it; then the control reads it.

    Raises:
        BadInputError: The physics became invalid.
    """
    from antennate.telemetry import film  # slow to import

    recorder, models, ticks = film.FilmRecorder(), [], 0
    wall, speed = config.example()

    def watch(bench: Bench) -> None:
        nonlocal ticks
        models[:] = [bench.model]
        middle = bench.joints().mean(axis=0)
        t = ticks / config.antenna.sensor.rate
        recorder.take(t, bench.data.qpos, middle, tick=ticks)
        ticks += 1

    traverse = run_traverse(config, wall, speed, profile, trial, watch)
    sensed = compare(config, [traverse])[0]
    if sensed is None:
        raise BadInputError(f"video: {profile}: the physics became invalid: {traverse.reason}")
    at = recorder.values("tick")

    def column(values: Floats) -> Floats:
        return values[at][:, np.newaxis]

    level = 1.0 / (1.0 + np.exp(-column(sensed.level)))
    states = np.stack([sensed.alarm[at], sensed.truth[at]], axis=1).astype(np.int64)
    return recorder.film(
        f"{profile}, {wall}, trial {trial}",
        models[0],
        film.bench_shot(config.antenna),
        [
            film.counts_trace(column(readings(config, [traverse])[:, 0])),
            film.level_trace(level, config.rule.threshold),
            film.trace("force [N]", column(traverse.force)),
        ],
        film.contact_bands(states, ("sensed", "true")),
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    TouchConfig,
    lambda config, workers, on_step, _: run(config, workers, on_step),
    tables,
    sentence,
    films=films,
    parts="traverses",
    captions={
        "touch": "F1 by speed and by wall, and latencies by speed, a colour for each profile.",
        "touch_roc": "True against false contacts for every threshold, with the default "
        "one, and F1 over the threshold.",
        "touch_trace": "One traverse: the wall with shapes of the antenna, flex, bending "
        "level, and contact against truth.",
    },
    explained="docs/results.md",
)
