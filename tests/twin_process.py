"""A twin in a process of its own: a line on its standard input is a fault that begins now.

Its scene is the first argument, if there is one.
"""

from __future__ import annotations

import json
import os
import select
import sys

from antennate.host import LEVEL, urgent
from antennate.twin.config import TwinConfig, watched
from antennate.twin.faults import Faults, read
from antennate.twin.robot import TwinRobot
from antennate.twin.serve import TwinServer

_STDIN = 0


class AskedFaults(Faults):
    """Faults that are named as in `antennate twin --fault`."""

    def apply(self, robot: TwinRobot, t: float) -> None:
        if select.select([_STDIN], [], [], 0.0)[0]:
            demands = [read(line) for line in os.read(_STDIN, 4096).decode().split()]
            Faults(demands, [servo.get("id") for servo in robot.servos]).apply(robot, t)


if __name__ == "__main__":
    config = TwinConfig(scene=sys.argv[1]) if sys.argv[1:] else TwinConfig()
    with TwinServer(watched(config)[0], AskedFaults([], ())) as server, urgent(LEVEL + 1):
        sys.stdout.write(json.dumps(server.paths) + "\n")
        sys.stdout.flush()
        server.run(lambda t: True)
