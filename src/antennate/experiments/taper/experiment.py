"""The experiment `taper`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.taper import run as taper
from antennate.studies.experiment import Experiment
from antennate.studies.measures import Table, shown

SHOWN_SEGMENTS = 20
COLUMNS = {"d [mm]": "diameter_mm", "I [mm⁴]": "second_moment_mm4", "proxy": "proxy"}


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """Segments of the animal, and ladders of springs."""
    rows = result["segments"]
    step = -(-len(rows) // SHOWN_SEGMENTS)
    animal = [
        (f"segment {i + 1}", [shown(row[key], ".3g") for key in COLUMNS.values()])
        for i, row in enumerate(rows)
        if i % step == 0
    ]
    ladder, suggested = result["ladder"], result["suggested"]
    springs = zip(result["stretches"], ladder["proxy"], suggested["proxy"], strict=True)
    return (
        Table("Animal", list(COLUMNS), animal, f"Base over tip {result['base_over_tip']:.0f} : 1."),
        Table(
            "One spring a stretch, over the first",
            ("animal", "ladder", "suggested"),
            [(f"spring {i + 1}", [shown(v, ".3g") for v in row]) for i, row in enumerate(springs)],
            f"Stretches of the animal fall {result['stretch_ratio']:.0f} : 1, the ladder "
            f"{ladder['base_over_tip']:.3g} : 1, the suggested one "
            f"{suggested['base_over_tip']:.3g} : 1.",
        ),
    )


def sentence(result: Mapping[str, Any]) -> str:
    """How far the ladders are from the animal."""
    ladder, suggested = result["ladder"], result["suggested"]
    return (
        f"The ladder {_coils(ladder)} is {ladder['distance_decades']:.2f} decades from the animal "
        f"(root mean square), {_coils(suggested)} would be {suggested['distance_decades']:.2f}; "
        "computed from diameters, nothing was measured."
    )


def _coils(row: Mapping[str, Any]) -> str:
    return "-".join(f"{n:g}" for n in row["active_coils"])


EXPERIMENT = Experiment.of_folder(
    __name__, taper.TaperConfig, lambda config, *_: taper.run(config), tables, sentence
)
