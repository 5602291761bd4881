"""The first record of a log: everything that its replay needs besides the readings."""

from __future__ import annotations

import json

from pydantic import BaseModel, ConfigDict, ValidationError

from antennate import __version__
from antennate.errors import LogError
from antennate.params.control import ControlParams
from antennate.params.reading import describe
from antennate.robots.spec import RobotSpec
from antennate.telemetry.framing import SCHEMA, Kind
from antennate.telemetry.ticks import fields, layout

_START = bytes((SCHEMA, Kind.HEADER))


class Header(BaseModel):
    """Who decided, with which numbers, on which robot. On disk it is JSON.

    Attributes:
        controller: Name of the controller.
        params: Numbers of the controller.
        robot: The robot.
        seed: Seed of the world, None on a robot.
        trial: Trial of that seed.
        phase: Gait phase at the first tick [rad].
        version: Version of antennate that wrote it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    controller: str
    params: ControlParams
    robot: RobotSpec = RobotSpec()
    seed: int | None = None
    trial: int | None = None
    phase: float = 0.0
    version: str = __version__

    def pack(self) -> bytes:
        """The content of its record."""
        # For other readers: the layout of a tick for `struct`, and the names of its numbers. The
        # last is the length of the text behind them.
        names = ("schema", "kind", "joints", *fields(self.robot), "text")
        record = {"record": layout(len(self.robot.ids)), "fields": names}
        return _START + json.dumps(self.model_dump() | record).encode()

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
            table = json.loads(content[2:])
            for name in ("record", "fields"):  # the robot says the same
                table.pop(name, None)
            return cls.model_validate(table)
        except ValidationError as error:
            raise LogError(f"expected a header of a log: {describe(error, cls)}") from None
        except (AttributeError, TypeError, ValueError, RecursionError):
            raise LogError("expected a header of a log, found no JSON") from None
