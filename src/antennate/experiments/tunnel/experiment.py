"""The experiment `tunnel`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from antennate.control.readings import short_names
from antennate.control.registry import RIVAL, about, compared
from antennate.experiments.tunnel import measures
from antennate.experiments.tunnel import run as tunnel
from antennate.experiments.tunnel.batch import BATCH
from antennate.experiments.tunnel.monitor import TrialResult
from antennate.sim.scenes.registry import TUNNEL
from antennate.studies.experiment import Experiment, Trials
from antennate.studies.measures import Table, few, successes
from antennate.telemetry.header import log_name

_JOINED = (
    "Intervals of restricted times join Wilson's of the failures with Student's of the times:\n"
    "they reach for failures that few trials do not meet."
)


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The controllers one by one and two by two."""
    controllers, pairs = result["controllers"], result["paired"]
    limit = result["time_limit_s"]
    one, two = measures.shown(limit)
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
            f"{short[first]} minus {short[second]}": pairs[f"{first}-{second}"]
            for first, second in shown_pairs
            if f"{first}-{second}" in pairs
        },
        two,
        "McNemar's test is exact; Wilcoxon's takes failures as the limit, and zeros by Pratt's "
        f"ranks; both two-sided.{hidden}",
    )
    return (one_by_one, two_by_two) if pairs else (one_by_one,)


def _shown_pairs(names: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs that the table shows: of many, those with the rival; result.json holds all."""
    pairs = list(combinations(names, 2))
    with_rival = [pair for pair in pairs if RIVAL in pair]
    return with_rival if len(names) > 3 and with_rival else pairs


def sentence(result: Mapping[str, Any]) -> str:
    """Which controllers came through, and how sure it is."""
    none_valid = _none_valid(result)
    short = short_names(result["controllers"])
    found = successes(
        {short[n]: row for n, row in result["controllers"].items() if n not in none_valid}
    )
    so_few = few(_valid(result))
    test = "" if so_few else _against_rival(result, short)
    invalid = sum(row["invalid"] for row in result["controllers"].values())
    why = f" Invalid trials: {invalid}; trials.csv gives the reason of each." if invalid else ""
    scene = result["scene"]
    what = "Tunnels crossed" if scene == TUNNEL else f"Trials that succeeded in {scene}"
    if known := result.get("knows"):  # results of older versions have none
        what += f", knowing {' and '.join(known)}"
    text = f"{what} (95 % interval): {found}{test}." if found else ""
    text += f" {so_few}" if found and so_few else ""
    for name, reason in none_valid.items():
        text += f" No trial of {name} is valid: {reason}."
    return f"{text}{why}".strip()


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


def _none_valid(result: Mapping[str, Any]) -> dict[str, str]:
    """Controllers of which every trial is invalid, and why the first one is."""
    return {
        name: row["first_reason"]
        for name, row in result["controllers"].items()
        if row["trials"] and row["invalid"] == row["trials"]
    }


CAPTIONS = {
    "trajectories": "Trials from above, the first five at most: a row for each trial, a column for "
    "each controller, coloured by maneuver.",
    "summary": "Success of each controller with its Wilson 95 % interval, time in the scene, and "
    "restricted mean time, with a 95 % interval from five trials on.",
}

EXPERIMENT = Experiment.of_folder(
    __name__,
    tunnel.TunnelConfig,
    tunnel.run,
    tables,
    sentence,
    check=tunnel.check,
    filmed=True,
    failed=lambda result: bool(_none_valid(result)),
    logged=tunnel.run,
    logs=lambda config: [log_name(f"{name}-{trial}") for name, trial in tunnel.every(config)],
    trials=Trials(
        *("controller", tunnel.every, tunnel.run_rows, BATCH, TrialResult, tunnel.run_on_device)
    ),
    tasks=tunnel.tasks,
    measures=measures.COLUMNS,
    viewed=lambda config, on_step, on_row, view, logs: tunnel.run(
        config, 1, on_step, on_row, logs, view
    ),
    captions=CAPTIONS,
    explained="docs/results.md",
)
