"""A client on a serial port, as slow as it likes, gets what invented time gives."""

from __future__ import annotations

import os
import random
import threading
import time
import tty

import numpy as np
import pytest
from lockstep import BoardPort, LockstepClock

from antennate.hardware.esp32.wire import FrameDecoder, Sample
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig, watched
from antennate.twin.faults import Faults, read
from antennate.twin.robot import TwinRobot
from antennate.twin.serve import TwinServer
from dynamixel_bus import packets
from dynamixel_bus.parser import Parser

IDS = RobotSpec().ids
PERIOD = 0.01
TICKS = 60


def goals_of(robot: TwinRobot, step: int) -> bytes:
    """A sync write: where the servos stand, legs and body ever further by unlike steps [ticks]."""
    standing = [round(servo.position) for servo in robot.servos]
    ahead = [step * (4 + place % 3) if place < 17 else 0 for place in range(19)]
    return sync_write(116, 4, [at + more for at, more in zip(standing, ahead, strict=True)])


def sync_write(address: int, size: int, values: list[int]) -> bytes:
    named = zip(IDS, values, strict=False)
    data = {servo: value.to_bytes(size, "little", signed=True) for servo, value in named}
    return packets.sync_write(address, data)


TORQUE = sync_write(64, 1, [1] * 19)


def in_invented_time() -> bytes:
    robot = watched(TwinConfig(), boot_id=5)[0]
    plan = [goals_of(robot, step) for step in range(TICKS)]
    clock = LockstepClock(robot)
    board, came = BoardPort(robot, clock), b""
    clock.write(TORQUE)
    for tick, goals in enumerate(plan, 1):
        clock.write(goals)
        clock.sleep_until(tick * PERIOD)
        while part := board.read(4096, 0.0):
            came += part
    return came


def periods_of(robot: TwinRobot) -> int:
    return round(robot.t / PERIOD)


class Client:
    """Both pseudo-terminals of a twin in lock-step."""

    def __init__(self, *faults: str) -> None:
        self.robot = watched(TwinConfig(), boot_id=5)[0]
        self._over = threading.Event()
        self._server = TwinServer(self.robot, Faults([read(text) for text in faults], IDS))
        self._thread = threading.Thread(
            target=self._server.run_lockstep, args=(lambda t: not self._over.is_set(),)
        )

    def __enter__(self) -> Client:
        self._ends = [os.open(path, os.O_RDWR) for path in self._server.paths.values()]
        for end in self._ends:
            tty.setraw(end)
            os.set_blocking(end, False)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
        for end in self._ends:
            os.close(end)
        self._server.__exit__(None, None, None)

    def say(self, data: bytes) -> None:
        os.write(self._ends[1], data)

    def passed(self, ticks: int) -> bool:
        """Whether so many control periods have passed, within 2 s."""
        last = time.monotonic() + 2.0
        while periods_of(self.robot) < ticks and time.monotonic() < last:
            time.sleep(0.0005)
        return periods_of(self.robot) == ticks

    def hear(self, end: int, size: int) -> bytes:
        """What comes until it is `size` bytes, within 20 s."""
        came, last = b"", time.monotonic() + 20.0
        while len(came) < size and time.monotonic() < last:
            try:
                came += os.read(self._ends[end], 4096)
            except BlockingIOError:
                time.sleep(0.001)
        return came


@pytest.mark.ci
def test_a_slow_client_gets_what_invented_time_gives() -> None:
    expected, chance = in_invented_time(), random.Random(3)
    with Client() as client:
        plan = [goals_of(client.robot, step) for step in range(TICKS)]
        standing = [servo.position for servo in client.robot.servos]
        client.say(TORQUE)
        for goals in plan:
            cut = chance.randrange(len(goals))
            client.say(goals[:cut])
            time.sleep(chance.uniform(0.0, 0.02))
            client.say(goals[cut:])
        came = client.hear(0, len(expected))
        time.sleep(0.05)
        came += client.hear(0, 0)
        assert client.robot.t == TICKS * PERIOD
        moved = abs(np.array([s.position for s in client.robot.servos]) - standing)
        assert moved[5:17].min() > 50
    assert came == expected
    samples = [said for said in FrameDecoder().feed(came) if isinstance(said, Sample)]
    assert [sample.seq for sample in samples] == list(range(TICKS + 1))


def test_only_goals_of_all_servos_let_time_pass_and_the_bus_answers_at_once() -> None:
    with Client("servo:3=overload@0.02s") as client:
        ping, goals = packets.ping(1), goals_of(client.robot, 0)
        client.say(sync_write(116, 4, [2048] * 18) + sync_write(104, 4, [0] * 19) + ping)
        status = list(Parser().feed(client.hear(1, 14)))
        assert [packet.id for packet in status] == [1]
        assert client.robot.t == 0.0
        client.say(goals + goals + ping)  # both come at once
        client.hear(1, 14)
        assert client.robot.t == 2 * PERIOD
        assert client.robot.servos[2].get("hardware_error_status") == 32


def test_goals_split_anywhere_after_others_let_time_pass_for_each() -> None:
    with Client() as client:
        client.say(TORQUE)
        goals = goals_of(client.robot, 0)
        for cut in range(len(goals) + 1):
            client.say(goals + goals + goals[:cut])
            assert client.passed(3 * cut + 2 + (cut == len(goals))), f"cut at {cut}"
            client.say(goals[cut:])
            assert client.passed(3 * cut + 3), f"cut at {cut}"
