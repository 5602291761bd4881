"""What is measured of each cell and over cells, as numbers and in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from antennate.control.climbing.rule import Ground as Felt
from antennate.experiments.climb.config import ABOUT, BUMPY, CLIFF, GROUND, ClimbConfig
from antennate.experiments.climb.physics import ClimbRow
from antennate.studies import statistics
from antennate.studies.measures import Measure, Table, count, mean, share, shown, summarise

PLAN_BAND = (-0.06, 0.04)
"""Where the error of the plan is to lie in PLAN_SHARE of the crossings [m], set beforehand."""
PLAN_SHARE = 0.9
FELT_HEIGHTS = (0.02, 0.10)
"""Heights over which the error of the probe is summed up [m]."""
VERDICTS = tuple(verdict.name for verdict in Felt)


def _load(name: str, label: str, unit: str = "", scale: float = 1.0, form: str = ".2f") -> Measure:
    return Measure(name, label, unit, of=_known, scale=scale, form=form, least=0.0)


def _known(name: str, rows: Sequence[Any]) -> float | None:
    """Mean of a column over the rows that have it."""
    return mean(name, [row for row in rows if getattr(row, name) is not None])


CONDITION = (
    Measure("trials", "trials", form="d"),
    Measure("successes", "successes", of=count("outcome", "success"), form="d"),
    Measure("success_share", "  share", "%", form=".0f", scale=100.0),
    Measure("wilson95", "  Wilson 95 %", "%", form=".0f", scale=100.0),
    Measure("timeouts", "out of time", of=count("outcome", "timeout"), form="d"),
    Measure("overturned", "overturned", of=count("outcome", "overturned"), form="d"),
    Measure("left", "left the scene", of=count("outcome", "left"), form="d"),
    Measure("invalid", "invalid", form="d"),
    Measure("success_time_s", "time of a success", "s", form=".1f"),
    Measure("success_speed_m_s", "speed of a success, climbing", "m/s", form=".3f"),
    _load("climbs", "climbs begun, mean"),
    _load("torque_rms_n_m", "RMS torque of the worst pitch joint", "N·m"),
    _load("torque_peak_n_m", "largest torque, mean", "N·m"),
    _load("above_half", "over half the stall torque", "% of climb", 100.0, ".1f"),
    _load("saturated", "drive at its limit", "% of climb", 100.0, ".1f"),
    _load("current_rms_a", "RMS current of the worst pitch joint", "A"),
)
TIME = Measure("time_s", "time to the end", "s", form=".1f", least=0.0, most="time_limit")
COLUMNS = (*CONDITION, TIME)
PLAN = (
    Measure("crossings", "crossings", form="d"),
    Measure("low_cm", "5 %", "cm", form="+.1f"),
    Measure("middle_cm", "50 %", "cm", form="+.1f"),
    Measure("high_cm", "95 %", "cm", form="+.1f"),
    Measure("within", "within -6 to +4 cm", "%", form=".0f", scale=100.0),
)
PROBE = (
    Measure("felt_height_m", "height", "cm", scale=100.0, form=".1f"),
    Measure("ahead_m", "ahead", "cm", scale=100.0, form=".1f"),
    Measure("latency_s", "latency", "s"),
)
FALSE = (
    Measure("false_climbs", "false climbs", form="d"),
    Measure("per_1000_s", "  per 1000 s", form=".2f", interval="per_1000_s_95"),
    Measure("per_m", "  per metre", "1/m", form=".3f", interval="per_m_95"),
)


def summary(rows: Sequence[ClimbRow], more: Sequence[Measure] = ()) -> dict[str, Any]:
    """Some trials of one condition; invalid ones are counted and left out of all else."""
    valid = [row for row in rows if row.outcome != "invalid"]
    won = [row for row in valid if row.outcome == "success"]
    return {
        "trials": len(rows),
        "invalid": len(rows) - len(valid),
        "first_reason": next((row.reason for row in rows if row.outcome == "invalid"), None),
        **summarise([*CONDITION, *more], valid),
        "success_share": len(won) / len(valid) if valid else None,
        "wilson95": statistics.wilson95(len(won), len(valid)) if valid else None,
        "success_time_s": _known("time_s", won),
        "success_speed_m_s": _known("speed_m_s", won),
    }


def climbing(config: ClimbConfig, rows: Sequence[ClimbRow]) -> list[dict[str, Any]]:
    """The climbs with each divisor: by condition, by height, in pairs, and the plan's error."""
    return [_with_divisor(config, divisor, rows) for divisor in config.divisors]


