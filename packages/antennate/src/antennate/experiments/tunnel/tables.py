"""The tunnel in tables and in a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations

from antennate.control.loop import void_sentence
from antennate.control.readings import short_names
from antennate.control.registry import RIVAL, about, compared
from antennate.experiments.tunnel.result import ControllerSummary, Pair, TunnelResult
from antennate.sim.scenes.registry import TUNNEL
from antennate.studies.columns import Column, Ends, columns
from antennate.studies.tables import Table, few, successes

_APART, _MANY = 6, 30
"""Trials that one alone must succeed in, for McNemar's exact p, 2 / 2**6, to fall below 0.05; and
trials from which on nobody needs to be told."""
_JOINED = (
    "Intervals of restricted times join Wilson's of the failures with Student's of the times:\n"
    "they reach for failures that few trials do not meet."
)


def tables(result: TunnelResult) -> Sequence[Table]:
    """The controllers one by one and two by two; none where no trial is valid."""
    if not any(_valid(result)):
        return ()
    controllers, limit = result.controllers, result.time_limit_s
    until = "its limit, of each trial its own" if limit is None else f"the time limit, {limit:g} s"
    short = short_names(controllers)
    counts = sorted({each.trials for each in controllers.values()})
    many = " to ".join(str(n) for n in dict.fromkeys([counts[0], counts[-1]]))
    many += " trial" if many == "1" else " trials"
    one_by_one = Table.of(
        "Controllers",
        {short[name]: each for name, each in controllers.items()},
        _shown(ControllerSummary, [*controllers.values()], limit),
        f"{many} a controller, seed {result.seed}. A failure counts as {until}.\n"
        "The largest spring torque is bounded by the stop of its hinge.\n"
        f"Invalid trials do not count in the rows below "
        f"`invalid`.{'' if few(_valid(result)) else f' {_JOINED}'}",
        about(controllers),
    )
    shown_pairs = _shown_pairs(list(controllers))
    all_shown = len(shown_pairs) == math.comb(len(controllers), 2)
    hidden = "" if all_shown else f" Pairs without `{RIVAL}` are in result.json."
    pairs = {
        f"{short[first]} minus {short[second]}": pair
        for first, second in shown_pairs
        if (pair := _minus(result.paired, first, second))
    }
    two_by_two = Table.of(
        "Pairs, trial by trial",
        pairs,
        _shown(Pair, [*pairs.values()], limit),
        "McNemar's test is exact; Wilcoxon's takes failures as the limit, and zeros by Pratt's "
        f"ranks; both two-sided.{hidden}",
    )
    return (one_by_one, two_by_two) if result.paired else (one_by_one,)


def _shown(kind: type, summaries: Sequence[object], limit: float | None) -> list[Column]:
    """Columns of a table: times in seconds or as shares of limits, and ways to end that occur."""
    shares, seconds = (
        ("restricted_mean_share", "share_difference"),
        (*("restricted_mean_time_s", "time_difference_s"),),
    )
    hidden = {*(seconds if limit is None else shares)}
    hidden |= {
        name for name in ("overturned", "fell") if not any(getattr(s, name, 0) for s in summaries)
    }
    return [each for each in columns(kind) if each.name not in hidden]


def _shown_pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs that the table shows: of many, those with the rival; result.json holds all.

    The second of each, which is subtracted, is the rival, else the one that was named earlier.
    """
    pairs = [(b, a) if b != RIVAL else (a, b) for a, b in combinations(names, 2)]
    with_rival = [pair for pair in pairs if RIVAL in pair]
    return with_rival if len(names) > 3 and with_rival else pairs


def _minus(pairs: Mapping[str, Pair], first: str, second: str) -> Pair | None:
    """A comparison with the differences of first minus second; None where there is none."""
    if pair := pairs.get(f"{first}-{second}"):
        return pair
    pair = pairs.get(f"{second}-{first}")
    return None if pair is None else _turned(pair)


def _turned(pair: Pair) -> Pair:
    """A comparison with its two sides exchanged."""
    times = pair.both_time_s
    return replace(
        pair,
        only_first=pair.only_second,
        only_second=pair.only_first,
        both_time_s=None if times is None else (times[1], times[0]),
        time_difference_s=_negative(pair.time_difference_s),
        time_difference_95=_mirrored(pair.time_difference_95),
        share_difference=_negative(pair.share_difference),
        share_difference_95=_mirrored(pair.share_difference_95),
        offset_difference_m=_negative(pair.offset_difference_m),
        offset_difference_95=_mirrored(pair.offset_difference_95),
    )


def _negative(value: float | None) -> float | None:
    return None if value is None else -value


def _mirrored(ends: Ends | None) -> Ends | None:
    return None if ends is None else (-ends[1], -ends[0])


def sentence(result: TunnelResult) -> str:
    """Which controllers came through, and how sure it is."""
    without, controllers = none_valid(result), result.controllers
    short = short_names(controllers)
    passed = successes({short[n]: each for n, each in controllers.items() if n not in without})
    so_few = few(_valid(result))
    test = "" if so_few else _against_rival(result, short)
    invalid = sum(each.invalid for each in controllers.values())
    why = f" Invalid trials: {invalid}; trials.csv gives the reason of each." if invalid else ""
    in_tunnel = result.scene == TUNNEL
    what = "Tunnels crossed" if in_tunnel else f"Trials that succeeded in {result.scene}"
    if result.knows:
        what += f", knowing {' and '.join(result.knows)}"
    text = f"{what} (95 % interval): {passed}{test}." if passed else ""
    text += f" {so_few or _undecided(result)}".rstrip() if passed else ""
    for name, reason in without.items():
        text += f" No trial of {name} is valid: {reason}."
    void = void_sentence({short[n]: each.void_decisions for n, each in controllers.items()})
    return f"{text}{why} {void}".strip()


def _against_rival(result: TunnelResult, short: Mapping[str, str]) -> str:
    """The last controller against its rival, on the trials that are valid in both."""
    names = compared(list(result.controllers))
    pair = names and _minus(result.paired, names[1], names[0])
    if names is None or pair is None:
        return ""
    gain, ends, unit = pair.time_difference_s, pair.time_difference_95, "s"
    if result.time_limit_s is None:
        gain, ends, unit = pair.share_difference, pair.share_difference_95, "% of the limit"
    if gain is None or ends is None:
        return ""
    scale = 100.0 if result.time_limit_s is None else 1.0
    gain, ends = scale * gain, sorted((scale * end for end in ends), reverse=gain >= 0)
    first, rival = names
    return (
        f"; {short[first]} against {short[rival]}: {_faster(gain, unit)} (95 % interval: "
        f"{_span(ends, unit)}; a failure counts as the limit), McNemar p {pair.mcnemar_p:.2g}"
    )


def _undecided(result: TunnelResult) -> str:
    """What trials enough for an interval, but not for a decision, can tell; empty of many."""
    least = min(filter(None, _valid(result)))
    if least >= _MANY or len(result.controllers) < 2:
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


def _valid(result: TunnelResult) -> list[int]:
    """Valid trials of each controller."""
    return [each.trials - each.invalid for each in result.controllers.values()]


def none_valid(result: TunnelResult) -> dict[str, str]:
    """Controllers of which every trial is invalid, and why the first one is."""
    return {
        name: each.first_reason or ""
        for name, each in result.controllers.items()
        if each.trials and each.invalid == each.trials
    }
