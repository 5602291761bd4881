"""B25: an adapter that gives back what is sent; the echo is dropped, and nothing else is."""

from __future__ import annotations

import pytest
from doctor_rig import Patient, wrong
from hypothesis import given
from hypothesis import strategies as st

from antennate.robots.spec import RobotSpec
from antennate.twin.servos import servos_of
from dynamixel_bus import packets
from dynamixel_bus.answers import MOTION, SILENT, Echo, Value
from dynamixel_bus.bus import Bus
from dynamixel_bus.packets import Status
from dynamixel_bus.servo_bus import ServoBus
from dynamixel_bus.simulated_wire import SimulatedWire

IDS = RobotSpec().ids
GOAL = 116


def master(echo: bool, fast: bool = True) -> tuple[Bus, SimulatedWire]:
    twin = ServoBus(servos_of(RobotSpec()))
    twin.echo = echo
    wire = SimulatedWire(twin)
    return Bus(wire, fast=fast, clock=wire.now), wire


@pytest.mark.parametrize("fast", [True, False])
def test_B25_a_walk_through_an_echo_takes_no_longer_and_loses_nothing(fast: bool) -> None:
    """Goals to all and a read of all, a hundred times: the echo is over before they answer."""
    times: list[float] = []
    for echo in (False, True):
        bus, wire = master(echo, fast)
        for tick in range(100):
            bus.write_all(GOAL, {i: (tick + i).to_bytes(4, "little") for i in IDS})
            answers = bus.read_all(IDS, MOTION)
            assert SILENT not in answers.values()
            wire.sleep(0.002)
        assert isinstance(bus.ping(7), Value)
        assert bus.fast is fast
        tally = bus.tally
        assert (tally.misses, tally.stale, tally.bad_crc, tally.drained) == (0, 0, 0, 0)
        assert (tally.echoes > 190) is echo
        times.append(wire.now())
    assert times[1] <= times[0] + 0.01


STATUS = st.builds(Status, st.integers(1, 252), st.just(0), st.booleans(), st.binary(max_size=20))
REQUEST = st.one_of(
    st.builds(packets.ping, st.integers(1, 252)),
    st.builds(packets.read, st.integers(1, 252), st.integers(0, 200), st.integers(1, 20)),
    st.builds(packets.write, st.integers(1, 252), st.integers(0, 200), st.binary(max_size=20)),
)


@given(st.lists(REQUEST, max_size=6), st.lists(STATUS, max_size=6), st.data())
def test_B25_no_answer_is_ever_taken_for_an_echo(
    requests: list[bytes], statuses: list[Status], data: st.DataObject
) -> None:
    """With or without echoes before them, in pieces of any size, all bytes of answers come out."""
    echoed = data.draw(st.booleans())
    answers = b"".join(map(packets.status, statuses))
    stream = (b"".join(requests) if echoed else b"") + answers
    echo = Echo()
    for request in requests:
        echo.expect(request)
    came = b""
    while stream:
        size = data.draw(st.integers(1, 40))
        came += echo.remove(stream[:size])
        stream = stream[size:]
    assert came == answers
    assert echo.requests == (len(requests) if echoed else 0)


def test_B25_the_doctor_names_an_echo_and_finds_all_servos() -> None:
    checkup = Patient("bus=echo").examine(esp32=False)
    assert set(wrong(checkup)) == {"bus: echo of the adapter"}
    assert checkup.grade == "warn"
    assert checkup.bus is not None
    assert sorted(checkup.bus.here) == sorted(IDS)
