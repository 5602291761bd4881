"""What is measured on grounds other than one step: crossings, pairs, and speed on the flat."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from antennate.experiments.climb.config import ClimbConfig
from antennate.experiments.climb.grounds import FLAT, KINDS, Terrain
from antennate.experiments.climb.measures import briefly, pairs, summary
from antennate.experiments.climb.physics import ClimbRow
from antennate.jackknife import ENOUGH, jackknife95
from antennate.studies import statistics
from antennate.studies.measures import Measure, Table, count, mean
from antennate.types import Floats

REFERENCE = "level"
"""Whose speed on the flat floor the others are compared with."""
LEAST_RATIO = 0.98
"""What `climb` is to keep of that speed, set beforehand."""
ENDS = tuple(
    Measure(name, label, of=count("outcome", name), form="d")
    for name, label in (("fell", "fell"), ("stopped", "stopped before it"))
)
"""Outcomes that steps do not have."""
WALK = (
    Measure("trials", "trials", form="d"),
    Measure("speed_m_s", "speed", "m/s", form=".4f", interval="speed_95"),
    Measure("ratio", f"over that of {REFERENCE}", form=".3f", interval="ratio_95"),
    Measure("climbs", "climbs begun, mean"),
)


def crossing(config: ClimbConfig, rows: Sequence[ClimbRow]) -> list[dict[str, Any]]:
    """The crossings with each divisor, by condition and ground, in pairs; and speed on the flat."""
    return [_with_divisor(config, d, rows) for d in config.divisors if config.grounds]


def _with_divisor(config: ClimbConfig, divisor: float, rows: Sequence[ClimbRow]) -> dict[str, Any]:
    own = [row for row in rows if row.part == "ground" and row.divisor == divisor]
    by_name = {n: [row for row in own if row.condition == n] for n in config.conditions}
    crossed = [terrain for terrain in config.terrains if terrain.scene != FLAT]
    flat = {name: [row for row in some if row.ground == FLAT] for name, some in by_name.items()}
    return {
        "divisor": divisor,
        "grounds": {
            name: [_on(terrain, some) for terrain in crossed] for name, some in by_name.items()
        },
        "pairs": {
            kind: pairs({n: [r for r in some if _kind(r) == kind] for n, some in by_name.items()})
            for kind in KINDS
            if any(terrain.scene == kind for terrain in crossed)
        },
        "flat": walks(flat) if FLAT in config.grounds else None,
    }


def _kind(row: ClimbRow) -> str:
    return Terrain.of(row.ground).scene


def _on(terrain: Terrain, rows: Sequence[ClimbRow]) -> dict[str, Any]:
    """The trials of one condition on one ground."""
    own = [row for row in rows if row.ground == terrain.word]
    place = {"ground": terrain.word, "scene": terrain.scene, "size": terrain.size}
    return {**place, **summary(own, ENDS)}


def walks(by_name: Mapping[str, Sequence[ClimbRow]]) -> dict[str, Any]:
    """Speed of each condition on the flat floor, and its ratio to that of `level` in pairs."""
    speeds = {
        name: {row.trial: row.speed_m_s for row in rows if row.speed_m_s is not None}
        for name, rows in by_name.items()
    }
    found: dict[str, Any] = {}
    for name, rows in by_name.items():
        own, other = speeds[name], speeds.get(REFERENCE, {})
        both = sorted(own.keys() & other.keys())
        speed, ends = statistics.mean95(np.array([*own.values()]), 0.0)
        known = [row for row in rows if row.outcome != "invalid"]
        found[name] = {
            "trials": len(own),
            "speed_m_s": speed if own else None,
            "speed_95": ends,
            "climbs": mean("climbs", known),
            **ratio95(np.array([[own[k], other[k]] for k in both]).reshape(-1, 2)),
        }
    return found


def ratio95(speeds: Floats) -> dict[str, Any]:
    """Ratio of two mean speeds of the same trials, shape (n, 2), with its jackknife interval."""
    if not len(speeds):
        return {"ratio": None, "ratio_95": None}
    sums = speeds.sum(axis=0)
    ratio = float(sums[0] / sums[1])
    if len(speeds) < ENOUGH:
        return {"ratio": ratio, "ratio_95": None}
    left = np.log(sums - speeds)
    low, high = np.exp(jackknife95(np.log(ratio), left[:, 0] - left[:, 1])).tolist()
    return {"ratio": ratio, "ratio_95": (low, high) if low == low else None}


def ground_tables(result: Mapping[str, Any]) -> list[Table]:
    """Crossings, how the others ended, pairs, and speed on the flat, with each divisor."""
    shown, limit = list[Table](), result["time_limit_s"]
    for entry in result["grounds"]:
        where = f", gain divisor {entry['divisor']:g}"
        if any(entry["grounds"].values()):
            shown += [_crossed(entry, where, limit), _ended(entry, where)]
        if any(entry["pairs"].values()):
            shown.append(_pairs(entry, where))
        if entry["flat"] is not None:
            shown.append(_flat(entry["flat"], where))
    return shown


def _by_ground(entry: Mapping[str, Any], cell: Any) -> list[tuple[str, list[str]]]:
    """A line for each ground that has trials, a cell for each condition."""
    return [
        (Terrain.of(some[0]["ground"]).label, [cell(row) for row in some])
        for some in zip(*entry["grounds"].values(), strict=True)
        if any(row["trials"] for row in some)
    ]


def _crossed(entry: Mapping[str, Any], where: str, limit: float) -> Table:
    note = (
        f"Crossings of valid trials, and the Wilson 95 % interval [%]; within {limit:g} s, on "
        f"stairs and in tunnels {2 * limit:g} s."
    )
    return Table(f"Crossed{where}", list(entry["grounds"]), _by_ground(entry, briefly), note)


_WORDS = (
    ("stopped", "stopped"),
    ("fell", "fell"),
    ("timeouts", "late"),
    ("left", "left"),
    ("overturned", "overturned"),
    ("invalid", "invalid"),
)
"""Outcomes that are no crossing, and what the table calls them."""


def _ended(entry: Mapping[str, Any], where: str) -> Table:
    def cell(row: Mapping[str, Any]) -> str:
        ends = Counter({word: row[name] for name, word in _WORDS})
        return ", ".join(f"{number} {word}" for word, number in ends.items() if number) or "-"

    note = "Stopped: before the edge, 15 s after it was felt as a drop. Late: out of time."
    return Table(f"Not crossed{where}", list(entry["grounds"]), _by_ground(entry, cell), note)


def _pairs(entry: Mapping[str, Any], where: str) -> Table:
    names = [name for name in entry["grounds"] if name != "climb"]
    rows = [
        (kind.replace("_", " "), [_pair(tests.get(name)) for name in names])
        for kind, tests in entry["pairs"].items()
    ]
    note = "Crossed by climb alone : by the other alone, and McNemar's exact p; all sizes pooled."
    return Table(f"Ground, trial by trial{where}", [f"climb, {n}" for n in names], rows, note)


def _pair(test: Mapping[str, Any] | None) -> str:
    if test is None:
        return "-"
    return f"{test['only_climb']}:{test['only_other']} {test['mcnemar_p']:.3g}"


def _flat(flat: Mapping[str, Any], where: str) -> Table:
    ends = flat.get("climb", {}).get("ratio_95")
    word = "not decided"
    if ends is not None and (ends[0] >= LEAST_RATIO or ends[1] < LEAST_RATIO):
        word = "reached" if ends[0] >= LEAST_RATIO else "not reached"
    note = (
        "Way of the middle of the robot over time. Ratios are of the same trials, with a jackknife "
        f"interval.\nThe aim is climb at {LEAST_RATIO:g} of {REFERENCE} or more: {word}."
    )
    return Table.of(f"Speed on the flat floor{where}", flat, WALK, note)
