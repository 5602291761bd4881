"""What the trials of `antennate climb` come to: on steps, on other grounds, and those that feel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from antennate.control.climbing.rule import Ground as Felt
from antennate.experiments.climb.config import BUMPY, CLIFF, GROUND, ClimbConfig
from antennate.experiments.climb.grounds import FLAT, KINDS, Terrain
from antennate.experiments.climb.result import (
    REFERENCE,
    Cliff,
    Climbed,
    Climbing,
    ClimbResult,
    Crossing,
    FalseClimbs,
    Height,
    OnGround,
    Pair,
    PlanError,
    ProbeError,
    Sensing,
    Walk,
)
from antennate.experiments.climb.rows import Probe
from antennate.jackknife import ENOUGH, jackknife95
from antennate.studies import statistics
from antennate.studies.columns import Ends, Frame
from antennate.studies.pooling import by, mean, pooled, total, valid
from antennate.types import Floats

PLAN_BAND = (-0.06, 0.04)
"""Where the error of the plan is to lie in PLAN_SHARE of the crossings [m], set beforehand."""
PLAN_SHARE = 0.9
STEPS = [name for name in GROUND if name.startswith("step") and (GROUND[name][1] or 0.0) <= 0.10]
"""Steps over which the error of the probe is summed up: 2 to 10 cm."""
VERDICTS = tuple(verdict.name for verdict in Felt)


def summarise(config: ClimbConfig, rows: Frame) -> ClimbResult:
    """The result of the rows of a run."""
    return ClimbResult(
        seed=config.seed,
        time_limit_s=config.time_limit,
        heights_m=list(config.heights),
        climbing=climbing(config, rows),
        grounds=crossing(config, rows),
        sensing=sensing(config, rows),
    )


def climbing(config: ClimbConfig, rows: Frame) -> list[Climbing]:
    """The climbs with each divisor: by condition, by height, in pairs, and the plan's error."""
    climbs = rows[rows["part"] == "climbing"]
    return [_steps(config, divisor, climbs) for divisor in config.divisors]


def _steps(config: ClimbConfig, divisor: float, rows: Frame) -> Climbing:
    by_name = by(rows[rows["divisor"] == divisor], "condition", config.conditions)
    return Climbing(
        divisor=divisor,
        conditions={name: pooled(Climbed, some) for name, some in by_name.items()},
        heights={
            name: [
                pooled(Height, some[some["height_m"] == height], height_m=height)
                for height in config.heights
            ]
            for name, some in by_name.items()
        },
        pairs=pairs(by_name),
        plan=plan_errors(by_name["climb"]["plan_error_m"]) if "climb" in by_name else None,
    )


def pairs(by_name: Mapping[str, Frame]) -> dict[str, Pair]:
    """`climb` beside each other condition, trial by trial, over all grounds of these rows."""
    tests: dict[str, Pair] = {}
    first = by_name.get("climb")
    for name, second in by_name.items():
        if name == "climb" or first is None:
            continue
        both = valid(first).merge(valid(second), on=["ground", "trial"], suffixes=("", "_other"))
        if len(both):
            test = statistics.mcnemar((both[["outcome", "outcome_other"]] == "success").to_numpy())
            tests[name] = Pair(
                trials=test.trials,
                only_climb=test.only_first,
                only_other=test.only_second,
                mcnemar_p=test.mcnemar_p,
            )
    return tests


def plan_errors(told: Sequence[str]) -> list[PlanError]:
    """Error of the plan when the centre of each link crossed the edge, head first, then all.

    Args:
        told: The column `plan_error_m`.
    """
    by_link: dict[int, list[float]] = {}
    for text in told:
        for word in text.split():
            link, _, error = word.partition(":")
            by_link.setdefault(int(link), []).append(float(error))
    named = {f"link {link}" if link else "head": by_link[link] for link in sorted(by_link)}
    named["all links"] = [error for errors in by_link.values() for error in errors]
    return [_spread(name, np.array(errors)) for name, errors in named.items()]


def _spread(link: str, errors: Floats) -> PlanError:
    if not len(errors):
        return PlanError(link=link, crossings=0)
    low, middle, high = (100.0 * np.percentile(errors, [5.0, 50.0, 95.0])).tolist()
    low_end, high_end = PLAN_BAND
    inside = (errors >= low_end) & (errors <= high_end)
    return PlanError(
        link=link,
        crossings=len(errors),
        low_cm=low,
        middle_cm=middle,
        high_cm=high,
        within=float(inside.mean()),
    )


def crossing(config: ClimbConfig, rows: Frame) -> list[Crossing]:
    """The crossings with each divisor, by condition and ground, in pairs; and speed on the flat."""
    crosses = rows[rows["part"] == "ground"]
    return [_grounds(config, divisor, crosses) for divisor in config.divisors if config.grounds]


