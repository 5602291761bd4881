"""What is measured of each controller, and of two on the same trials; as numbers and in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from itertools import combinations
from typing import Any

import numpy as np

from antennate.control.loop import void_sentence
from antennate.control.readings import short_names
from antennate.control.registry import RIVAL, about, compared
from antennate.experiments.tunnel.physics import TrialResult
from antennate.sim.scenes.registry import TUNNEL
from antennate.sim.scenes.scene import TIME_LIMIT
from antennate.studies import statistics
from antennate.studies.measures import (
    Measure,
    Table,
    count,
    few,
    largest,
    mean,
    smallest,
    successes,
    summarise,
    total,
)

_APART, _MANY = 6, 30
"""Trials that one alone must succeed in, for McNemar's exact p, 2 / 2**6, to fall below 0.05; and
trials from which on nobody needs to be told."""
SHARES = {
    "forward": "forward [% of time]",
    "turn_l": "turn left",
    "turn_r": "turn right",
    "reverse": "reverse",
    "hold": "hold",
}
_SECONDS = Measure(
    *("restricted_mean_time_s", "restricted mean time", "s"),
    form=".1f",
    interval="restricted_mean_time_95",
)
_SHARES = Measure(
    *("restricted_mean_share", "restricted mean time", "% of limit"),
    form=".1f",
    scale=100.0,
    interval="restricted_mean_share_95",
)
_LOST = tuple(
    Measure(name, name, of=count("outcome", name), form="d") for name in ("overturned", "fell")
)
"""Of results that have such trials, as scenes of ground may; others do not name them."""
CONTROLLER = (
    Measure("trials", "trials", form="d"),
    Measure("successes", "successes", of=count("outcome", "success"), form="d"),
    Measure("success_share", "  share", "%", form=".0f", scale=100.0),
    Measure("wilson95", "  Wilson 95 %", "%", form=".0f", scale=100.0),
    Measure("timeouts", "out of time", of=count("outcome", "timeout"), form="d"),
    Measure("left", "left the scene", of=count("outcome", "left"), form="d"),
    Measure("invalid", "invalid", form="d"),
    Measure("speed_m_s", "speed over successes", "m/s", form=".3f", interval="speed_95"),
    Measure("progress_per_time_m_s", "progress over time", "m/s", form=".3f"),
    _SECONDS,
    Measure("stuck", "stuck episodes", of=total, form="d", least=0.0),
    Measure("recovered", "  recovered", of=total, form="d", least=0.0),
    *(
        Measure(f"share.{name}", label, of=mean, form=".1f", scale=100.0, least=0.0, most=1.0)
        for name, label in SHARES.items()
    ),
    Measure("force_mean_n", "contact force, mean", "N", of=mean, least=0.0),
    Measure("force_max_n", "contact force, largest", "N", of=largest, form=".1f", least=0.0),
    Measure("offset_m", "off the middle", "m", form=".3f", least=0.0, interval="offset_95"),
    Measure("spring_low_n_m", of=smallest),
    Measure("spring_high_n_m", "spring torque, most", "N·mm", of=largest, scale=1e3),
    Measure("spring_cycles", "  load cycles, most", of=largest, form="d", least=0.0),
)
TIME = Measure(
    *("time_s", "time, a failure as the limit", "s"), form=".1f", least=0.0, most="time_limit"
)
LIMIT = Measure("limit_s", "time limit", "s", form=".1f", least=0.0)
COLUMNS = (*CONTROLLER, TIME, LIMIT)
_SECONDS_APART = Measure(
    "time_difference_s", "difference", "s", form="+.1f", interval="time_difference_95"
)
_SHARES_APART = Measure(
    *("share_difference", "difference", "% of limit"),
    form="+.1f",
    scale=100.0,
    interval="share_difference_95",
)
PAIR = (
    Measure("trials", "valid in both", form="d"),
    Measure("only_first", "only the first", form="d"),
    Measure("only_second", "only the second", form="d"),
    Measure("both", "both succeeded", form="d"),
    Measure("both_time_s", "  time of each", "s", form=".1f", join=", "),
    Measure("mcnemar_p", "McNemar p", form=".3g"),
    _SECONDS_APART,
    Measure("wilcoxon_p", "Wilcoxon p", form=".3g"),
    Measure(
        *("offset_difference_m", "off the middle", "m"),
        form="+.3f",
        interval="offset_difference_95",
    ),
)


def limit_of(rows: Sequence[TrialResult], wanted: float | None) -> float | None:
    """The time limit that all valid trials share [s], None where each has its own."""
    limits = {row.limit_s for row in rows if row.outcome != "invalid"} or {TIME_LIMIT}
    return wanted or (limits.pop() if len(limits) == 1 else None)


def measures_of(limit: float | None) -> tuple[Sequence[Measure], Sequence[Measure]]:
    """What tables show of one controller, and of two: in shares where there is no limit of all."""
    if limit is not None:
        return CONTROLLER, PAIR
    shares = {_SECONDS: _SHARES, _SECONDS_APART: _SHARES_APART}
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
    lost = [m for m in _LOST if any(row.outcome == m.name for row in valid)]
    speed, speeds = statistics.mean95(np.array([r.progress_m / r.time_s for r in won]), 0.0)
    offset, offsets = statistics.mean95(np.array([r.offset_m for r in won]), 0.0)
    return {
        "trials": len(rows),
        "invalid": len(rows) - len(valid),
        "first_reason": next((row.reason for row in rows if row.outcome == "invalid"), None),
        **summarise([*CONTROLLER, *lost], valid),
        "void_decisions": total("void_decisions", rows),
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
        first_rows, second_rows = (
            {row.trial: row for row in by_controller[name] if row.outcome != "invalid"}
            for name in (first, second)
        )
        both = sorted(first_rows.keys() & second_rows.keys())
        if both:
            times = np.array([[rows[k].time_s for k in both] for rows in (first_rows, second_rows)])
            ends = np.array([[rows[k].outcome for k in both] for rows in (first_rows, second_rows)])
            won = ends == "success"
            units = np.array([first_rows[k].limit_s for k in both]) if limit is None else 1.0
            first_t, second_t = times / units
            test = statistics.compare(won[0], won[1], first_t, second_t, limit or 1.0)
            comparison = asdict(test)
            if limit is None:
                comparison["share_difference"] = comparison.pop("time_difference_s")
                comparison["share_difference_95"] = comparison.pop("time_difference_95")
                means = times[:, won.all(axis=0)].mean(axis=1).tolist() if test.both else None
                comparison["both_time_s"] = means and tuple(means)
            apart = np.array([first_rows[k].offset_m - second_rows[k].offset_m for k in both])
            offset, offsets = statistics.mean95(apart[won.all(axis=0)])
            known = math.isfinite(offset)
            tests[f"{first}-{second}"] = {
                "trials": len(both),
                **comparison,
                "offset_difference_m": offset if known else None,
                "offset_difference_95": offsets if known else None,
            }
    return tests


_JOINED = (
    "Intervals of restricted times join Wilson's of the failures with Student's of the times:\n"
    "they reach for failures that few trials do not meet."
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The controllers one by one and two by two."""
    controllers, pairs = result["controllers"], result["paired"]
    limit = result["time_limit_s"]
    one, two = measures_of(limit)
    at = next(i for i, measure in enumerate(one) if measure.name == "left") + 1
    lost = [m for m in _LOST if any(m.name in row for row in controllers.values())]
    one = (*one[:at], *lost, *one[at:])
    until = "its limit, of each trial its own" if limit is None else f"the time limit, {limit:g} s"
    short = short_names(controllers)
    counts = sorted({row["trials"] for row in controllers.values()})
    many = " to ".join(str(n) for n in dict.fromkeys([counts[0], counts[-1]]))
    many += " trial" if many == "1" else " trials"
    one_by_one = Table.of(
        "Controllers",
        {short[name]: row for name, row in controllers.items()},
        one,
        f"{many} a controller, seed {result['seed']}. A failure counts as {until}.\n"
        "The largest spring torque is bounded by the stop of its hinge.\n"
        f"Invalid trials do not count in the rows below "
        f"`invalid`.{'' if few(_valid(result)) else f' {_JOINED}'}",
        about(controllers),
    )
    shown_pairs = _shown_pairs(list(controllers))
    all_shown = len(shown_pairs) == math.comb(len(controllers), 2)
    hidden = "" if all_shown else f" Pairs without `{RIVAL}` are in result.json."
    two_by_two = Table.of(
        "Pairs, trial by trial",
        {
            f"{short[first]} minus {short[second]}": pair
            for first, second in shown_pairs
            if (pair := _minus(pairs, first, second))
        },
        two,
        "McNemar's test is exact; Wilcoxon's takes failures as the limit, and zeros by Pratt's "
        f"ranks; both two-sided.{hidden}",
    )
    return (one_by_one, two_by_two) if pairs else (one_by_one,)


