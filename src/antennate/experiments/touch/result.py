"""From traverses to the tables of `antennate touch`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from antennate.antenna import sensor
from antennate.antenna import statics as mechanics
from antennate.antenna.statics import Chain
from antennate.control.conditioning import bending_level
from antennate.experiments import reading
from antennate.experiments.touch import sensing
from antennate.experiments.touch.config import TouchConfig
from antennate.experiments.touch.measures import Pool, roc
from antennate.experiments.touch.sensing import Comparison, ContactCriteria
from antennate.experiments.touch.traverse import Traverse
from antennate.params import ConditioningParams
from antennate.types import Floats

SCHEMA = 1
_FLEX = np.linspace(0.0, 2.0 * np.pi, 20001)
_STRONGEST = 1.0
"""Largest force tried at the tip [N]."""


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


def criteria(
    config: TouchConfig,
    force: float | None = None,
    merge: float | None = None,
    averaging: float | None = None,
) -> ContactCriteria:
    """How the truth is told; what is given replaces the configuration."""
    rate = config.antenna.sensor.rate
    return ContactCriteria(
        force=config.contact_force if force is None else force,
        merge=round((config.merge_time if merge is None else merge) * rate),
        grace=round((averaging or config.conditioning.averaging_time) * rate),
    )


def score(
    config: TouchConfig,
    traverses: Sequence[Traverse],
    averaging: float | None = None,
    rule: ContactCriteria | None = None,
) -> list[Comparison]:
    """Let the control read all valid traverses, those of one speed side by side.

    Args:
        config: Sensor and control.
        traverses: What the engine says.
        averaging: T_avg instead of the configured one [s].
        rule: How the truth is told, instead of the configured way.
    """
    rule = rule or criteria(config, averaging=averaging)
    conditioning = config.conditioning
    if averaging is not None:
        conditioning = conditioning.model_copy(update={"averaging_time": averaging})
    valid = [t for t in traverses if not t.course.reason]
    found: dict[int, Comparison] = {}
    for speed in config.speeds:
        batch = [t for t in valid if t.speed == speed]
        if batch:
            found |= _compare_batch(config, conditioning, rule, batch)
    return [found[id(t)] for t in valid]


def _compare_batch(
    config: TouchConfig,
    conditioning: ConditioningParams,
    rule: ContactCriteria,
    batch: Sequence[Traverse],
) -> dict[int, Comparison]:
    ticks = len(batch[0].course.x)
    noises = {
        trial: reading.noise(
            config.antenna.sensor, np.random.default_rng([config.seed, trial, 1]), ticks
        )
        for trial in {t.trial for t in batch}
    }
    counts = reading.recorded(
        config.antenna.sensor,
        np.stack([t.course.flex for t in batch], axis=1),
        np.stack([noises[t.trial] for t in batch], axis=1),
    )
    sensed = sensing.sense(conditioning, config.rule, counts, 1.0 / config.antenna.sensor.rate)
    level = sensing.logit(sensed.b)
    comparisons = {}
    for i, one in enumerate(batch):
        truth = sensing.true_state(rule, one.course.force)
        alarm = sensed.alarm[:, i]
        comparisons[id(one)] = Comparison(
            wall=one.wall,
            speed=one.speed,
            profile=one.profile,
            trial=one.trial,
            metres=float(one.course.x[-1] - one.course.x[0]),
            truth=truth,
            alarm=alarm,
            level=level[:, i],
            flex=one.course.flex,
            matches=sensing.compare(truth, alarm, rule),
        )
    return comparisons


def result(
    config: TouchConfig, traverses: Sequence[Traverse], comparisons: Sequence[Comparison]
) -> dict[str, Any]:
    """The content of result.json."""
    pool = Pool(comparisons, config.trials, config.antenna.sensor.rate)

    def of(**wanted: Any) -> dict[str, Any]:
        group = [v for v in comparisons if all(getattr(v, k) == w for k, w in wanted.items())]
        names = {"speed_m_s" if k == "speed" else k: w for k, w in wanted.items()}
        return {**names, **pool.measure(group)}

    walls, speeds, profiles = config.walls, config.speeds, config.profiles
    mine = {p: [v for v in comparisons if v.profile == p] for p in profiles}
    return {
        "schema": SCHEMA,
        "command": "touch",
        "seed": config.seed,
        "trials": config.trials,
        "invalid": len(traverses) - len(comparisons),
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
        "averaging": [_averaged(config, traverses, t) for t in config.averaging_times],
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
    antenna = mechanics.with_profile(config.antenna, profile)
    chain = Chain.of(antenna)
    force = np.geomspace(1e-4, _STRONGEST, 400)
    load = np.stack([np.zeros_like(force), force], axis=1)
    rest = mechanics.equilibrium(chain, np.full(len(force), chain.length), load, follower=True)
    bent = rest.angles[:, : antenna.sensed_hinges].sum(axis=1)
    within = (abs(rest.angles) < antenna.range).all(axis=1) & rest.solved
    enough = np.flatnonzero(bent >= angle)
    if not len(enough) or not within[: enough[0] + 1].all():
        return None
    return float(np.interp(angle, bent[: enough[0] + 1], force[: enough[0] + 1]))


_SHORT = ("f1", "f1_95", "precision", "recall", "contacts", "missed", "false_per_m")


def _averaged(config: TouchConfig, traverses: Sequence[Traverse], time: float) -> dict[str, Any]:
    """All profiles together with another T_avg."""
    comparisons = score(config, traverses, averaging=time)
    found = Pool(comparisons, config.trials, config.antenna.sensor.rate).measure(comparisons)
    return {
        "averaging_time_s": time,
        **{key: found[key] for key in (*_SHORT, "onset", "release", "auc", "auc_95")},
    }


def _truths(config: TouchConfig) -> list[tuple[float, float]]:
    """Other ways to tell the truth: force [N] and merge time [s]."""
    force, merge = config.contact_force, config.merge_time
    return [(force, merge), (0.0, merge), (10 * force, merge), (force, 0.0), (force, 2 * merge)]


def _told(
    config: TouchConfig, traverses: Sequence[Traverse], force: float, merge: float
) -> dict[str, Any]:
    comparisons = score(config, traverses, rule=criteria(config, force=force, merge=merge))
    found = Pool(comparisons, config.trials, config.antenna.sensor.rate).measure(comparisons)
    keys = ("contact_share", *_SHORT)
    return {"contact_force_n": force, "merge_time_s": merge, **{key: found[key] for key in keys}}


def rows(
    seed: int, traverses: Sequence[Traverse], comparisons: Sequence[Comparison]
) -> list[TouchRow]:
    """One row for every traverse, in their order."""
    waiting = iter(comparisons)
    return [_row(seed, t, None if t.course.reason else next(waiting)) for t in traverses]


def _row(seed: int, one: Traverse, comparison: Comparison | None) -> TouchRow:
    empty = TouchRow(
        seed=seed,
        trial=one.trial,
        wall=one.wall,
        speed_m_s=one.speed,
        profile=one.profile,
        status="invalid" if comparison is None else "valid",
        overlap_m=one.overlap,
        reason=one.course.reason,
    )
    if comparison is None:
        return empty
    matches, truth, alarm = comparison.matches, comparison.truth, comparison.alarm
    whole = int(truth.sum() + alarm.sum())
    return replace(
        empty,
        contact_share=float(truth.mean()),
        f1=2.0 * int((truth & alarm).sum()) / whole if whole else None,
        contacts=len(matches.contacts),
        missed=int((~matches.found).sum()),
        alarms=matches.alarms,
        false=matches.false,
        largest_flex_rad=_largest(one.course.flex),
        largest_force_n=_largest(one.course.force),
    )


def _largest(values: Floats) -> float:
    return float(abs(values).max())
