"""The animal's taper and the robot's ladder side by side."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.antenna import springs
from antennate.csv_files import column as column_named
from antennate.csv_files import csv_rows, number_of
from antennate.errors import BadInputError, ConfigError
from antennate.files import read_limited
from antennate.params.base import number
from antennate.params.spring import TaperParams
from antennate.studies.columns import column, shown, tabular
from antennate.studies.experiment import Done, Experiment
from antennate.studies.tables import Table
from antennate.types import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMN = "diameter_mm"
"""Column of a file of measured diameters, base first."""
_LARGEST_FILE = 1_000_000
_LARGEST_MM = 100.0


class TaperConfig(TaperParams):
    """The taper and, if measured, the file of its diameters."""

    diameters: str | None = number(None, "1", "assumed: no measurement")
    """CSV file with a column diameter_mm, base first; replaces segments, ends and law."""


@tabular
class Segment:
    """A segment of the animal's antenna."""

    diameter_mm: float = column("d", "mm", form=".3g")
    """Diameter."""
    second_moment_mm4: float = column("I", "mm⁴", form=".3g")
    """Second moment of area of the round section [mm⁴]."""
    proxy: float = column("proxy", form=".3g")
    """Stiffness over that of the base."""


@tabular
class Ladder:
    """Springs in a row, base first."""

    active_coils: list[float]
    """Active coils of each spring."""
    proxy: list[float]
    """Stiffness of each spring over that of the first."""
    base_over_tip: float
    """Stiffness of the first spring over that of the last."""
    distance_decades: float
    """RMS distance of the stiffnesses from those of the stretches, in powers of ten."""

    @property
    def name(self) -> str:
        """Coils as tables and figures name them."""
        return "-".join(f"{n:g}" for n in self.active_coils)


@tabular
class TaperResult:
    """What a run comes to."""

    schema: int = 1
    command: str = "taper"
    segments: list[Segment]
    """Segments of the animal, base first."""
    base_over_tip: float
    """Stiffness of the base over that of the tip."""
    stretches: list[float]
    """Stiffness of the animal in as many stretches as the ladder has springs, over that of the
    first; of each stretch the harmonic mean."""
    stretch_ratio: float
    """Stiffness of the first stretch over that of the last."""
    ladder: Ladder
    """Springs of the robot, or those that were given."""
    suggested: Ladder
    """Springs that follow the stretches best within the limits of coils."""


def run(config: TaperConfig) -> Done:
    """Work out the taper, its distance from the ladder, and a ladder that follows it better.

    Raises:
        BadInputError: The file of diameters cannot be used, or limits are the wrong way round.
    """
    fewest, most = config.coil_limits
    if fewest >= most:
        raise ConfigError(f"coil_limits: expected the smaller first, found {fewest} and {most}")
    if config.diameters is None:
        diameter = springs.diameters(config)
    else:
        diameter = read_diameters(Path(config.diameters))
    proxy = springs.proxy(diameter)
    stretches = springs.binned(proxy, len(config.ladder))
    animal = stretches / stretches[0]
    result = TaperResult(
        segments=_segments(diameter, proxy),
        base_over_tip=float(1.0 / proxy[-1]),
        stretches=animal.tolist(),
        stretch_ratio=float(stretches[0] / stretches[-1]),
        ladder=_ladder(np.array(config.ladder), animal),
        suggested=_ladder(springs.follow(animal, fewest, most), animal),
    )
    return Done(rows=(), found=result)


def _segments(diameter: Floats, proxy: Floats) -> list[Segment]:
    """Segments of these diameters [m] and stiffnesses, both of shape (n,)."""
    moments = springs.second_moment(diameter)
    values = zip(diameter.tolist(), moments.tolist(), proxy.tolist(), strict=True)
    return [
        Segment(diameter_mm=1e3 * d, second_moment_mm4=1e12 * moment, proxy=stiffness)
        for d, moment, stiffness in values
    ]


def _ladder(coils: Floats, animal: Floats) -> Ladder:
    """Springs of these coils beside the stretches of the animal, both of shape (m,)."""
    proxy = springs.ladder_proxy(coils)
    return Ladder(
        active_coils=coils.tolist(),
        proxy=proxy.tolist(),
        base_over_tip=float(proxy[0] / proxy[-1]),
        distance_decades=springs.distance_decades(proxy, animal),
    )


