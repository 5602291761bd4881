"""What is told of the trials of each controller, and of two controllers on the same trials."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import combinations
from typing import Any

import numpy as np

from antennate.experiments.tunnel.monitor import TrialResult
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.studies import statistics
from antennate.studies.measures import Measure, count, largest, mean, smallest, summarise, total

SHARES = {
    "forward": "forward [% of time]",
    "turn_l": "turn left",
    "turn_r": "turn right",
    "reverse": "reverse",
    "hold": "hold",
}


def _share(label: str, name: str) -> Measure:
    return Measure(f"share.{name}", label, of=mean, form=".1f", scale=100.0, least=0.0, most=1.0)


_SECONDS = (
    Measure("restricted_mean_time_s", "restricted mean time", "s", form=".1f"),
    Measure("restricted_mean_time_95", "  95 %", "s", form=".1f"),
)
_SHARES = (
    Measure("restricted_mean_share", "restricted mean time", "% of limit", form=".1f", scale=100.0),
    Measure("restricted_mean_share_95", "  95 %", "% of limit", form=".1f", scale=100.0),
)
CONTROLLER = (
    Measure("trials", "trials", form="d"),
    Measure("successes", "successes", of=count("outcome", "success"), form="d"),
    Measure("success_share", "  share", "%", form=".0f", scale=100.0),
    Measure("wilson95", "  Wilson 95 %", "%", form=".0f", scale=100.0),
    Measure("timeouts", "out of time", of=count("outcome", "timeout"), form="d"),
    Measure("left", "left the scene", of=count("outcome", "left"), form="d"),
    Measure("invalid", "invalid", form="d"),
    Measure("speed_m_s", "speed over successes", "m/s", form=".3f"),
    Measure("speed_95", "  95 %", "m/s", form=".3f"),
    Measure("progress_per_time_m_s", "progress over time", "m/s", form=".3f"),
    *_SECONDS,
    Measure("stuck", "stuck episodes", of=total, form="d", least=0.0),
    Measure("recovered", "  recovered", of=total, form="d", least=0.0),
    *(_share(label, name) for name, label in SHARES.items()),
    Measure("force_mean_n", "contact force, mean", "N", of=mean, least=0.0),
    Measure("force_max_n", "contact force, largest", "N", of=largest, form=".1f", least=0.0),
    Measure("offset_m", "off the middle", "m", form=".3f", least=0.0),
    Measure("offset_95", "  95 %", "m", form=".3f"),
    Measure("spring_low_n_m", of=smallest),
    Measure("spring_high_n_m", "spring torque, most", "N·mm", of=largest, scale=1e3),
    Measure("spring_cycles", "  load cycles, most", of=largest, form="d", least=0.0),
)
TIME = Measure(
    *("time_s", "time, a failure as the limit", "s"), form=".1f", least=0.0, most="time_limit"
)
LIMIT = Measure("limit_s", "time limit", "s", form=".1f", least=0.0)
COLUMNS = (*CONTROLLER, TIME, LIMIT)
_SECONDS_APART = (
    Measure("time_difference_s", "difference", "s", form="+.1f"),
    Measure("time_difference_95", "  95 %", "s", form="+.1f"),
)
_SHARES_APART = (
    Measure("share_difference", "difference", "% of limit", form="+.1f", scale=100.0),
    Measure("share_difference_95", "  95 %", "% of limit", form="+.1f", scale=100.0),
)
PAIR = (
    Measure("trials", "valid in both", form="d"),
    Measure("only_first", "only the first", form="d"),
    Measure("only_second", "only the second", form="d"),
    Measure("both", "both succeeded", form="d"),
    Measure("both_time_s", "  time of each", "s", form=".1f", join=", "),
    Measure("mcnemar_p", "McNemar p", form=".3g"),
    *_SECONDS_APART,
    Measure("wilcoxon_p", "Wilcoxon p", form=".3g"),
    Measure("offset_difference_m", "off the middle", "m", form="+.3f"),
    Measure("offset_difference_95", "  95 %", "m", form="+.3f"),
)


def limit_of(rows: Sequence[TrialResult], wanted: float | None) -> float | None:
    """The time limit that all valid trials share [s], None where each has its own."""
    limits = {row.limit_s for row in rows if row.outcome != "invalid"} or {TIME_LIMIT}
    return wanted or (limits.pop() if len(limits) == 1 else None)


def shown(limit: float | None) -> tuple[Sequence[Measure], Sequence[Measure]]:
    """What tables show of one controller, and of two: in shares where there is no limit of all."""
    if limit is not None:
        return CONTROLLER, PAIR
    shares = dict(zip((*_SECONDS, *_SECONDS_APART), (*_SHARES, *_SHARES_APART), strict=True))
    one, two = ([shares.get(measure, measure) for measure in each] for each in (CONTROLLER, PAIR))
    return one, two


def summary(rows: Sequence[TrialResult], limit: float | None) -> dict[str, Any]:
    """One controller in numbers; invalid trials are counted and left out of all others.

    The restricted mean time lies between 0 and the time limit [s], and so does its interval; it is
    None where trials have limits of their own. The mean share of the limits is there always.
    """
    valid = [row for row in rows if row.outcome != "invalid"]
    won = [row for row in valid if row.outcome == "success"]
    times = np.array([row.time_s for row in valid])
    limits = np.array([row.limit_s for row in valid])
    share, share_ends = statistics.mean95(times / limits, 0.0, 1.0, restricted=True)
    restricted, ends = None, None
    if limit is not None:
        restricted, ends = statistics.mean95(times, 0.0, limit, restricted=True)
    progress = sum(row.progress_m for row in valid)
    speed, speeds = statistics.mean95(np.array([r.progress_m / r.time_s for r in won]), 0.0)
    offset, offsets = statistics.mean95(np.array([r.offset_m for r in won]), 0.0)
    return {
        "trials": len(rows),
        "invalid": len(rows) - len(valid),
        "first_reason": next((row.reason for row in rows if row.outcome == "invalid"), None),
        **summarise(CONTROLLER, valid),
        "success_share": len(won) / len(valid) if valid else None,
        "wilson95": statistics.wilson95(len(won), len(valid)) if valid else None,
        "speed_m_s": speed if won else None,
        "speed_95": speeds,
        "time_over_successes_s": mean("time_s", won),
        "progress_per_time_m_s": progress / float(times.sum()) if valid else None,
        "restricted_mean_time_s": restricted if valid else None,
        "restricted_mean_time_95": ends,
        "restricted_mean_share": share if valid else None,
        "restricted_mean_share_95": share_ends,
        "offset_m": offset if math.isfinite(offset) else None,
        "offset_95": offsets if math.isfinite(offset) else None,
    }


def paired(
    by_controller: Mapping[str, Sequence[TrialResult]], limit: float | None
) -> dict[str, Any]:
    """Every two controllers on the trials that are valid in both, with the time limit [s].

    Where there is none of all, the times that are compared are shares of the limit of each trial.
    """
    tests = {}
    for first, second in combinations(by_controller, 2):
        ours, theirs = (
            {row.trial: row for row in by_controller[name] if row.outcome != "invalid"}
            for name in (first, second)
        )
        both = sorted(ours.keys() & theirs.keys())
        if both:
            times = np.array([[rows[k].time_s for k in both] for rows in (ours, theirs)])
            ends = np.array([[rows[k].outcome for k in both] for rows in (ours, theirs)])
            won = ends == "success"
            units = np.array([ours[k].limit_s for k in both]) if limit is None else 1.0
            first_t, second_t = times / units
            test = statistics.compare(won[0], won[1], first_t, second_t, limit or 1.0)
            comparison = asdict(test)
            if limit is None:
                comparison["share_difference"] = comparison.pop("time_difference_s")
                comparison["share_difference_95"] = comparison.pop("time_difference_95")
                means = times[:, won.all(axis=0)].mean(axis=1).tolist() if test.both else None
                comparison["both_time_s"] = means and tuple(means)
            apart = np.array([ours[k].offset_m - theirs[k].offset_m for k in both])
            offset, offsets = statistics.mean95(apart[won.all(axis=0)])
            known = math.isfinite(offset)
            tests[f"{first}-{second}"] = {
                "trials": len(both),
                **comparison,
                "offset_difference_m": offset if known else None,
                "offset_difference_95": offsets if known else None,
            }
    return tests
