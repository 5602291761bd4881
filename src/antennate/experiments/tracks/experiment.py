"""The experiment `tracks`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.tracks.config import TracksConfig
from antennate.experiments.tracks.measures import MOST_BEYOND, SHAPES
from antennate.experiments.tracks.run import run
from antennate.studies.experiment import Experiment
from antennate.studies.measures import NONE, Table, few, shown

HANDLED = {
    "unsorted": "rows after one of a later frame, sorted",
    "duplicated": "frames that stand twice, left out",
    "absent": "frames absent from the file",
    "still": "frames equal to the last in every point, kept",
    "low_likelihood": "points of low likelihood, left out",
    "missing": "points missing",
    "swapped": "frames with left and right exchanged, put back",
    "outliers": "points in wrong places, left out",
    "bridged": "points bridged over short gaps",
}
_DEGREES = 180.0 / math.pi
UNITS = {
    "gap": ("lengths", 1.0),
    "angle": ("deg", _DEGREES),
    "flex": ("deg", _DEGREES),
    "offset": ("deg", _DEGREES),
    "duration": ("s", 1.0),
}
"""Unit in which a criterion is shown, and how many of it are one of the flag's."""


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The shapes, what depends on each criterion, and what was wrong with the tracks."""
    frames, trials = result["frames"], result["trials_in_contact"]
    many = "one trial" if trials == 1 else f"the mean over {trials} trials"
    notes = [f"Shares of the frames in contact, {many}."]
    if result["classified_by"] == "direction":
        notes.append(
            "With two points along an antenna its bend cannot be seen: forward and "
            "backward\nare the side to which it points, and straight is not known."
        )
    if _free_air(result):
        notes.append("Without a wall every frame counts as contact.")
    shapes = Table(
        "Shapes in contact",
        ["share", "95 %"],
        [
            (name, [shown(row["share"]), shown(row["share_95"] or NONE)])
            for name, row in result["shapes"].items()
        ],
        "\n".join(notes),
    )
    varied = Table(
        f"The same with each criterion {100 * result['vary']:g} % less and more",
        [*SHAPES, "change"],
        [
            (
                _criterion(row["criterion"], row["value"]),
                [*(shown(row["share"][name]) for name in SHAPES), shown(row["change"])],
            )
            for row in result["sensitivity"]
        ],
    )
    counts = Table(
        "What was found in the tracks",
        ["number"],
        [
            *((f"frames {name}", [str(frames[name])]) for name in ("contact", "free", "unknown")),
            ("animals", [str(result["animals"])]),
            ("animals known in too few frames, left out", [str(result["skipped"])]),
            *((text, [str(result["handled"].get(name, 0))]) for name, text in HANDLED.items()),
        ],
    )
    return shapes, varied, counts


def _criterion(name: str, value: float) -> str:
    unit, scale = UNITS[name]
    return f"{name} [{unit}] {scale * value:.3g}"


def _free_air(result: Mapping[str, Any]) -> bool:
    return all(wall["kind"] == "none" for wall in result["wall"].values())


def sentence(result: Mapping[str, Any]) -> str:
    """Which shapes antennae in contact have, and how much depends on the criteria."""
    if not result["trials_in_contact"]:
        return f"No antenna was seen in contact{_nearest(result)}{_unseen(result)}"
    listed = ", ".join(
        f"{name} {100 * row['share']:.0f} %"
        + (f" ({shown(row['share_95'], '.0f', 100.0)})" if row["share_95"] else "")
        for name, row in result["shapes"].items()
        if row["share"] is not None
    )
    most = max(result["sensitivity"], key=lambda row: row["change"])
    correct = result["correct"]
    drawn = result.get("synthetic_shapes", "known")
    right = (
        ""
        if correct is None
        else f" Of frames with {drawn} shapes {100 * correct:.1f} % are classified correctly."
    )
    so_few = few([result["trials_in_contact"]])
    where = "With no wall given" if _free_air(result) else "In contact"
    return (
        f"{where}: {listed} of the frames. Of all criteria the {most['criterion']} matters "
        f"most: changed by {100 * result['vary']:g} % it moves a share by "
        f"{100 * most['change']:.1f} points.{right}{_beyond(result)}{_unseen(result)}"
        f"{so_few and f' {so_few}'}"
    )


def _nearest(result: Mapping[str, Any]) -> str:
    """How near to a wall the antennae came."""
    near = [wall["nearest"] for wall in result["wall"].values() if wall.get("nearest")]
    if not near:
        return "."
    unit = "; is the wall given in the unit of the file?" if min(near) > 1 else "."
    return f": the nearest point lay {min(near):.2g} lengths of an antenna from the wall{unit}"


def _beyond(result: Mapping[str, Any]) -> str:
    """Which walls many antennae reach beyond."""
    far = {name: wall["beyond"] for name, wall in result["wall"].items() if wall.get("beyond")}
    worst = max(far, key=lambda name: far[name], default="")
    if not worst or far[worst] <= MOST_BEYOND:
        return ""
    return (
        f" In {100 * far[worst]:.0f} % of the frames of {worst} an antenna reaches beyond the "
        "wall: is it where the file has it?"
    )


def _unseen(result: Mapping[str, Any]) -> str:
    """Which antennae were hardly ever seen."""
    antennae = result.get("unseen")
    if not antennae:
        return ""
    first = antennae[0]
    empty = f", as {', '.join(first['empty'])} never has a value" if first["empty"] else ""
    others = f"; {len(antennae) - 1} more in result.json" if len(antennae) > 1 else ""
    of = f" of {first['animal']}" if first["animal"] else ""
    return (
        f" The {first['side']} antenna{of} in {first['file']} is known in {first['known']} of "
        f"{first['frames']} frames{empty}{others}."
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    TracksConfig,
    run,
    tables,
    sentence,
    files=lambda outcome: {"frames.csv": outcome.frames_csv()},
    failed=lambda result: not result["trials_in_contact"],
    parts="files",
    captions={
        "tracks": "Shares of the shapes in each trial and over all, outlines of each shape, an "
        "angle over time, and what other criteria change.",
    },
    explained="docs/tracks.md",
    on_workers=False,
)