def _shown_pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs that the table shows: of many, those with the rival; result.json holds all.

    The second of each, which is subtracted, is the rival, else the one that was named earlier.
    """
    pairs = [(b, a) if b != RIVAL else (a, b) for a, b in combinations(names, 2)]
    with_rival = [pair for pair in pairs if RIVAL in pair]
    return with_rival if len(names) > 3 and with_rival else pairs


def _minus(pairs: Mapping[str, Any], first: str, second: str) -> Mapping[str, Any] | None:
    """A comparison with the differences of first minus second; None where there is none."""
    if pair := pairs.get(f"{first}-{second}"):
        return pair
    pair = pairs.get(f"{second}-{first}")
    if pair is None:
        return None
    turned = {**pair, "only_first": pair["only_second"], "only_second": pair["only_first"]}
    turned["both_time_s"] = (times := pair.get("both_time_s")) and times[::-1]
    for name, value in pair.items():
        if "_difference" in name and value is not None:
            turned[name] = [-end for end in value[::-1]] if name.endswith("_95") else -value
    return turned


def sentence(result: Mapping[str, Any]) -> str:
    """Which controllers came through, and how sure it is."""
    without = none_valid(result)
    short = short_names(result["controllers"])
    passed = successes(
        {short[n]: row for n, row in result["controllers"].items() if n not in without}
    )
    so_few = few(_valid(result))
    test = "" if so_few else _against_rival(result, short)
    invalid = sum(row["invalid"] for row in result["controllers"].values())
    why = f" Invalid trials: {invalid}; trials.csv gives the reason of each." if invalid else ""
    scene = result["scene"]
    what = "Tunnels crossed" if scene == TUNNEL else f"Trials that succeeded in {scene}"
    if known := result.get("knows"):  # results of older versions have none
        what += f", knowing {' and '.join(known)}"
    text = f"{what} (95 % interval): {passed}{test}." if passed else ""
    text += f" {so_few or _undecided(result)}".rstrip() if passed else ""
    for name, reason in without.items():
        text += f" No trial of {name} is valid: {reason}."
    rows = result["controllers"].items()  # results of older versions have none
    void = void_sentence({short[name]: row.get("void_decisions", 0) for name, row in rows})
    return f"{text}{why} {void}".strip()


def _against_rival(result: Mapping[str, Any], short: Mapping[str, str]) -> str:
    """The last controller against its rival, on the trials that are valid in both."""
    names = compared(list(result["controllers"]))
    if names is None:
        return ""
    first, rival = names
    for key in (f"{rival}-{first}", f"{first}-{rival}"):
        pair = result["paired"].get(key)
        shares = result["time_limit_s"] is None
        mean, of = ("share_difference", 100.0) if shares else ("time_difference_s", 1.0)
        ends = pair and pair["share_difference_95" if shares else "time_difference_95"]
        if ends is None:
            continue
        unit = "% of the limit" if shares else "s"
        sign = of if key.startswith(f"{rival}-") else -of  # so that a gain of the first is positive
        gain = sign * pair[mean]
        ends = sorted((sign * end for end in ends), reverse=gain >= 0)
        return (
            f"; {short[first]} against {short[rival]}: {_faster(gain, unit)} (95 % interval: "
            f"{_span(ends, unit)}; a failure counts as the limit), McNemar p "
            f"{pair['mcnemar_p']:.2g}"
        )
    return ""


def _undecided(result: Mapping[str, Any]) -> str:
    """What trials enough for an interval, but not for a decision, can tell; empty of many."""
    least = min(filter(None, _valid(result)))
    if least >= _MANY or len(result["controllers"]) < 2:
        return ""
    return (
        f"{least} trials decide little: with 95 % confidence two controllers differ in how many "
        f"they cross only where one alone crosses at least {_APART}."
    )


def _span(ends: Sequence[float], unit: str) -> str:
    """Gains of time from one end to the other, the larger of that sign first if both occur."""
    if min(ends) < 0 < max(ends):
        return f"{_faster(ends[0], unit)} to {_faster(ends[1], unit)}"
    low, high = sorted(ends, key=abs)
    return f"{abs(low):.1f} to {_faster(high, unit)}"


def _faster(gain: float, unit: str) -> str:
    """A gain of time in words."""
    return f"{abs(gain):.1f} {unit} {'faster' if gain >= 0 else 'slower'}"


def _valid(result: Mapping[str, Any]) -> list[int]:
    """Valid trials of each controller."""
    return [row["trials"] - row["invalid"] for row in result["controllers"].values()]


def none_valid(result: Mapping[str, Any]) -> dict[str, str]:
    """Controllers of which every trial is invalid, and why the first one is."""
    return {
        name: row["first_reason"]
        for name, row in result["controllers"].items()
        if row["trials"] and row["invalid"] == row["trials"]
    }