def _grounds(config: ClimbConfig, divisor: float, rows: Frame) -> Crossing:
    by_name = by(rows[rows["divisor"] == divisor], "condition", config.conditions)
    crossed = [terrain for terrain in config.terrains if terrain.scene != FLAT]
    flat = {name: some[some["ground"] == FLAT] for name, some in by_name.items()}
    return Crossing(
        divisor=divisor,
        grounds={
            name: [_on(terrain, some) for terrain in crossed] for name, some in by_name.items()
        },
        pairs={
            kind: pairs({name: _of_kind(kind, some) for name, some in by_name.items()})
            for kind in KINDS
            if any(terrain.scene == kind for terrain in crossed)
        },
        flat=walks(flat) if FLAT in config.grounds else None,
    )


def _of_kind(kind: str, rows: Frame) -> Frame:
    return rows[rows["ground"].map(lambda word: Terrain.of(word).scene) == kind]


def _on(terrain: Terrain, rows: Frame) -> OnGround:
    """The trials of one condition on one ground."""
    own = rows[rows["ground"] == terrain.word]
    return pooled(OnGround, own, ground=terrain.word, scene=terrain.scene, size=terrain.size)


def walks(by_name: Mapping[str, Frame]) -> dict[str, Walk]:
    """Speed of each condition on the flat floor, and its ratio to that of `level` in pairs."""
    told = {name: rows.dropna(subset=["speed_m_s"]) for name, rows in by_name.items()}
    found: dict[str, Walk] = {}
    for name, rows in by_name.items():
        own = told[name]
        both = own.merge(told.get(REFERENCE, own[:0]), on="trial", suffixes=("", "_other"))
        speeds = np.column_stack([both["speed_m_s"], both["speed_m_s_other"]]).astype(float)
        speed, ends = statistics.mean95(own["speed_m_s"].to_numpy(float), 0.0)
        ratio, ratio_95 = ratio95(speeds)
        found[name] = Walk(
            trials=len(own),
            speed_m_s=speed if len(own) else None,
            speed_95=ends,
            ratio=ratio,
            ratio_95=ratio_95,
            climbs=mean(valid(rows), "climbs"),
        )
    return found


def ratio95(speeds: Floats) -> tuple[float | None, Ends | None]:
    """Ratio of two mean speeds of the same trials, shape (n, 2), with its jackknife interval."""
    if not len(speeds):
        return None, None
    sums = speeds.sum(axis=0)
    ratio = float(sums[0] / sums[1])
    if len(speeds) < ENOUGH:
        return ratio, None
    left = np.log(sums - speeds)
    low, high = np.exp(jackknife95(np.log(ratio), left[:, 0] - left[:, 1])).tolist()
    return ratio, (low, high) if low == low else None


def sensing(config: ClimbConfig, rows: Frame) -> list[Sensing]:
    """What `climb` felt, with each divisor."""
    feels = rows[rows["part"] == "sensing"]
    return [
        _felt(divisor, feels[feels["divisor"] == divisor])
        for divisor in config.divisors
        if config.sensing
    ]


def _felt(divisor: float, every: Frame) -> Sensing:
    rows = valid(every)
    by_ground = by(rows, "ground", GROUND)
    stops = by_ground[CLIFF]["outcome"] == "stopped"
    stopped, trials = int(stops.sum()), len(stops)
    return pooled(
        Sensing,
        every,
        divisor=divisor,
        confusion={
            name: {verdict: int((some["verdict"] == verdict).sum()) for verdict in VERDICTS}
            for name, some in by_ground.items()
        },
        felt={name: pooled(Probe, some) for name, some in by_ground.items()},
        heights=probe_error(rows),
        false_climbs={name: false_climbs(by_ground[name]) for name in (FLAT, BUMPY)},
        cliff=Cliff(trials=trials, stopped=stopped, wilson95=statistics.wilson95(stopped, trials)),
    )


def probe_error(rows: Frame) -> ProbeError:
    """Height by the probe against the true one, over STEPS."""
    steps = rows[rows["ground"].isin(STEPS)]
    told = steps[steps["verdict"] == "STEP_UP"]
    off = told["felt_height_m"].astype(float) - told["height_m"].astype(float)
    errors = off.dropna().to_numpy()
    known = len(errors) > 0
    return ProbeError(
        steps=len(steps),
        told=len(errors),
        bias_m=float(errors.mean()) if known else None,
        rmse_m=float(np.sqrt((errors**2).mean())) if known else None,
    )


def false_climbs(rows: Frame) -> FalseClimbs:
    """Climbs begun where there is no step, over time and way."""
    number, time, way = (total(rows, name) for name in ("climbs", "time_s", "walked_m"))
    per_1000_s, per_1000_s_95 = _rate(number, time / 1000.0)
    per_m, per_m_95 = _rate(number, way)
    return FalseClimbs(
        false_climbs=number,
        time_s=time,
        way_m=way,
        per_1000_s=per_1000_s,
        per_1000_s_95=per_1000_s_95,
        per_m=per_m,
        per_m_95=per_m_95,
    )


def _rate(number: int, amount: float) -> tuple[float | None, Ends | None]:
    """A Poisson count over an amount, and its interval."""
    if not amount:
        return None, None
    low, high = statistics.poisson95(number)
    return number / amount, (low / amount, high / amount)
