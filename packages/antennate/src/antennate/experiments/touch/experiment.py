"""Touching walls: the sensed state of contact against the engine's, by wall, speed and profile."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from itertools import combinations, product
from typing import Any, TypeVar

import numpy as np

from antennate.antenna import sensor
from antennate.antenna.statics import Chain, about, equilibrium, with_profile
from antennate.control.conditioning import bending_level
from antennate.experiments.touch.measures import Pool, roc
from antennate.experiments.touch.physics import TouchConfig, Traverse, run_traverse
from antennate.experiments.touch.result import (
    Answers,
    Averaged,
    Cell,
    Measures,
    Needed,
    ProfileMeasures,
    SpeedMeasures,
    TouchResult,
    TouchRow,
    Truth,
    WallMeasures,
)
from antennate.experiments.touch.sensing import Comparison, compare
from antennate.studies.columns import column_of, shown
from antennate.studies.experiment import Experiment
from antennate.studies.pool import Workers, gather
from antennate.studies.tables import Table, few
from antennate.studies.trials import OnStep, no_step

_FLEX = np.linspace(0.0, 2.0 * np.pi, 20001)
_STRONGEST = 1.0
"""Largest force tried at the tip [N]."""
F1 = column_of(Measures, "f1")
_AVERAGED = {
    "f1": ".3f",
    "recall": ".3f",
    "false_per_m": ".2f",
    "onset.median_ms": ".0f",
    "release.median_ms": ".0f",
    "auc": ".3f",
}
"""Columns of the table of T_avg, without intervals, and their formats: they differ by little."""
Part = TypeVar("Part", bound=Answers)


@dataclass(frozen=True, slots=True)
class TouchOutcome:
    """All traverses in the order of walls, speeds, profiles and trials, and what was sensed.

    Attributes:
        comparisons: For each what was sensed; None where the physics is invalid.
    """

    config: TouchConfig
    traverses: list[Traverse]
    comparisons: list[Comparison | None]
    found: TouchResult

    def result(self) -> TouchResult:
        """What they come to."""
        return self.found

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
    known: dict[str, Any] = {
        "seed": plan.config.seed,
        "trial": plan.trial,
        "wall": plan.wall,
        "speed_m_s": plan.speed,
        "profile": plan.profile,
        "overlap_m": plan.overlap,
    }
    if comparison is None:
        return TouchRow(status="invalid", reason=traverse.reason, **known)
    truth, alarm, matches = comparison.truth, comparison.alarm, comparison.matches
    whole = int(truth.sum() + alarm.sum())
    return TouchRow(
        status="valid",
        contact_share=float(truth.mean()),
        f1=2.0 * int((truth & alarm).sum()) / whole if whole else None,
        contacts=len(matches.contacts),
        missed=int((~matches.found).sum()),
        alarms=matches.alarms,
        false=matches.false,
        largest_flex_rad=float(abs(traverse.flex).max()),
        largest_force_n=float(abs(traverse.force).max()),
        **known,
    )


def run(config: TouchConfig, workers: int | Workers = 1, on_step: OnStep = no_step) -> TouchOutcome:
    """Run all traverses, then let the control read them."""
    trials = range(config.trials)
    tasks = list(product([config], config.walls, config.speeds, config.profiles, trials))
    traverses = gather(run_traverse, tasks, workers, on_step)
    comparisons = compare(config, traverses)
    return TouchOutcome(config, traverses, comparisons, _result(config, traverses, comparisons))


def _result(
    config: TouchConfig, traverses: Sequence[Traverse], comparisons: Sequence[Comparison | None]
) -> TouchResult:
    """What all traverses come to."""
    valid = [c for c in comparisons if c is not None]
    pool = Pool(valid, config.trials, config.antenna.sensor.rate)

    def of(kind: type[Part], **wanted: Any) -> Part:
        group = [v for v in valid if all(getattr(v, k) == w for k, w in wanted.items())]
        names = {"speed_m_s" if k == "speed" else k: w for k, w in wanted.items()}
        return kind(**names, **vars(pool.measure(group)))

    walls, speeds, profiles = config.walls, config.speeds, config.profiles
    mine = {p: [v for v in valid if v.profile == p] for p in profiles}
    threshold, flex_at = config.rule.threshold, partial(_flex_at, config)
    return TouchResult(
        seed=config.seed,
        trials=config.trials,
        invalid=len(traverses) - len(valid),
        rate_hz=config.antenna.sensor.rate,
        travel_m=config.travel,
        contact_force_n=config.contact_force,
        merge_time_s=config.merge_time,
        averaging_time_s=config.conditioning.averaging_time,
        threshold=threshold,
        hysteresis=config.rule.hysteresis,
        needed=_needed(config),
        profiles={p: of(ProfileMeasures, profile=p) for p in profiles},
        by_speed=[of(SpeedMeasures, profile=p, speed=s) for p in profiles for s in speeds],
        by_wall=[of(WallMeasures, profile=p, wall=w) for p in profiles for w in walls],
        cells=[
            of(Cell, wall=w, speed=s, profile=p) for w in walls for s in speeds for p in profiles
        ],
        pairs={
            f"{a}-{b}": pool.f1_difference(mine[a], mine[b]) for a, b in combinations(profiles, 2)
        },
        roc={p: roc(mine[p], threshold, flex_at) for p in profiles},
        averaging=[_averaged(config, traverses, time) for time in config.averaging_times],
        truths=[_with_truth(config, traverses, *way) for way in _truths(config)],
    )


def _needed(config: TouchConfig) -> Needed:
    """Flex at which b reaches theta, and the force normal to the tip that bends so far."""
    angle = _flex_at(config, config.rule.threshold)
    forces = {p: None if angle is None else _tip_force(config, p, angle) for p in config.profiles}
    return Needed(flex_rad=angle, tip_force_n=dict(forces))


def _flex_at(config: TouchConfig, level: float) -> float | None:
    """Least steady flex without noise at which b reaches a level [rad]; None if none does."""
    b = bending_level(config.conditioning, sensor.counts(config.antenna.sensor, _FLEX))
    enough = np.flatnonzero(b >= level)
    return float(_FLEX[enough[0]]) if len(enough) else None


def _tip_force(config: TouchConfig, profile: str, angle: float) -> float | None:
    """Force that turns with the tip and bends the flex sensor by an angle [rad]; None above 1 N."""
    antenna = with_profile(config.antenna, profile)
    chain = Chain.of(antenna)
    force = np.geomspace(1e-4, _STRONGEST, 400)
    load = np.stack([np.zeros_like(force), force], axis=1)
    rest = equilibrium(chain, np.full(len(force), chain.length), load, follower=True)
    bent = rest.angles[:, : antenna.sensed_hinges].sum(axis=1)
    within = (abs(rest.angles) < np.array(antenna.hinge_ranges)).all(axis=1) & rest.solved
    enough = np.flatnonzero(bent >= angle)
    if not len(enough) or not within[: enough[0] + 1].all():
        return None
    return float(np.interp(angle, bent[: enough[0] + 1], force[: enough[0] + 1]))


def _measured_anew(
    kind: type[Part], config: TouchConfig, traverses: Sequence[Traverse], **given: Any
) -> Part:
    """All profiles together, with another configuration of the control or the truth."""
    valid = [c for c in compare(config, traverses) if c is not None]
    whole = Pool(valid, config.trials, config.antenna.sensor.rate).measure(valid)
    known = {each.name for each in fields(kind)}
    return kind(**{k: v for k, v in vars(whole).items() if k in known}, **given)


def _averaged(config: TouchConfig, traverses: Sequence[Traverse], time: float) -> Averaged:
    """With another T_avg."""
    conditioning = config.conditioning.model_copy(update={"averaging_time": time})
    changed = config.model_copy(update={"conditioning": conditioning})
    return _measured_anew(Averaged, changed, traverses, averaging_time_s=time)


def _truths(config: TouchConfig) -> list[tuple[float, float]]:
    """Other ways to tell the truth: force [N] and merge time [s]."""
    force, merge = config.contact_force, config.merge_time
    return [(force, merge), (0.0, merge), (10 * force, merge), (force, 0.0), (force, 2 * merge)]


def _with_truth(
    config: TouchConfig, traverses: Sequence[Traverse], force: float, merge: float
) -> Truth:
    changed = config.model_copy(update={"contact_force": force, "merge_time": merge})
    given = {"contact_force_n": force, "merge_time_s": merge}
    return _measured_anew(Truth, changed, traverses, **given)


def tables(result: TouchResult) -> Sequence[Table]:
    """Profiles, speeds and walls, and what contact must do to be felt."""
    profiles, needed = result.profiles, result.needed
    forces = ", ".join(
        f"{name} {shown(force or None, '.0f', 1e3)} mN"
        for name, force in needed.tip_force_n.items()
    )
    return (
        Table.of(
            "Contact, sensed against true",
            profiles,
            note=f"{result.trials} trials of every wall and speed, {result.invalid} traverses "
            "invalid. Intervals are 95 %: of counts per\nmetre those of chance counts, of all else "
            "over trials.",
            preface=about(profiles),
        ),
        _grid("F1 by speed [m/s]", ((f"{row.speed_m_s:g}", row) for row in result.by_speed)),
        _grid("F1 by wall", ((row.wall, row) for row in result.by_wall)),
        Table.of(
            f"Averaging, all profiles (default {result.averaging_time_s:g} s)",
            {f"{row.averaging_time_s:g} s": row for row in result.averaging},
            [
                replace(column_of(Averaged, name), form=form, interval="")
                for name, form in _AVERAGED.items()
            ],
            f"The level reaches theta = {result.threshold:g} at a flex of "
            f"{shown(needed.flex_rad)} rad; a steady force normal to the tip\nthat bends so "
            f"far: {forces}.",
        ),
    )


def _grid(title: str, rows: Iterable[tuple[str, ProfileMeasures]]) -> Table:
    """One column per profile, and F1 with its interval for every speed or wall."""
    cells: dict[str, dict[str, ProfileMeasures]] = {}
    for name, row in rows:
        cells.setdefault(name, {})[row.profile] = row
    lines = [
        (label, [of.cell(row) for row in mine.values()])
        for name, mine in cells.items()
        for label, of in ((name, F1), (F1.ends.label, F1.ends))
    ]
    return Table(title, list(next(iter(cells.values()))), lines)


def sentence(result: TouchResult) -> str:
    """How well contact is sensed by each profile."""
    scores = ", ".join(
        f"{name} {shown(row.f1)}" + (f" ({shown(row.f1_95)})" if row.f1_95 else "")
        for name, row in result.profiles.items()
    )
    over = few([result.trials]) or f"Intervals are 95 %, over {result.trials} trials."
    return f"Contact is sensed with an F1 of {scores}, 1 being without error. {over}"


EXPERIMENT = Experiment.of_folder(
    __name__,
    TouchConfig,
    lambda config, workers, on_step, _: run(config, workers, on_step),
    tables,
    sentence,
    result=TouchResult,
    row=TouchRow,
    captions={
        "touch": "F1 by speed and by wall, and latencies by speed, a colour for each profile.",
        "touch_roc": "True against false contacts for every threshold, with the default "
        "one, and F1 over the threshold.",
        "touch_trace": "One traverse: the wall with shapes of the antenna, flex, bending "
        "level, and contact against truth.",
    },
)
