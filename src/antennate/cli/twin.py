"""`antennate twin`: the simulated robot behind two pseudo-terminals."""

from __future__ import annotations

import json
import secrets
import sys
from collections.abc import Sequence

from antennate.cli import OK
from antennate.cli.arguments import FromFile, parse_with
from antennate.cli.progress import terminate_as_interrupt
from antennate.experiments.twin import TwinConfig, build
from antennate.hardware.priority import LEVEL, urgent
from antennate.twin.faults import Faults, read
from antennate.twin.serve import TwinServer

DESCRIPTION = """\
Serve the simulated robot in a tunnel as real bytes on two pseudo-terminals: the frames of the
antenna board, and a DYNAMIXEL bus of 19 servos. Prints one JSON line with both paths when ready.
Physics begins when the first servo gets torque. Faults, each with @Ts for its time:
servo:ID=silent, bad_crc, truncated, late:SECONDS, doubled, wrong_id, oversized, voltage, overheat,
encoder, shock, overload, reboot or REGISTER:VALUE; esp32=silent, reset, open_left, open_right,
left:COUNTS or right:COUNTS; bus=silent, loss:SHARE or latency:SECONDS. --touch left@2s right@5s
bends the antennae of the standing robot, as the check by touch of `antennate drive` wants it."""


def command(argv: Sequence[str]) -> int:
    """Serve until the duration is over, Ctrl-C or SIGTERM.

    Raises:
        AntennateError: Something given cannot be used.
    """
    config, _ = parse_with("twin", DESCRIPTION, TwinConfig, argv, FromFile())
    faults = Faults([read(text) for text in config.fault], config.layout.ids)
    robot = build(config, boot_id=secrets.randbits(32))
    end = float("inf") if config.duration is None else config.duration
    with TwinServer(robot, faults) as server, terminate_as_interrupt(), urgent(LEVEL + 1):
        sys.stdout.write(json.dumps(server.paths) + "\n")
        sys.stdout.flush()
        server.run(lambda t: t < end and robot.failure is None)
    why = f"physics became invalid: {robot.failure}" if robot.failure else "the time is over"
    sys.stderr.write(f"antennate twin: {why}; latest tick {1e3 * server.late:.1f} ms late\n")
    return OK
