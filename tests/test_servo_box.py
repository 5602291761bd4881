"""`antennate twin --servos`, `--orders` and `--push`: servos alone, plugged in and turned."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from recorded import leaves
from servo_process import Served, served

from antennate.cli.twin import command
from antennate.errors import BadInputError, ConfigError
from antennate.robots.spec import RobotSpec
from antennate.twin.config import TwinConfig, watched
from antennate.twin.orders import Orders
from antennate.twin.robot import TwinRobot
from antennate.twin.servos import ServoBox, read_list
from dynamixel_bus import packets
from dynamixel_bus.parser import Parser


def models(text: str) -> list[tuple[int, int, int]]:
    """Id, model number and baud code of each."""
    servos = ServoBox(read_list(text.split())).servos
    return [(s.get("id"), s.get("model_number"), s.get("baud_rate")) for s in servos]


def test_a_list_of_servos_is_read_from_words_and_from_a_file(tmp_path: Path) -> None:
    words = "1:xl330-m288 2:xl430-w250@1000000 7:xc430-w240x2"
    expected = [(1, 1200, 1), (2, 1060, 3), (7, 1080, 1), (7, 1080, 1)]
    assert models(words) == expected
    file = tmp_path / "box.toml"
    file.write_text(
        '[[servo]]\nmodel = "xl330-m288"\n'
        '[[servo]]\nmodel = "xl430-w250"\nid = 2\nbaud = 1000000\nposition = 100.0\nname = "hip"\n'
    )
    assert models(str(file)) == expected[:2]
    box = ServoBox(read_list([str(file)]), plugged=("hip",))
    assert [servo.plugged for servo in box.servos] == [False, True]
    assert box.servos[1].get("present_position") == 100


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("1", "expected ID:MODEL"),
        ("1:mx28", "expected as model one of xc330-m181, .*, found mx28"),
        ("1:xl330-m288@4500000", "speed of xl330-m288 one of 9600, .*4000000, found 4500000"),
        ("1:xl330-m288@19200", "found 19200"),
        ("253:xl330-m288", "at most 252, found 253"),
        ("nowhere.toml", "nowhere.toml"),
        ("box.toml 1:xl330-m288", "or a file alone that ends in .toml, found 'box.toml'"),
    ],
)
def test_what_is_no_servo_is_refused(text: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        ServoBox(read_list(text.split()))


def stand_alone() -> ServoBox:
    return ServoBox(read_list(["1:xc430-w240", "2:xl330-m288", "3:xl430-w250"]))


def of_the_robot() -> TwinRobot:
    return watched(TwinConfig(factory=True))[0]


def heard(box: ServoBox, t: float) -> list[int]:
    """Ids that answer a broadcast ping at time t [s], at the speed of the factory."""
    box.bus.master_baud = 57_600
    box.bus.transmit(t)
    box.bus.receive(t, packets.ping())
    box.advance(t + 1.0)
    return [packet.id for packet in Parser().feed(box.bus.transmit(t + 1.0))]


def test_a_box_of_new_servos_gets_its_ids_one_after_the_other() -> None:
    box = ServoBox(read_list(["1:xc430-w240x3"]), plugged=("1",))
    for n in range(3):
        t = 10.0 * n + 1.0
        box.advance(t)
        assert heard(box, t) == [1]
        box.bus.receive(t + 2.0, packets.write(1, 7, bytes([11 + n])))
        box.advance(t + 3.0)
        box.on_order("next")
        assert heard(box, t + 3.1) == []  # it is still starting
    box.on_order("plug all")
    box.advance(40.0)
    assert heard(box, 41.0) == [11, 12, 13]
    box.on_order("unplug 2")
    box.advance(45.0)
    assert heard(box, 46.0) == [11, 13]


def test_a_servo_that_was_unplugged_has_forgotten_its_ram() -> None:
    box = ServoBox(read_list(["1:xc430-w240"]))
    servo = box.servos[0]
    servo.set("led", 1)
    servo.set("torque_enable", 1)
    box.on_order("unplug 1")
    box.on_order("plug 1")
    box.advance(1.0)
    assert (servo.get("led"), servo.get("torque_enable")) == (0, 0)


@pytest.mark.parametrize("text", ["", "go", "plug", "plug 4", "push 1", "push 1=20", "push 1=xdeg"])
def test_an_order_that_is_none_is_refused(text: str) -> None:
    box = ServoBox(read_list(["1:xc430-w240x3"]))
    with pytest.raises(BadInputError, match="expected"):
        box.on_order(text)


def test_a_shaft_without_torque_is_turned_and_one_with_torque_is_not() -> None:
    box = ServoBox(read_list(["1:xc430-w240x2"]), pushes=("1=45deg@2s", "2=-0.5rad@2s"))
    box.servos[1].set("torque_enable", 1)
    box.bus.receive(1.0, packets.ping())
    for n in range(500):
        box.advance(1.0 + 0.01 * n)
        if n == 190:
            assert box.servos[0].get("present_position") == 2048
        if n == 225:
            assert 2048 < box.servos[0].get("present_position") < 2048 + 512
    assert box.servos[0].get("present_position") == 2048 + 512
    assert box.servos[1].get("present_position") == 2048


@pytest.mark.parametrize("make", [stand_alone, of_the_robot])
def test_a_homing_offset_moves_the_present_position_of_a_standing_servo_at_once(
    make: Callable[[], TwinRobot | ServoBox],
) -> None:
    """Present Position = Actual Position + Homing Offset; in position mode up to 1024."""
    twin = make()
    actual = {servo: servo.get("present_position") for servo in twin.bus.servos}
    for register, value, shift in (
        ("homing_offset", 500, 500),
        ("homing_offset", -1024, -1024),
        ("homing_offset", 1025, 0),
        ("operating_mode", 4, 1025),
        ("homing_offset", -1_044_479, -1_044_479),
        ("homing_offset", 0, 0),
    ):
        twin.advance(twin.t + 0.1)
        for servo in twin.bus.servos:
            row = servo.model[register]
            assert servo.write(row.address, row.encode(value)) == 0
            present = int.from_bytes(servo.read(132, 4)[1], "little", signed=True)
            assert present == actual[servo] + shift


def test_orders_come_from_a_file_line_by_line(tmp_path: Path) -> None:
    said: list[str] = []
    done: list[str] = []
    file = tmp_path / "orders"
    file.write_text("next\n\nplug 9\npush 1=2deg\nhalf")

    def order(text: str) -> None:
        done.append(text)
        if "9" in text:
            raise BadInputError("there is none")

    orders = Orders(str(file), said.append)
    while orders.files:
        orders.take(order)
    assert done == ["next", "plug 9", "push 1=2deg"]
    assert said == ["next", "not done: there is none", "push 1=2deg"]
    with pytest.raises(FileNotFoundError):
        Orders(str(tmp_path / "nothing"), said.append)


# a robot


@pytest.fixture
def limp() -> TwinRobot:
    return watched(TwinConfig(push=("yaw1=20deg@1s", "leg_r2=-90deg@1s")))[0]


def test_a_joint_of_the_standing_robot_is_turned_to_an_angle(limp: TwinRobot) -> None:
    """20 degrees are 227.6 ticks from the zero of its description, a quarter turn is 1024."""
    leg = RobotSpec().joint_names.index("leg_r2")
    limp.bus.receive(0.5, packets.ping())
    before = [servo.get("present_position") for servo in limp.servos]
    limp.advance(3.0)
    after = [servo.get("present_position") for servo in limp.servos]
    assert after[0] == 2048 + 228
    assert after[leg] == 2048 - 1024
    changed = [n for n, (a, b) in enumerate(zip(before, after, strict=True)) if a != b]
    assert changed == [0, leg]
    assert limp.stood == 300
    for servo in limp.servos:
        servo.set("goal_position", servo.get("present_position"))
    limp.servos[0].set("torque_enable", 1)  # the physics begins where the joints are
    limp.advance(3.5)
    assert limp.servos[0].get("present_position") == pytest.approx(
        2276, abs=40
    )  # joints are off their zeros


def test_a_joint_that_lost_its_torque_is_turned_in_the_physics(limp: TwinRobot) -> None:
    for servo in limp.servos:
        servo.set("torque_enable", 1)
    limp.advance(0.5)
    limp.servos[18].set("torque_enable", 0)
    limp.plugging.order("push antenna_r_base=30deg", 0.5)
    limp.advance(2.5)
    moved = limp.servos[18].get("present_position") - 2048
    assert abs(moved) == pytest.approx(4096 / 12, abs=10)


def test_straightening_a_robot_puts_all_its_joints_to_their_zeros() -> None:
    zeros = (2000, 2100, 1900, 2048, 2222)
    robot = watched(
        TwinConfig(robot=RobotSpec.model_validate({"yaw": {"zeros": zeros}}), factory=True)
    )[0]
    robot.plugging.order("push all=0deg", 0.0)
    robot.advance(1.0)
    assert tuple(servo.get("present_position") for servo in robot.servos[:5]) == zeros
    assert {servo.get("id") for servo in robot.servos} == {1}
    assert {servo.get("baud_rate") for servo in robot.servos} == {1}
    assert {servo.get("operating_mode") for servo in robot.servos} == {3}


def test_the_servos_tell_what_the_physics_does() -> None:
    """A yaw that is sent round tells speed, drive and load, and none of them at rest."""
    robot = watched(TwinConfig())[0]
    servo = robot.servos[0]
    robot.hands.hanging = True  # on the floor its feet stick
    robot.advance(0.1)
    for each in robot.servos:
        each.set("torque_enable", 1)
    robot.advance(1.5)
    assert servo.get("moving") == 0
    assert abs(servo.get("present_velocity")) <= 2
    start = servo.get("present_position")
    servo.set("profile_velocity", 40)  # 0.96 rad/s
    servo.set("goal_position", start + 250)
    speeds = []
    for n in range(16):
        robot.advance(1.65 + 0.01 * n)
        speeds.append(servo.get("present_velocity"))
    assert servo.get("moving") == 1
    assert servo.get("moving_status") & 0x32 == 0x12
    assert servo.get("velocity_trajectory") == 40
    assert sum(speeds) / len(speeds) == pytest.approx(40, abs=3)
    assert 0 < servo.get("present_pwm") < 885
    way = 40 * 0.229 / 60 * 4096 * 0.3
    assert servo.get("present_position") - start == pytest.approx(way, abs=50)  # it lags
    robot.advance(4.0)
    assert servo.get("moving") == 0
    assert servo.get("present_position") == pytest.approx(start + 250, abs=3)


def test_a_leg_turns_at_a_speed_in_velocity_mode_and_by_a_drive_in_pwm_mode() -> None:
    """XC430 at 11.1 V: 65 rev/min with the whole drive; a third of it gives about a third."""
    robot = watched(TwinConfig())[0]
    leg = robot.servos[5]
    for mode, register, value, expected in (
        (1, "goal_velocity", 60, 60),
        (16, "goal_pwm", 295, 94),
    ):
        leg.set("torque_enable", 0)
        leg.write(11, bytes([mode]))
        for each in robot.servos:
            each.set("torque_enable", 1)
        leg.set(register, value)
        robot.advance(robot.t + 1.5)
        begin, before = robot.t, leg.position
        robot.advance(robot.t + 1.0)
        turned = (leg.position - before) / (robot.t - begin) / 4096 * 60 / 0.229
        assert turned == pytest.approx(expected, rel=0.15), mode


# the command


OF_A_ROBOT = (
    "--mains=60",
    *("--scene=flat", "--seed=3", "--trial=2", "--robot.mass=3", "--robot=hexapod"),
    *(
        "--tunnel.strewn=1",
        "--physics.timestep=0.001",
        "--variation.slip-time=2",
    ),
    *("--control.rate=50", "--control.gait.amplitude=0.1", "--battery.voltage=10"),
    *("--factory", "--touch=left@2s", "--pace=lockstep", "--udp=0", "--passed=gone"),
    *("--log=a.mcap", "--video=a.mp4", "--view", "--foxglove"),
)


@pytest.mark.parametrize("flag", OF_A_ROBOT)
def test_what_is_for_a_robot_is_refused_without_one(flag: str) -> None:
    name = flag.partition("=")[0]
    with pytest.raises(ConfigError, match=f"^{name}.*: expected none .* it is for a robot"):
        command(["--servos", "1:xl330-m288", "--duration=0.1", flag])


@pytest.mark.parametrize("page", ["--view", "--foxglove"])
def test_the_port_of_a_page_alone_is_refused_with_servos_too(page: str) -> None:
    with pytest.raises(ConfigError, match=f"^{page}-port: expected {page} beside it"):
        command(["--servos", "1:xl330-m288", "--duration=0.1", f"{page}-port=0"])


def test_only_what_servos_alone_read_is_taken_beside_them() -> None:
    """Everything that could be changed is refused, but for what the other tests here use."""
    parameters = {path.partition(".")[0] for path in leaves(TwinConfig)}
    refused = {flag.strip("-").partition("=")[0].partition(".")[0] for flag in OF_A_ROBOT}
    by_its_scene = {"corridors", "ground"}
    assert parameters - refused == {"duration", "fault", "push", "plugged"} | by_its_scene


def test_a_file_for_a_robot_is_refused_without_one(tmp_path: Path) -> None:
    file = tmp_path / "twin.toml"
    file.write_text("[robot]\nmass = 3.0\n")
    with pytest.raises(ConfigError, match=r"^--robot\.mass: expected none .* found 3\.0"):
        command(["--servos", "1:xl330-m288", "--duration=0.1", "--config", str(file)])


@pytest.mark.parametrize(
    "fault", ["esp32=reset", "wire=loss:0.1", "bus=discharge:1", "servo:2=shock"]
)
def test_a_fault_of_what_is_not_there_is_refused(fault: str) -> None:
    with pytest.raises(BadInputError, match="--fault: expected"):
        command(["--servos", "1:xl330-m288", "--fault", fault])


@pytest.fixture
def twin() -> Iterator[Served]:
    pytest.importorskip("serial")
    with served("1:xc430-w240", "2:xl430-w250", "--plugged", "1") as serving:
        yield serving


@pytest.mark.ci
def test_the_first_ping_after_the_ready_line_is_answered(twin: Served) -> None:
    serial = pytest.importorskip("serial")
    with serial.Serial(twin.path, 57_600, timeout=0.5) as line:
        line.write(packets.ping(1))
        assert len(line.read(14)) == 14
        assert twin.order("unplug all") == "unplug all"
        line.write(packets.ping(1))
        assert line.read(14) == b""
        assert twin.order("plug 3").startswith("not done: plug: expected all or one of 1, 2")


@pytest.mark.ci
def test_only_a_client_at_the_speed_of_a_servo_is_heard() -> None:
    """Linux has no name for 4.5 and 10.5 Mbit/s, but programs set them."""
    serial = pytest.importorskip("serial")
    with served("1:xc430-w240@4500000") as twin:
        for speed in (19_200, 57_600, 500_000, 4_000_000, 10_500_000, 4_500_000):
            with serial.Serial(twin.path, speed, timeout=0.2) as line:
                line.write(packets.ping(1))
                assert len(line.read(14)) == (14 if speed == 4_500_000 else 0), speed


def test_what_is_pushed_has_an_angle_with_its_unit() -> None:
    assert math.radians(45) == pytest.approx(512 * 2 * math.pi / 4096)
    with pytest.raises(BadInputError, match="--push: expected JOINT=ANGLE"):
        watched(TwinConfig(push=("yaw1=20",)))
    with pytest.raises(BadInputError, match="--push: expected all or one of yaw1"):
        watched(TwinConfig(push=("knee=20deg",)))
    with pytest.raises(BadInputError, match="--plugged: expected all or one of yaw1"):
        watched(TwinConfig(plugged=("knee",)))
