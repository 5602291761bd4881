"""The first record of a log: everything that its replay needs besides the readings."""

from __future__ import annotations

import json

from pydantic import BaseModel, ConfigDict, ValidationError

from antennate import __version__
from antennate.errors import LogError
from antennate.params import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.framing import SCHEMA, Kind
from antennate.telemetry.ticks import FIELDS, LAYOUT

_START = bytes((SCHEMA, Kind.HEADER))


class Header(BaseModel):
    """Who decided, with which numbers, on which robot. On disk it is JSON.

    Attributes:
        controller: Name of the controller.
        params: Numbers of the controller.
        robot: The robot, None in simulation.
        seed: Seed of the world, None on a robot.
        trial: Trial of that seed.
        phase: Gait phase at the first tick [rad].
        version: Version of antennate that wrote it.
        record: Layout of a tick for other readers, in the words of Python's `struct`; its text is
            as long as the last field says.
        fields: What it holds, in order.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    controller: str
    params: ControlParams
    robot: RobotSpec | None = None
    seed: int | None = None
    trial: int | None = None
    phase: float = 0.0
    version: str = __version__
    record: str = LAYOUT
    fields: tuple[str, ...] = FIELDS

    def pack(self) -> bytes:
        """The content of its record."""
        return _START + json.dumps(self.model_dump()).encode()

    @classmethod
    def unpack(cls, content: bytes) -> Header:
        """Back from `pack`.

        Raises:
            LogError: The content is of another schema, or not a header.
        """
        if content[0] != SCHEMA:
            raise LogError(
                f"expected a log of schema {SCHEMA}, found schema {content[0]}; read it with the "
                "version of antennate that wrote it"
            )
        if content[:2] != _START:
            raise LogError("expected a header as first record, found another kind")
        try:
            return cls.model_validate(json.loads(content[2:]))
        except (ValueError, RecursionError) as error:
            raise LogError(f"expected a header of a log, found {_fault(error)}") from None


def _fault(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return "no JSON"