def read_diameters(path: Path) -> Floats:
    """Diameters [m] from a CSV file with a column `diameter_mm`, base first.

    Raises:
        BadInputError: The file cannot be read, or a row holds no diameter.
    """
    rows = csv_rows(path, read_limited(path, _LARGEST_FILE), [COLUMN], BadInputError)
    place = column_named(next(rows)[1], COLUMN) or 0
    diameters = [_diameter(path, line, "".join(cells[place : place + 1])) for line, cells in rows]
    if len(diameters) < 2:
        raise BadInputError(
            f"{path}: expected at least 2 rows of diameters, found {len(diameters)}"
        )
    return 1e-3 * np.array(diameters)


def _diameter(path: Path, line: int, cell: str) -> float:
    try:
        value, wanted = number_of(cell), f"a diameter above 0 and up to {_LARGEST_MM:g} mm"
    except ValueError as error:
        value, wanted = 0.0, str(error)
    if not 0 < value <= _LARGEST_MM:
        raise BadInputError(f"{path}: row {line}: expected {wanted}, found {cell[:40]!r}")
    return value


_SEGMENTS = 20
"""Most lines of the table."""


def tables(result: TaperResult) -> Sequence[Table]:
    """Segments of the animal, and ladders of springs."""
    every = -(-len(result.segments) // _SEGMENTS)
    numbered = {f"segment {i + 1}": segment for i, segment in enumerate(result.segments)}
    ladder, suggested = result.ladder, result.suggested
    springs = zip(result.stretches, ladder.proxy, suggested.proxy, strict=True)
    return (
        Table.lines(
            "Animal",
            dict(list(numbered.items())[::every]),
            note=f"Base over tip {result.base_over_tip:.0f} : 1.",
        ),
        Table(
            "One spring a stretch, over the first",
            ("animal", "ladder", "suggested"),
            [(f"spring {i + 1}", [shown(v, ".3g") for v in row]) for i, row in enumerate(springs)],
            f"Stretches of the animal fall {result.stretch_ratio:.0f} : 1, the ladder "
            f"{ladder.base_over_tip:.3g} : 1, the suggested one "
            f"{suggested.base_over_tip:.3g} : 1.",
        ),
    )


def sentence(result: TaperResult) -> str:
    """How far the ladders are from the animal."""
    ladder, suggested = result.ladder, result.suggested
    return (
        f"The ladder {ladder.name} is {ladder.distance_decades:.2f} decades from the animal "
        f"(root mean square), {suggested.name} would be {suggested.distance_decades:.2f}; "
        "computed from diameters, nothing was measured."
    )


_ANIMAL, _STRETCHES = style.INK, style.MUTED
_LADDER, _SUGGESTED = style.PROFILE_LOOKS["descending"][0], "#56B4E9"
"""The ladder is that of the descending profile, unless told otherwise; no profile has the other."""


@style.styled
def figures(outcome: Done) -> dict[str, Figure]:
    """The proxy of the animal, its stretches, the ladder, and the ladder that follows it best."""
    result: TaperResult = outcome.result()
    figure = style.canvas(style.WIDTH, 3.8)
    panel = figure.subplots()
    segments = np.array([segment.proxy for segment in result.segments])
    places = (np.arange(len(segments)) + 0.5) / len(segments)
    panel.plot(
        places,
        segments,
        color=_ANIMAL,
        marker="o",
        markersize=4,
        label=f"animal, {len(segments)} segments: {result.base_over_tip:.0f} : 1",
    )
    _steps(panel, result.stretches, _STRETCHES, (0, (2, 1.5)), "animal, one stretch a spring")
    ladders = ("ladder", result.ladder, _LADDER), ("suggested", result.suggested, _SUGGESTED)
    for name, ladder, colour in ladders:
        label = f"{name} {ladder.name}: {ladder.base_over_tip:.3g} : 1"
        _steps(panel, ladder.proxy, colour, "solid", label)
    panel.set_yscale("log")
    panel.set(
        xlim=(0, 1),
        xlabel="place along the antenna, base to tip",
        ylabel="stiffness over that of the base",
    )
    panel.legend(loc="lower left", fontsize=8)
    return {"taper": figure}


def _steps(panel: Axes, values: list[float], colour: Any, line: Any, label: str) -> None:
    edges = np.linspace(0.0, 1.0, len(values) + 1)
    look = {"color": colour, "linestyle": line, "linewidth": 1.8}
    above = 3 if line != "solid" else 2  # dashes show a line below them
    panel.stairs(values, edges, baseline=None, label=label, zorder=above, **look)


EXPERIMENT = Experiment.of_folder(
    __name__,
    TaperConfig,
    lambda config, *_: run(config),
    tables,
    sentence,
    result=TaperResult,
    figures=figures,
    captions={
        "taper": "Stiffness along the antenna of the animal, and along the springs of the robot.",
    },
    workers="none",
)
