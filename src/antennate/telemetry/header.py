"""The first record of a log: everything that its replay needs besides the readings."""

from __future__ import annotations

import json
from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from antennate import __version__
from antennate.errors import LogError
from antennate.params import ControlParams
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
        return _START + json.dumps(self.model_dump() | self._of_ticks()).encode()

    def _of_ticks(self) -> dict[str, Any]:
        """For other readers: layout of a tick in the words of `struct`, and what it holds.

        Its text is as long as the last number says.
        """
        names = ("schema", "kind", "joints", *fields(self.robot), "text")
        return {"record": layout(len(self.robot.ids)), "fields": names}

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
        except (AttributeError, TypeError, ValueError, RecursionError) as error:
            raise LogError(f"expected a header of a log, found {_fault(error)}") from None


def _fault(error: Exception) -> str:
    if isinstance(error, ValidationError):
        first = error.errors(include_url=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return "no JSON"
