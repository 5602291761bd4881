"""`drive` before a twin over real ports, in the twin's own time: the same bits on any machine."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack

import pytest
from ticked_rig import Late, served, terminals

from antennate.controller import Arm
from antennate.experiments.driven import Driven, driven
from antennate.experiments.tunnel import TunnelConfig
from antennate.hardware.driving.drive import DriveConfig, connect
from antennate.hardware.driving.session import Session
from antennate.params import LayoutParams
from antennate.twin.ends import End
from antennate.twin.robot import TwinRobot
from antennate.twin.tcp import TcpEnd

CONFIG = TunnelConfig(seed=0)
LAYOUT = LayoutParams()


def over(ends: Callable[[], list[End]], arm: Arm, trial: int, ticks: float) -> Driven:
    """The trial by a `drive` that is connected to a twin over real ports."""
    with ExitStack() as stack:

        def wired(orders: DriveConfig, robot: TwinRobot) -> Session:
            paths = stack.enter_context(served(robot, ends))
            wires = connect(orders, paths["esp32"], paths["bus"], clock=paths["clock"])
            return stack.enter_context(wires)

        return driven(CONFIG, arm, trial, LAYOUT, ticks, wired)


def late_terminals() -> list[End]:
    return [Late(end, 0.0005) for end in terminals()]


def tcp_ports() -> list[End]:
    return [TcpEnd("127.0.0.1", 0) for _ in range(3)]


@pytest.fixture(scope="module")
def in_process() -> Driven:
    return driven(CONFIG, "closed", 0, LAYOUT, 200)


@pytest.mark.parametrize(
    ("ends", "ticks"), [(terminals, 200), (tcp_ports, 60), (late_terminals, 30)]
)
def test_M7_drive_over_real_ports_is_bit_for_bit_that_without_ports(
    ends: Callable[[], list[End]], ticks: int, in_process: Driven
) -> None:
    one = over(ends, "closed", 0, ticks)
    assert len(one.walk.maneuvers) == ticks
    assert one.start == in_process.start
    assert one.walk.readings == in_process.walk.readings[:ticks]
    assert one.walk.maneuvers == in_process.walk.maneuvers[:ticks]
    assert one.walk.poses == in_process.walk.poses[:ticks]
    assert one.walk.goals == in_process.walk.goals[:ticks]
    if ticks == 200:
        assert one.report == in_process.report
