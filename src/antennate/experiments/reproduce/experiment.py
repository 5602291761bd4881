"""The experiment `reproduce`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.reproduce.page import body
from antennate.experiments.reproduce.run import CLAIMS, ReproduceConfig, run
from antennate.experiments.reproduce.verdict import VERDICTS
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Table
from antennate.studies.run_files import REPORT


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """All claims with their verdicts."""
    rows = [
        (
            row["claim"],
            [row.get("criterion", ""), row["paper"], row["ours"], VERDICTS[row["verdict"]]],
        )
        for row in result["claims"]
    ]
    note = f"Reasons and figures: {REPORT}. Seed {result['seed']}."
    return (Table("Claims", ["criterion", "paper", "ours", "verdict"], rows, note),)


def sentence(result: Mapping[str, Any]) -> str:
    """How many claims hold."""
    found = ", ".join(
        f"{result['verdicts'].get(name, 0)} {text}" for name, text in VERDICTS.items()
    )
    few = " With --quick the intervals are wide." if result["quick"] else ""
    unjudged = len(CLAIMS) - len(result["claims"])
    left = f", {unjudged} not judged" if unjudged else ""
    return f"Of {len(CLAIMS)} claims: {found}{left}.{few}"


EXPERIMENT = Experiment.of_folder(
    __name__, ReproduceConfig, run, tables, sentence, body=body, parts="parts of 9 experiments"
)
