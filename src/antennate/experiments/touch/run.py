"""Touching walls: the sensed state of contact against the engine's, by wall, speed and profile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, product
from typing import Any

import numpy as np

from antennate.antenna import sensor
from antennate.antenna.statics import Chain, equilibrium, with_profile
from antennate.control.conditioning import bending_level
from antennate.experiments.touch.config import TouchConfig
from antennate.experiments.touch.measures import Pool, roc
from antennate.experiments.touch.sensing import Comparison, compare
from antennate.experiments.touch.traverse import Traverse, run_traverse
from antennate.studies.experiment import OnStep, no_step
from antennate.studies.pool import Workers, gather

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
        for one, found in zip(self.traverses, self.comparisons, strict=True):
            if found and (found.wall, found.speed, found.profile, found.trial) == wanted:
                return one, found
        return None


def _row(one: Traverse, found: Comparison | None) -> TouchRow:
    plan = one.plan
    key = (plan.config.seed, plan.trial, plan.wall, plan.speed, plan.profile)
    if found is None:
        return TouchRow(*key, "invalid", plan.overlap, reason=one.reason)
    truth, alarm = found.truth, found.alarm
    whole = int(truth.sum() + alarm.sum())
    return TouchRow(
        *(*key, "valid", plan.overlap),
        contact_share=float(truth.mean()),
        f1=2.0 * int((truth & alarm).sum()) / whole if whole else None,
        contacts=len(found.matches.contacts),
        missed=int((~found.matches.found).sum()),
        alarms=found.matches.alarms,
        false=found.matches.false,
        largest_flex_rad=float(abs(one.flex).max()),
        largest_force_n=float(abs(one.force).max()),
    )


def run(config: TouchConfig, workers: int | Workers = 1, on_step: OnStep = no_step) -> TouchOutcome:
    """Run all traverses, then let the control read them.

    Raises:
        WorkerError: A worker died.
    """
    trials = range(config.trials)
    tasks = list(product([config], config.walls, config.speeds, config.profiles, trials))
    traverses = gather(run_traverse, tasks, workers, on_step)
    found = compare(config, traverses)
    return TouchOutcome(config, traverses, found, _summary(config, traverses, found))


def _summary(
    config: TouchConfig, traverses: Sequence[Traverse], found: Sequence[Comparison | None]
) -> dict[str, Any]:
    """The content of result.json."""
    valid = [one for one in found if one is not None]
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
        "truths": [_told(config, traverses, *way) for way in _truths(config)],
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


def _with_flex(config: TouchConfig, found: dict[str, Any]) -> dict[str, Any]:
    """Beside the thresholds that stand out, the flex that reaches them."""
    for name in ("default", "best_f1"):
        found[name]["flex_rad"] = _flex_at(config, found[name]["theta"])
    return found


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
    valid = [one for one in compare(config, traverses) if one is not None]
    return Pool(valid, config.trials, config.antenna.sensor.rate).measure(valid)


def _averaged(config: TouchConfig, traverses: Sequence[Traverse], time: float) -> dict[str, Any]:
    """With another T_avg."""
    conditioning = config.conditioning.model_copy(update={"averaging_time": time})
    changed = config.model_copy(update={"conditioning": conditioning})
    found = _measured_anew(changed, traverses)
    return {"averaging_time_s": time, **{key: found[key] for key in _AVERAGED}}


def _truths(config: TouchConfig) -> list[tuple[float, float]]:
    """Other ways to tell the truth: force [N] and merge time [s]."""
    force, merge = config.contact_force, config.merge_time
    return [(force, merge), (0.0, merge), (10 * force, merge), (force, 0.0), (force, 2 * merge)]


def _told(
    config: TouchConfig, traverses: Sequence[Traverse], force: float, merge: float
) -> dict[str, Any]:
    changed = config.model_copy(update={"contact_force": force, "merge_time": merge})
    found = _measured_anew(changed, traverses)
    keys = ("contact_share", *_SHORT)
    return {"contact_force_n": force, "merge_time_s": merge, **{key: found[key] for key in keys}}
