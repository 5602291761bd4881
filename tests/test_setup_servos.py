"""`setup` in invented time: a box of new servos, one on the bus at a time."""

from __future__ import annotations

import pytest
from setup_rig import ROBOT, Box, Script, new_servo

from antennate.errors import BadInputError
from antennate.hardware.doctor.fix import Change
from antennate.hardware.dynamixel import bringup
from antennate.hardware.setup.person import Quit, SetupError
from antennate.hardware.setup.servos import Assembly, ServoSetup, joints_of
from dynamixel_bus.bus import Bus

YAW1, YAW2 = joints_of(ROBOT)[:2]
LEG = joints_of(ROBOT)[5]
BASE = joints_of(ROBOT)[17]
XC430 = 1080
BAUDS = [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000]
"""By their value in `baud_rate`, as far as the SDK takes them."""


def setup(box: Box) -> ServoSetup:
    return ServoSetup(box.opener, box.robot, 0.1, box.wire.now)


def test_a_box_of_19_new_servos_becomes_a_robot_that_drive_accepts() -> None:
    box = Box()
    kept: list[tuple[str, ...]] = []
    assembly = Assembly(setup(box), (), kept.append, id)
    states = assembly.look()
    assert {state.state for state in states} == {"to do"}
    person = Script(
        [(rf"servo of {name} ", lambda name=name: box.plug(name), "") for name in box.servos]
    )
    assembly.run(person, states)
    assert kept[-1] == ROBOT.joint_names
    ids = [(servo, 1_000_000) for servo in range(1, 20)]
    assert list(box.found().values()) == ids
    box.plug_all()
    assert {state.note for state in assembly.look()} == {"answers"}
    with box.opener(1_000_000) as port:
        bus = Bus(port, clock=box.wire.now)
        bringup.require(bus, ROBOT.models)
    modes = [servo.get("operating_mode") for servo in box.servos.values()]
    assert modes == [3] * 5 + [4] * 12 + [3] * 2
    assert {servo.get("return_delay_time") for servo in box.servos.values()} == {0}
    assert not any(servo.torque for servo in box.servos.values())


def test_what_is_written_of_a_new_leg_servo() -> None:
    """The manual's defaults: position mode, 500 us; all else is as it has to be."""
    box = Box()
    box.plug(LEG.name)
    changes = setup(box).set_up(LEG, ())
    assert changes == [
        Change(1, 57_600, "operating_mode", 3, 4),
        Change(1, 57_600, "return_delay_time", 250, 0),
        Change(1, 57_600, "id", 1, 6),
        Change(6, 57_600, "baud_rate", 1, 3),
    ]
    assert box.servos[LEG.name].eeprom_writes == 4
    assert setup(box).set_up(LEG, ()) == []  # set up before, nothing is written
    assert box.servos[LEG.name].eeprom_writes == 4


@pytest.mark.parametrize("baud", BAUDS)
@pytest.mark.parametrize("servo", [0, 1, 7, 252])
def test_a_used_servo_of_any_id_and_speed_is_found(baud: int, servo: int) -> None:
    box = Box()
    used = box.servos[YAW2.name]
    used.set("id", servo)
    used.set(
        "baud_rate",
        [9_600, 57_600, 115_200, 1_000_000, 2_000_000, 3_000_000, 4_000_000].index(baud),
    )
    used.set("drive_mode", 9)
    used.set("homing_offset", -700)
    used.set("torque_enable", 1)
    box.plug(YAW2.name)
    setup(box).set_up(YAW2, ())
    assert box.found()[YAW2.name] == (2, 1_000_000)
    assert (used.get("drive_mode"), used.get("homing_offset"), used.torque) == (0, 0, False)


def test_nothing_on_the_bus_is_told_with_the_cure() -> None:
    box = Box()
    with pytest.raises(SetupError, match="found none at any speed; check its cable and its supply"):
        setup(box).set_up(YAW1, ())
    assert sorted(set(box.opened)) == BAUDS


def test_two_new_servos_on_the_bus_are_refused_and_nothing_is_written() -> None:
    box = Box()
    box.plug("yaw1", "yaw2")
    with pytest.raises(SetupError, match="found two servos answer with this id"):
        setup(box).set_up(YAW1, ())
    box.plug("yaw1", BASE.name)  # two models: their answers to a ping differ
    with pytest.raises(SetupError, match="two servos with this id"):
        setup(box).set_up(YAW1, ())
    assert [servo.eeprom_writes for servo in box.servos.values()] == [0] * 19


def test_a_new_servo_beside_one_that_is_done_is_refused() -> None:
    box = Box()
    box.plug("yaw1")
    setup(box).set_up(YAW1, ())
    box.plug("yaw1", "yaw2")
    with pytest.raises(
        SetupError, match="found 2: id 1 at 57600, id 1 at 1000000; unplug the others"
    ):
        setup(box).set_up(YAW2, ["yaw1"])
    assert box.servos["yaw2"].eeprom_writes == 0


