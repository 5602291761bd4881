"""The animal's taper and the robot's ladder side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from antennate import figures as style
from antennate.antenna import springs
from antennate.csv_files import column, csv_rows, number_of
from antennate.errors import BadInputError, ConfigError
from antennate.files import read_limited
from antennate.params.base import number
from antennate.params.spring import TaperParams
from antennate.studies.experiment import Experiment, Outcome
from antennate.studies.measures import Table, shown
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


@dataclass(frozen=True)
class TaperOutcome(Outcome):
    """A taper and two ladders.

    Attributes:
        diameter: Diameters base to tip [m], shape (n,).
        proxy: Stiffness of each segment over that of the base, shape (n,).
        stretches: The same for one stretch for each spring of the ladder, shape (m,).
        ladder: Stiffness of the ladder's springs over its first, shape (m,).
        suggested: Coils of the ladder that follows the taper best within limits, shape (m,).
    """

    config: TaperConfig
    diameter: Floats
    proxy: Floats
    stretches: Floats
    ladder: Floats
    suggested: Floats

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        suggested = springs.ladder_proxy(self.suggested)
        return {
            "schema": 1,
            "command": "taper",
            "segments": [
                {"diameter_mm": 1e3 * d, "second_moment_mm4": 1e12 * i, "proxy": k}
                for d, i, k in zip(
                    self.diameter.tolist(),
                    springs.second_moment(self.diameter).tolist(),
                    self.proxy.tolist(),
                    strict=True,
                )
            ],
            "base_over_tip": float(1.0 / self.proxy[-1]),
            "stretches": (self.stretches / self.stretches[0]).tolist(),
            "stretch_ratio": float(self.stretches[0] / self.stretches[-1]),
            "ladder": _ladder(np.array(self.config.ladder), self.ladder, self.stretches),
            "suggested": _ladder(self.suggested, suggested, self.stretches),
        }


def _ladder(coils: Floats, proxy: Floats, stretches: Floats) -> dict[str, Any]:
    return {
        "active_coils": coils.tolist(),
        "proxy": proxy.tolist(),
        "base_over_tip": float(proxy[0] / proxy[-1]),
        "distance_decades": springs.distance_decades(proxy, stretches / stretches[0]),
    }


def run(config: TaperConfig) -> TaperOutcome:
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
    return TaperOutcome(
        config=config,
        diameter=diameter,
        proxy=proxy,
        stretches=stretches,
        ladder=springs.ladder_proxy(np.array(config.ladder)),
        suggested=springs.follow(stretches / stretches[0], fewest, most),
    )


def read_diameters(path: Path) -> Floats:
    """Diameters [m] from a CSV file with a column `diameter_mm`, base first.

    Raises:
        BadInputError: The file cannot be read, or a row holds no diameter.
    """
    rows = csv_rows(path, read_limited(path, _LARGEST_FILE), [COLUMN], BadInputError)
    place = column(next(rows)[1], COLUMN) or 0
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
_COLUMNS = {"d [mm]": "diameter_mm", "I [mm⁴]": "second_moment_mm4", "proxy": "proxy"}


def tables(result: Mapping[str, Any]) -> Sequence[Table]:
    """Segments of the animal, and ladders of springs."""
    rows = result["segments"]
    step = -(-len(rows) // _SEGMENTS)
    animal = [
        (f"segment {i + 1}", [shown(row[key], ".3g") for key in _COLUMNS.values()])
        for i, row in enumerate(rows)
        if i % step == 0
    ]
    ladder, suggested = result["ladder"], result["suggested"]
    springs = zip(result["stretches"], ladder["proxy"], suggested["proxy"], strict=True)
    return (
        Table(
            "Animal", list(_COLUMNS), animal, f"Base over tip {result['base_over_tip']:.0f} : 1."
        ),
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


_ANIMAL, _STRETCHES = style.INK, style.MUTED
_LADDER, _SUGGESTED = style.PROFILE_LOOKS["descending"][0], "#56B4E9"
"""The ladder is that of the descending profile, unless told otherwise; no profile has the other."""


@style.styled
def figures(outcome: TaperOutcome) -> dict[str, Figure]:
    """The proxy of the animal, its stretches, the ladder, and the ladder that follows it best."""
    figure, result = style.canvas(style.WIDTH, 3.8), outcome.result()
    panel = figure.subplots()
    segments = np.array([row["proxy"] for row in result["segments"]])
    places = (np.arange(len(segments)) + 0.5) / len(segments)
    panel.plot(
        places,
        segments,
        color=_ANIMAL,
        marker="o",
        markersize=4,
        label=f"animal, {len(segments)} segments: {result['base_over_tip']:.0f} : 1",
    )
    _steps(panel, result["stretches"], _STRETCHES, (0, (2, 1.5)), "animal, one stretch a spring")
    for name, colour in (("ladder", _LADDER), ("suggested", _SUGGESTED)):
        row = result[name]
        label = f"{name} {_coils(row)}: {row['base_over_tip']:.3g} : 1"
        _steps(panel, row["proxy"], colour, "solid", label)
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
    *(__name__, TaperConfig, lambda config, *_: run(config), tables, sentence),
    figures=figures,
    captions={
        "taper": "Stiffness along the antenna of the animal, and along the springs of the robot.",
    },
    explained="docs/results.md",
    on_workers=False,
)
