"""What is run: controllers, scenes and draws; and the seeds that nobody could tune on."""

from __future__ import annotations

import contextlib
import re
import secrets
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import ClassVar

from pydantic import field_validator, model_validator

from antennate.control.registry import CONTROLLERS, KINDS
from antennate.errors import BadInputError, ConfigError
from antennate.files import decoded, read_limited
from antennate.params.base import LARGEST_SEED, Params, number, read_file, require_different
from antennate.sim.scenes.registry import SHIPPED, check_name
from antennate.studies.formats import from_csv
from antennate.studies.run_files import CONFIG

DEVELOPMENT = range(600_000, 600_100)
"""Public seeds, to tune on; hidden ones are never among them."""
RESERVED = range(700_000, 800_000)
"""Seeds that are kept for evaluations by others; no run may have one of them."""
_SEEDS = 2**31
"""Hidden seeds lie below that."""
LARGEST_TABLE = 100_000_000
"""Most bytes of a table of trials."""
CONTROLLERS_OF_BOARD = (
    *("open", "timed", "schedule", "paper", "closed", "geometric", "follow", "centre"),
    "map",
)
SCENES_OF_BOARD = (
    *("uturn", "corner", "deadend", "room", "heavy"),
    "uturn+variation.broken=random",
    "uturn+variation.reading_noise=3",
    "uturn+readings=delayed:0.02",
)
"""Five of the hard set, and one of them with a broken antenna, with three times the noise, and with
readings that are 15 ms late, which at 100 Hz are used two ticks later."""


PART = re.compile(r"\+(?=[a-z0-9_.]+=)")
"""What parts a controller or a scene from its parameters, and these from each other."""


def plain(text: str) -> str:
    """The name of a controller or a scene without the parameters behind it."""
    return PART.split(text)[0]


class CompeteConfig(Params):
    """Everything that decides the outcome of `antennate compete`."""

    offered: ClassVar[Mapping[str, Collection[str]]] = {"controllers": KINDS, "scenes": SHIPPED}

    controllers: tuple[str, ...] = number(
        CONTROLLERS_OF_BOARD,
        "1",
        "assumed: rules by touch, blind ones, and one with a map",
        min_length=1,
    )
    """Controllers: names of `tunnel --controllers`, those of installed packages, MODULE:NAME,
    FILE.py:NAME, or FILE.onnx, each with other numbers of the control behind a +, as
    geometric+gait.frequency=0.8."""
    scenes: tuple[str, ...] = number(
        SCENES_OF_BOARD,
        "1",
        "assumed: those that our controllers do not all cross (docs/science/corridors.md)",
        min_length=1,
    )
    """Scenes: names of `tunnel --scene`, each with other parameters behind a +, as
    uturn+variation.reading_noise=3."""
    trials: int = number(10, "1", "assumed: to look; a board takes 100", ge=1, le=100_000)
    """Trials of every controller in every scene."""
    seed: int = number(
        DEVELOPMENT.start,
        "1",
        "assumed: the first of the public seeds, 600000 to 600099",
        ge=0,
        le=LARGEST_SEED,
    )
    """Seed of all chance, not one of 700000 to 799999; with `hidden` the one that was drawn."""
    hidden: bool = number(False, "1", "assumed: to develop on public seeds")
    """Draw the seed from the system's entropy when the run begins; the result publishes it."""
    decision_limit: float = number(
        0.05, "s", "assumed: five control periods, after which readings are stale", gt=0, le=60
    )
    """Processor time that a decision may take; waiting is given 20 times as long."""
    tie: float = number(
        0.015,
        "1",
        "measured: two instruction sets, 193 and 196 of the same 200 draws (docs/performance.json)",
        ge=0,
        le=1,
    )
    """Success shares that differ by no more than this are a tie."""
    check: str | None = number(None, "1", "assumed: no file", metavar="FILE")
    """Table of trials, trials.csv of a run, whose rows are run again and compared."""

    def unread_here(self) -> Mapping[str, str]:
        """What the file says, where there is one."""
        names = ("controllers", "scenes", "trials", "seed", "hidden") if self.check else ()
        return dict.fromkeys(names, "the file of check says it")

    def names_in_files(self) -> Iterable[str]:
        """Controllers and scenes without their parameters, and those of a table that is checked."""
        yield from map(plain, (*self.controllers, *self.scenes))
        with contextlib.suppress(OSError, ValueError, BadInputError):  # told where it is read
            path = Path(self.check or "")
            data = read_limited(path, LARGEST_TABLE, ConfigError) if self.check else b""
            lines = from_csv(decoded(path, data, ConfigError)) if data else []
            columns = ("controller", "scene")
            yield from {plain(str(line.get(name))) for line in lines for name in columns}

    @field_validator("seed")
    @classmethod
    def _free_seed(cls, seed: int) -> int:
        return require_unreserved(seed)

    @field_validator("controllers")
    @classmethod
    def _known_controllers(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        return tuple(CONTROLLERS.check(plain(name)) + name[len(plain(name)) :] for name in names)

    @field_validator("scenes")
    @classmethod
    def _known_scenes(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        for name in names:
            check_name(plain(name))
        return names

    @model_validator(mode="after")
    def _agree(self) -> CompeteConfig:
        require_different("controllers", self.controllers)
        require_different("scenes", self.scenes)
        return self


def require_unreserved(seed: int) -> int:
    """A seed that is not reserved."""
    if seed in RESERVED:
        raise ValueError(
            f"expected no seed of {RESERVED[0]} to {RESERVED[-1]}, which are reserved, found {seed}"
        )
    return seed


def hidden_seed(draw: Callable[[int], int] = secrets.randbelow) -> int:
    """A seed that nobody knew: neither public nor reserved.

    Args:
        draw: draw(n) -> a number of 0 to n - 1, from the entropy of the system if not given.
    """
    while (seed := draw(_SEEDS)) in DEVELOPMENT or seed in RESERVED:
        pass
    return seed


def settled(config: CompeteConfig, folder: Path | None) -> CompeteConfig:
    """The configuration with its hidden seed: that of the run that goes on, or a fresh one."""
    if not config.hidden:
        return config
    file = None if folder is None else folder / CONFIG
    known = None if file is None or not file.is_file() else read_file(file, CompeteConfig)
    drawn = known.seed if known is not None and known.hidden else None
    if "seed" in config.model_fields_set and config.seed != drawn:
        raise ConfigError(
            f"seed: expected none beside hidden, which draws one, found {config.seed}; a run that "
            "was stopped keeps its own with resume"
        )
    seed = hidden_seed() if drawn is None else drawn
    return config.model_copy(update={"seed": seed})
