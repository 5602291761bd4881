"""The experiment `tunnel`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.tunnel import measures
from antennate.experiments.tunnel import run as tunnel
from antennate.sim.scenes.registry import TUNNEL
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Table, successes


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The controllers one by one and two by two."""
    controllers = result["controllers"]
    counts = sorted({row["trials"] for row in controllers.values()})
    many = " to ".join(str(n) for n in dict.fromkeys([counts[0], counts[-1]]))
    many += " trial" if many == "1" else " trials"
    one_by_one = Table.of(
        "Controllers",
        controllers,
        measures.CONTROLLER,
        f"{many} a controller, seed {result['seed']}. A failure counts as the time limit, "
        f"{result['time_limit_s']:g} s; invalid trials\nare left out of all rows below theirs. "
        "Intervals of means are bootstrapped.",
    )
    two_by_two = Table.of(
        "Pairs, trial by trial",
        result["paired"],
        measures.PAIR,
        "McNemar's test is exact; Wilcoxon's takes failures as the limit; both two-sided.",
    )
    return (one_by_one, two_by_two) if result["paired"] else (one_by_one,)


def sentence(result: Mapping[str, Any]) -> str:
    """Which controllers came through, and how sure it is."""
    none_valid = _none_valid(result)
    found = successes({n: r for n, r in result["controllers"].items() if n not in none_valid})
    pair = next(iter(reversed(result["paired"].items())), None)
    test = f"; McNemar p of {pair[0]} {pair[1]['mcnemar_p']:.2g}" if pair else ""
    invalid = sum(row["invalid"] for row in result["controllers"].values())
    why = f" Invalid trials: {invalid}; trials.csv gives the reason of each." if invalid else ""
    scene = result["scene"]
    what = "Tunnels crossed" if scene == TUNNEL else f"Trials that succeeded in {scene}"
    text = f"{what} (95 % interval): {found}{test}." if found else ""
    for name, reason in none_valid.items():
        text += f" No trial of {name} is valid: {reason}."
    return f"{text}{why}".strip()


def _none_valid(result: Mapping[str, Any]) -> dict[str, str]:
    """Controllers of which every trial is invalid, and why the first one is."""
    return {
        name: row["first_reason"]
        for name, row in result["controllers"].items()
        if row["trials"] and row["invalid"] == row["trials"]
    }


EXPERIMENT = Experiment.of_folder(
    __name__,
    tunnel.TunnelConfig,
    tunnel.run,
    tables,
    sentence,
    check=tunnel.check,
    failed=lambda result: bool(_none_valid(result)),
)
