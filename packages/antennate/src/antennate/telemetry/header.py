"""What a log says before its first tick, and the names of its files.

The header holds everything that a replay needs besides the readings. A new file is begun whenever
the process that keeps the log dies.
"""

from __future__ import annotations

import contextlib
import json
import platform
import re
from collections.abc import Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import Field, ValidationError

from antennate import __version__
from antennate.control.readings import OWN
from antennate.errors import LogError
from antennate.params.base import Strict
from antennate.params.control import ControlParams
from antennate.params.faults import describe
from antennate.robots.spec import RobotSpec
from antennate.sim.engine_setup import engines

if TYPE_CHECKING:
    from antennate.telemetry.topics import Topic

TWIN = "twin"
"""The controller of a twin's log: what its client decides is not known."""
MOST_PARTS = 10
"""Files that one log can have."""
LIBRARY = "antennate "
"""How the program is named that writes the logs of antennate, before its version."""
RECOVERED = "-recovered"
"""What follows the name of a log that was recovered."""


@lru_cache
def versions(packages: tuple[str, ...] = ()) -> Mapping[str, str]:
    """What numbers may depend on, by name.

    Args:
        packages: Optional packages that count too; one that is not installed is left out.
    """
    table = {
        "antennate": __version__,
        "python": platform.python_version(),
        "numpy": metadata.version("numpy"),
        "scipy": metadata.version("scipy"),
        "mujoco": next(iter(engines().values()), "none"),
        "platform": f"{platform.system()} {platform.machine()}",
    }
    for name in packages:
        if name not in table:
            with contextlib.suppress(metadata.PackageNotFoundError):
                table[name] = metadata.version(name)
    return table


class Header(Strict):
    """Who decided, with which numbers, on which robot.

    Attributes:
        controller: Name of the controller.
        readings: What the controller was given, `own` for what its robot read; the ticks hold
            what it was given.
        params: Numbers of the controller.
        robot: The robot.
        seed: Seed of the world, None on a robot.
        trial: Trial of that seed.
        phase: Gait phase at the first tick [rad].
        joint_bias: Errors of the zeros of the yaw joints in a simulation [rad]; what its servos
            report is that much less than the angles in the log. Empty on a robot.
        start: Unix time at which the loop's time was 0 [ns]; 0 where time is simulated.
        arena: Settings of the trial that tell its scene, as `TrialConfig` has them without the
            robot; empty where its run tells, or where it was no simulation.
        knows: What a simulation gave to the controller beside its readings; not in the log.
        calibration: The calibration file of the antennae, as text; empty without one.
        protocol: The protocol of recordings of a drive, as its `Protocol` has it for this robot;
            empty of others.
        versions: Versions of what wrote it, by name.
    """

    controller: str
    readings: str = OWN
    params: ControlParams
    robot: RobotSpec = RobotSpec()
    seed: int | None = None
    trial: int | None = None
    phase: float = 0.0
    joint_bias: tuple[float, ...] = ()
    start: int = Field(default=0, ge=0, lt=1 << 62)
    arena: Mapping[str, Any] = Field(default_factory=dict)
    knows: tuple[str, ...] = ()
    calibration: str = ""
    protocol: Mapping[str, Any] = Field(default_factory=dict)
    versions: Mapping[str, str] = Field(default_factory=versions)

    @property
    def version(self) -> str:
        """Version of antennate that wrote it."""
        return self.versions.get("antennate", "of unknown version")

    def pack(self) -> bytes:
        """All of it as bytes, for another process."""
        return self.model_dump_json().encode()

    @classmethod
    def unpack(cls, content: bytes) -> Header:
        """Header from the bytes of `pack`.

        Raises:
            LogError: It is no header.
        """
        return _checked(content)

    def messages(self) -> dict[Topic, bytes]:
        """Messages of the header in a log."""
        from antennate.telemetry.topics import CALIBRATION, CONFIG, VERSIONS  # not without a log

        apart = {"calibration", "versions"} | (set() if self.protocol else {"protocol"})
        texts = {
            CONFIG: self.model_dump_json(exclude=apart),
            VERSIONS: json.dumps(dict(self.versions)),
        }
        if self.calibration:
            texts[CALIBRATION] = self.calibration
        return {topic: topic.type.encode(text) for topic, text in texts.items()}

    @classmethod
    def of_messages(cls, messages: Mapping[Topic, bytes]) -> Header:
        """Header from the messages of a log.

        Raises:
            LogError: One is missing or damaged.
        """
        from antennate.telemetry.topics import CALIBRATION, CONFIG, HEADER_TOPICS, VERSIONS

        texts = {
            topic: topic.decode(messages[topic])["data"]
            for topic in HEADER_TOPICS
            if topic in messages
        }
        if CONFIG not in texts:
            raise LogError(f"expected a header of a log, found no {CONFIG.name}")
        try:
            table: Any = json.loads(texts[CONFIG])
            table |= {"versions": json.loads(texts.get(VERSIONS, "{}"))}
        except (TypeError, ValueError, RecursionError):
            raise LogError("expected a header of a log, found no JSON") from None
        return _checked(table | {"calibration": texts.get(CALIBRATION, "")})


def _checked(content: bytes | Mapping[str, Any]) -> Header:
    try:
        read = Header.model_validate_json if isinstance(content, bytes) else Header.model_validate
        return read(content)  # type: ignore[arg-type]
    except ValidationError as error:
        raise LogError(f"expected a header of a log: {describe(error, Header)}") from None


def log_name(name: str) -> str:
    """File of the log of a simulated trial or walk with a name of any characters."""
    return re.sub(r"[^\w.-]", "_", name) + ".mcap"


def part(path: Path, number: int) -> Path:
    """The n-th file of a log, 1 the first: `drive.mcap`, then `drive-2.mcap` beside it."""
    return path if number == 1 else path.with_name(f"{path.stem}-{number}{path.suffix}")


def parts(path: Path) -> tuple[Path, ...]:
    """The first file and those that continue it; one that was never begun is left out."""
    following = (part(path, number) for number in range(2, MOST_PARTS + 1))
    return (path, *(each for each in following if each.exists()))