def _with_divisor(config: ClimbConfig, divisor: float, rows: Sequence[ClimbRow]) -> dict[str, Any]:
    own = [row for row in rows if row.part == "climbing" and row.divisor == divisor]
    by_name = {n: [row for row in own if row.condition == n] for n in config.conditions}
    heights = {
        name: [
            {"height_m": height, **summary([row for row in some if row.height_m == height])}
            for height in config.heights
        ]
        for name, some in by_name.items()
    }
    return {
        "divisor": divisor,
        "conditions": {name: summary(some) for name, some in by_name.items()},
        "heights": heights,
        "pairs": pairs(by_name),
        "plan": plan_errors(by_name["climb"]) if "climb" in by_name else None,
    }


def pairs(by_name: Mapping[str, Sequence[ClimbRow]]) -> dict[str, Any]:
    """`climb` beside each other condition, trial by trial, over all grounds of these rows."""
    tests: dict[str, Any] = {}
    first = _valid(by_name.get("climb", ()))
    for name in by_name:
        second = _valid(by_name[name])
        both = sorted(first.keys() & second.keys())
        if name == "climb" or not both:
            continue
        won = np.array([[rows[k].outcome == "success" for rows in (first, second)] for k in both])
        test = statistics.mcnemar(won)
        tests[name] = {
            "trials": len(both),
            "only_climb": test.only_first,
            "only_other": test.only_second,
            "mcnemar_p": test.mcnemar_p,
        }
    return tests


def _valid(rows: Iterable[ClimbRow]) -> dict[tuple[str, int], ClimbRow]:
    return {(row.ground, row.trial): row for row in rows if row.outcome != "invalid"}


def plan_errors(rows: Sequence[ClimbRow]) -> list[dict[str, Any]]:
    """Error of the plan when the centre of each link crossed the edge, head first, then all."""
    by_link: dict[int, list[float]] = {}
    for row in rows:
        for word in row.plan_error_m.split():
            link, _, error = word.partition(":")
            by_link.setdefault(int(link), []).append(float(error))
    named = {f"link {link}" if link else "head": by_link[link] for link in sorted(by_link)}
    named["all links"] = [error for errors in by_link.values() for error in errors]
    return [_spread(name, errors) for name, errors in named.items()]


def _spread(name: str, errors: Sequence[float]) -> dict[str, Any]:
    known = np.array(errors)
    low, middle, high = (
        (100.0 * np.percentile(known, [5.0, 50.0, 95.0])).tolist() if len(known) else [None] * 3
    )
    low_end, high_end = PLAN_BAND
    inside = (known >= low_end) & (known <= high_end)
    return {
        "link": name,
        "crossings": len(known),
        "low_cm": low,
        "middle_cm": middle,
        "high_cm": high,
        "within": float(inside.mean()) if len(known) else None,
    }


def sensing(config: ClimbConfig, rows: Sequence[ClimbRow]) -> list[dict[str, Any]]:
    """What `climb` felt, with each divisor."""
    feels = [row for row in rows if row.part == "sensing"]
    return [
        _felt(divisor, [row for row in feels if row.divisor == divisor])
        for divisor in config.divisors
        if config.sensing
    ]


