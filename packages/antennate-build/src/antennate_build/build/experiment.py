"""The experiment `build`: files, tables and closing sentence of what is built."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from antennate.studies.columns import columns
from antennate.studies.experiment import Experiment, Files, RunOutcome
from antennate.studies.tables import Table
from antennate_build.build.config import BuildConfig, read, require_kernel
from antennate_build.build.naming import file_names
from antennate_build.build.result import BuildResult, PartMade, SpringMade

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class BuildOutcome(RunOutcome):
    """Files by name, drawings, and what they come to."""

    found: BuildResult
    files: Mapping[str, str | bytes]
    figures: Mapping[str, Figure]

    def result(self) -> BuildResult:
        """Parts, springs, checks and masses."""
        return self.found


def run(config: BuildConfig, on_step: Callable[[int, int], None]) -> BuildOutcome:
    """Make the parts, check them, draw them."""
    require_kernel()
    from antennate_build.build.making import made  # imports the kernel

    return BuildOutcome(*made(config, on_step))


def settled(config: BuildConfig, folder: Path | None) -> BuildConfig:
    """The configuration, after whatever would refuse it at the end has been asked."""
    file_names(config)
    require_kernel()
    return config


def files(config: BuildConfig) -> Files:
    """Names of the files, and what makes the content of each."""

    def content(name: str) -> Callable[[Any], str | bytes | None]:
        return lambda outcome: outcome.files.get(name)

    return {name: content(name) for name in file_names(config)}


def tables(result: BuildResult) -> Sequence[Table]:
    """Tables of parts, springs, masses and checks."""
    found = [Table.lines("Printed parts", result.parts, columns(PartMade), _of_parts(result.parts))]
    if result.springs:
        springs = {f"{spring.turns:g} turns": spring for spring in result.springs}
        found.append(Table.of("Springs", springs, columns(SpringMade)))
    found.append(
        Table.lines(
            "Specification and parts",
            {f"{name} [{each.unit}]": each for name, each in result.masses.items()},
            note="\n".join(result.apart),
        )
    )
    checks = [
        (check.name, ["NOT OK" if not check.good else "warn" if check.warn else "ok"])
        for check in result.checks
    ]
    said = "\n".join(f"{check.name}: {check.found}" for check in result.checks)
    return [*found, Table("Checks", ("",), checks, said)]


def _of_parts(parts: Mapping[str, PartMade]) -> str:
    lines = [
        f"{name}: {what}"
        for name, part in parts.items()
        for what in (
            *([f"thinner than asked for {part.thin_at}"] if part.thin_at else []),
            *part.supports,
        )
    ]
    return "\n".join(lines) or "All print without support."


def sentence(result: BuildResult) -> str:
    """How many parts there are, whether they fit, and what they weigh."""
    count = sum(part.count for part in result.parts.values())
    grams = sum(part.count * part.mass_g for part in result.parts.values())
    bad = [check.name for check in result.checks if not check.good]
    fit = f"these are not as they must be: {', '.join(bad)}" if bad else "all checks hold"
    if warned := [check.name for check in result.checks if check.warn]:
        fit += f"; look at: {', '.join(warned)}"
    name, mass = next(iter(result.masses.items()))
    springs = ""
    if result.springs:
        worst = max((spring.error for spring in result.springs), key=abs)
        springs = (
            f"; springs of {result.springs[0].wire_mm:g} mm wire come within "
            f"{100 * abs(worst):.1f} % of their stiffness"
        )
    return (
        f"{count} printed parts of {len(result.parts)} kinds, {grams:.0f} g; {fit}; the {name} is "
        f"{100 * mass.difference:+.1f} % beside that of the simulation{springs}; computed, not "
        "printed yet."
    )


EXPERIMENT = Experiment.of_folder(
    __name__,
    BuildConfig,
    lambda config, workers, on_step, on_row: run(config, on_step),
    tables,
    sentence,
    result=BuildResult,
    files=files,
    settled=settled,
    figures=lambda outcome: outcome.figures,
    captions={
        "antenna": "The antenna from above and from the side, a segment with its sizes, springs.",
        "assembly": "The first hinges taken apart, and the steps of the assembly.",
        "bracket": "The bracket on the horn of its servo.",
        "antenna_bent": "The antenna with its hinges bent.",
        "link": "A link of the robot with its servos, from three sides.",
        "robot": "The robot put together.",
    },
    workers="none",
    of_file=read,
    counted="parts",
)
