"""The experiment `tracks`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from antennate.experiments.tracks import run as tracks
from antennate.experiments.tracks.config import TracksConfig
from antennate.experiments.tracks.measures import SHAPES
from antennate.studies.experiment import Experiment
from antennate.studies.measures import NONE, Table, few, shown

HANDLED = {
    "duplicated": "frames that stand twice, left out",
    "absent": "frames absent from the file",
    "still": "frames equal to the last in every point, kept",
    "low_likelihood": "points of low likelihood, left out",
    "missing": "points missing",
    "swapped": "frames with left and right exchanged, put back",
    "outliers": "points in wrong places, left out",
    "bridged": "points bridged over short gaps",
}
LABELS = {
    "gap": "gap to the wall / length",
    "angle": "angle of pointing [rad]",
    "flex": "bend [rad]",
    "offset": "offset of the tip [rad]",
    "duration": "duration [s]",
}


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """The shapes, what depends on each criterion, and what was wrong with the tracks."""
    found, notes = result["frames"], []
    if result["classified_by"] == "direction":
        notes.append(
            "With two points along an antenna its bend cannot be seen: forward and "
            "backward\nare the side to which it points, and straight is not known."
        )
    if _free_air(result):
        notes.append("Without a wall every frame counts as contact.")
    shapes = Table(
        f"Share of the frames in contact, trials: {result['trials_in_contact']}",
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
                f"{LABELS[row['criterion']]} {row['value']:.3g}",
                [*(shown(row["share"][name]) for name in SHAPES), shown(row["change"])],
            )
            for row in result["sensitivity"]
        ],
    )
    counts = Table(
        "What was found in the tracks",
        ["number"],
        [
            *((f"frames {name}", [str(found[name])]) for name in ("contact", "free", "unknown")),
            ("animals", [str(result["animals"])]),
            ("animals known in too few frames, left out", [str(result["skipped"])]),
            *((text, [str(result["handled"][name])]) for name, text in HANDLED.items()),
        ],
    )
    return shapes, varied, counts


def _free_air(result: Mapping[str, Any]) -> bool:
    return all(wall["kind"] == "none" for wall in result["wall"].values())


def sentence(result: Mapping[str, Any]) -> str:
    """Which shapes antennae in contact have, and how much depends on the criteria."""
    if not result["trials_in_contact"]:
        return "No antenna was seen in contact."
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
        f"{where}: {listed} of the frames. Of all criteria {LABELS[most['criterion']]} matters "
        f"most: changed by {100 * result['vary']:g} % it moves a share by "
        f"{100 * most['change']:.1f} points.{right}{so_few and f' {so_few}'}"
    )


CAPTIONS = {
    "tracks": "Shares of the shapes in each trial and over all, outlines of each "
    "shape, an angle over time, and what other criteria change.",
}

EXPERIMENT = Experiment.of_folder(
    __name__,
    TracksConfig,
    tracks.run,
    tables,
    sentence,
    files=lambda outcome: {"frames.csv": outcome.frames_csv()},
    failed=lambda result: not result["trials_in_contact"],
    parts="files",
    captions=CAPTIONS,
    on_workers=False,
)