def _felt(divisor: float, every: Sequence[ClimbRow]) -> dict[str, Any]:
    rows = [row for row in every if row.outcome != "invalid"]
    by_ground = {name: [row for row in rows if row.ground == name] for name in GROUND}
    verdicts = {name: Counter(row.verdict for row in some) for name, some in by_ground.items()}
    cliff = by_ground[CLIFF]
    stopped = sum(row.outcome == "stopped" for row in cliff)
    return {
        "divisor": divisor,
        "invalid": len(every) - len(rows),
        "first_reason": next((row.reason for row in every if row.outcome == "invalid"), None),
        "confusion": {
            name: {verdict: counts[verdict] for verdict in VERDICTS}
            for name, counts in verdicts.items()
        },
        "felt": {name: _probe(some) for name, some in by_ground.items()},
        "heights": probe_error(rows),
        "false_climbs": {name: false_climbs(by_ground[name]) for name in ("flat", BUMPY)},
        "cliff": {
            "trials": len(cliff),
            "stopped": stopped,
            "wilson95": statistics.wilson95(stopped, len(cliff)),
        },
    }


def _probe(rows: Sequence[ClimbRow]) -> dict[str, Any]:
    return {name: _known(name, rows) for name in ("felt_height_m", "ahead_m", "latency_s")}


def probe_error(rows: Sequence[ClimbRow]) -> dict[str, Any]:
    """Height by the probe against the true one, of steps within FELT_HEIGHTS."""
    low, high = FELT_HEIGHTS
    steps = [
        row
        for row in rows
        if row.ground.startswith("step") and low <= (row.height_m or 0.0) <= high
    ]
    errors = np.array(
        [
            row.felt_height_m - row.height_m
            for row in steps
            if row.verdict == "STEP_UP" and row.felt_height_m is not None and row.height_m
        ]
    )
    known = len(errors) > 0
    return {
        "steps": len(steps),
        "told": len(errors),
        "bias_m": float(errors.mean()) if known else None,
        "rmse_m": float(np.sqrt((errors**2).mean())) if known else None,
    }


def false_climbs(rows: Sequence[ClimbRow]) -> dict[str, Any]:
    """Climbs begun where there is no step, over time and way."""
    number, time, way = (
        sum(getattr(row, name) for row in rows) for name in ("climbs", "time_s", "walked_m")
    )
    low, high = statistics.poisson95(number)
    rates: dict[str, Any] = {"false_climbs": number, "time_s": time, "way_m": way}
    for name, amount in (("per_1000_s", time / 1000.0), ("per_m", way)):
        rates[name] = number / amount if amount else None
        rates[f"{name}_95"] = (low / amount, high / amount) if amount else None
    return rates


def step_tables(result: Mapping[str, Any]) -> list[Table]:
    """Success over heights, what climbing costs, pairs and plan, with each divisor."""
    shown_tables: list[Table] = []
    for entry in result["climbing"]:
        where = f", gain divisor {entry['divisor']:g}"
        shown_tables += [_success(entry, where, result), _costs(entry, where)]
        if entry["pairs"]:
            shown_tables.append(_pairs(entry, where))
        if entry["plan"]:
            shown_tables.append(_plan(entry, where))
    return shown_tables


def felt_tables(result: Mapping[str, Any]) -> list[Table]:
    """What is felt, with each divisor."""
    shown_tables: list[Table] = []
    for entry in result["sensing"]:
        where = f", gain divisor {entry['divisor']:g}"
        shown_tables += [_confusion(entry, where), _probes(entry, where), _rates(entry, where)]
    return shown_tables


def _success(entry: Mapping[str, Any], where: str, result: Mapping[str, Any]) -> Table:
    heights = [f"{100 * h:g} cm" for h in result["heights_m"]]
    rows = [(name, [briefly(row) for row in some]) for name, some in entry["heights"].items()]
    note = (
        f"Successes of valid trials, and the Wilson 95 % interval [%]; within "
        f"{result['time_limit_s']:g} s, seed {result['seed']}.\nAll conditions meet the same "
        "steps, starts and disturbances."
    )
    about = "\n".join(f"{n}: {text}" for n, text in ABOUT.items() if n in entry["heights"])
    return Table(f"Climbed{where}", heights, rows, note, preface=about)