def test_a_servo_of_the_wrong_model_is_refused() -> None:
    box = Box()
    box.plug("yaw1")
    with pytest.raises(
        SetupError,
        match=r"of antenna_l_base \(id 18, XL330-M288-T\), found an XC430-W240-T \(id 1\)",
    ):
        setup(box).set_up(BASE, ())
    assert box.servos["yaw1"].eeprom_writes == 0


def test_the_servo_of_a_joint_that_is_done_is_refused_for_the_next_one() -> None:
    box = Box()
    box.plug("yaw1")
    setup(box).set_up(YAW1, ())
    before = box.servos["yaw1"].eeprom_writes
    with pytest.raises(SetupError, match=r"found that of yaw1 .*, which is done"):
        setup(box).set_up(YAW2, ["yaw1"])
    assert box.servos["yaw1"].eeprom_writes == before


def test_a_robot_at_the_factory_speed_takes_a_new_servo_for_no_joint_of_its() -> None:
    """Id 1 at 57600 is both a new servo and that of yaw1; its return delay tells."""
    robot = ROBOT.model_copy(update={"baud": 57_600})
    box = Box(robot)
    for joint in joints_of(robot)[:3]:
        box.plug(joint.name)
        setup(box).set_up(joint, ["yaw1", "yaw2"][: joint.servo - 1])
    assert list(box.found().values())[:4] == [(1, 57_600), (2, 57_600), (3, 57_600), (1, 57_600)]


def test_it_goes_on_where_it_was_left_and_redoes_what_is_asked() -> None:
    box = Box()
    kept: list[tuple[str, ...]] = []
    assembly = Assembly(setup(box), (), kept.append, id)
    person = Script(
        [
            ("yaw1", lambda: box.plug("yaw1"), ""),
            ("yaw2", None, "s"),
            ("yaw3", lambda: box.plug("yaw3"), ""),
            ("yaw4", None, "q"),
        ]
    )
    with pytest.raises(Quit):
        assembly.run(person, assembly.look())
    assert kept[-1] == ("yaw1", "yaw3")
    box.plug()
    later = Assembly(setup(box), kept[-1], kept.append, id)
    states = later.look()
    assert [s.joint.name for s in states if s.state == "set up"] == ["yaw1", "yaw3"]
    box.servos["yaw3"] = new_servo(XC430)  # the old one burnt
    person = Script([("1 of 1.*yaw3", lambda: box.plug("yaw3"), "")])
    later.run(person, states, ["yaw3"])
    assert box.found()["yaw3"] == (3, 1_000_000)


def test_servos_that_are_on_the_bus_already_are_seen_by_pinging() -> None:
    box = Box()
    for joint in (YAW1, YAW2):
        box.plug(joint.name)
        setup(box).set_up(joint, ())
    box.servos["yaw2"].set("return_delay_time", 250)
    box.plug("yaw1", "yaw2")
    states = Assembly(setup(box), (), lambda _: None, id).look()
    assert states[0].state == "set up"
    assert (states[1].state, states[1].note) == ("wrong", "return delay time 250 (expected 0)")


def test_a_refusal_is_told_and_the_same_joint_asked_for_again() -> None:
    box = Box()
    assembly = Assembly(setup(box), (), lambda _: None, id)
    person = Script(
        [
            ("yaw1", None, ""),
            ("yaw1", lambda: box.plug("yaw1"), ""),
            ("yaw2", None, "what"),
            ("expected Enter", None, None),
        ]
    )
    with pytest.raises(BadInputError, match=r"nobody answers .*yaw2"):
        assembly.run(person, assembly.look())
    assert any("found none at any speed" in text for text in person.said)
    assert "expected Enter, s or q, found 'what'" in person.said
    assert assembly.done == ["yaw1"]


def test_a_spare_that_was_set_up_as_another_joint_becomes_this_one_if_the_person_agrees() -> None:
    box = Box()
    box.plug("yaw2")
    setup(box).set_up(YAW2, ())
    kept: list[tuple[str, ...]] = []
    assembly = Assembly(setup(box), ("yaw1", "yaw2"), kept.append, id)
    person = Script(
        [
            ("connect the servo of yaw1", None, ""),
            ("found that of yaw2", None, None),
            ("is it a spare", None, ""),
            ("expected y, n or q, found Enter", None, None),
            ("is it a spare", None, "n"),
            ("nothing was changed; connect the servo of yaw1", None, None),
            ("connect the servo of yaw1", None, ""),
            ("found that of yaw2", None, None),
            ("is it a spare", None, "y"),
            ("yaw2 is not set up", None, None),
        ]
    )
    assembly.run(person, assembly.look(), ["yaw1"])
    assert person.script == []
    assert box.found()["yaw2"] == (1, 1_000_000)
    assert kept[-1] == ("yaw1",)