def briefly(row: Mapping[str, Any]) -> str:
    """Successes and interval, so short that five heights fit into a terminal."""
    valid = row["trials"] - row["invalid"]
    return f"{row['successes']}/{valid} {shown(row['wilson95'], '.0f', 100.0, '-')}"


def _costs(entry: Mapping[str, Any], where: str) -> Table:
    note = "All heights. Loads are means over trials, from a link before the edge to the end."
    return Table.of(f"Conditions{where}", entry["conditions"], CONDITION, note)


def _pairs(entry: Mapping[str, Any], where: str) -> Table:
    rows = [
        (
            f"climb, {name}",
            [str(p["trials"]), str(p["only_climb"]), str(p["only_other"]), f"{p['mcnemar_p']:.3g}"],
        )
        for name, p in entry["pairs"].items()
    ]
    heads = ("valid in both", "only climb", "only the other", "McNemar p")
    note = "All heights pooled. McNemar's test is exact and two-sided."
    return Table(f"Trial by trial{where}", heads, rows, note)


def _plan(entry: Mapping[str, Any], where: str) -> Table:
    rows = [(row["link"], [measure.cell(row) for measure in PLAN]) for row in entry["plan"]]
    share_within = entry["plan"][-1]["within"]
    word = "reached" if (share_within or 0.0) >= PLAN_SHARE else "not reached"
    note = (
        "Head by the plan less the true one as the centre of each link crosses the edge; positive "
        f"is ahead of the robot.\nThe aim is {100 * PLAN_SHARE:g} % within -6 to +4 cm: {word}."
    )
    heads = [measure.title for measure in PLAN]
    return Table(f"Error of the plan of climb{where}", heads, rows, note)


def _confusion(entry: Mapping[str, Any], where: str) -> Table:
    rows = [
        (name, [str(counts[verdict]) for verdict in VERDICTS])
        for name, counts in entry["confusion"].items()
    ]
    cliff, invalid = entry["cliff"], entry["invalid"]
    note = (
        "Valid trials by the first thing that climb feels.\nStopped at a drop of 35 cm: "
        f"{share(cliff['stopped'], cliff['trials'], cliff['wilson95'])}."
    )
    note += f"\nInvalid: {invalid}; the first, {entry['first_reason']}." if invalid else ""
    return Table(f"What climb takes the ground for{where}", VERDICTS, rows, note)


def _probes(entry: Mapping[str, Any], where: str) -> Table:
    error = entry["heights"]
    note = (
        f"Means. Height of steps of 2 to 10 cm: {error['told']} of {error['steps']} told, bias "
        f"{shown(error['bias_m'], '+.1f', 100.0)} cm, RMSE {shown(error['rmse_m'], '.1f', 100.0)} "
        "cm."
    )
    rows = [(name, [m.cell(felt) for m in PROBE]) for name, felt in entry["felt"].items()]
    return Table(f"The first probe{where}", [m.title for m in PROBE], rows, note)


def _rates(entry: Mapping[str, Any], where: str) -> Table:
    note = "Climbs begun where there is no step; Garwood's exact interval of a Poisson count."
    return Table.of(f"False climbs{where}", entry["false_climbs"], FALSE, note)


def sentence(result: Mapping[str, Any]) -> str:
    """How many steps were climbed by each condition, with each divisor."""
    parts = []
    for entry in result["climbing"]:
        each = ", ".join(
            f"{name} {share(s['successes'], s['trials'] - s['invalid'], s['wilson95'])}"
            for name, s in entry["conditions"].items()
            if s["trials"]
        )
        if each:
            parts.append(f"with gain divisor {entry['divisor']:g} {each}")
    lost = sum(s["invalid"] for e in result["climbing"] for s in e["conditions"].values())
    lost += sum(entry["invalid"] for entry in result["sensing"])
    why = f" Invalid trials: {lost}; trials.csv gives the reason of each." if lost else ""
    shares = "; ".join(parts) or "none"
    return f"Steps climbed, all heights (95 % interval): {shares}.{why}"
