"""Motion capture beside a log: clocks, tables and what is wrong with them, against formulas."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import antennate
from antennate.cli import main
from antennate.errors import BadInputError
from antennate.params.control import ControlParams
from antennate.robots.spec import RobotSpec
from antennate.telemetry.header import Header
from antennate.telemetry.mocap import Poses, poses_of
from antennate.telemetry.mocap.clock import align
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import COORDINATES
from antennate.telemetry.writer import LogWriter
from antennate.types import Floats

RADIUS, SPEED = 0.5, 0.06
"""A circle [m], and the speed along it [m/s]."""
FREQUENCY = 0.6
"""Of the swing of the head [Hz]."""
LENGTH, RATE = 40.0, 100.0
NOISE, ARM = 0.0005, 0.03
"""Noise of a marker, and its distance from the middle of the head [m]."""
FEATURED = RobotSpec.model_validate({"imu": {"kind": "head"}})


def swing(t: Floats) -> Floats:
    """Heading beside the tangent: the head stands, swings, pauses and swings again [rad]."""
    walks = ((t > 2.5) & (t < 17.5)) | (t > 12.5 / FREQUENCY)
    return np.where(walks, 0.25 * np.sin(2 * math.pi * FREQUENCY * t), 0.0)


def circle(t: Floats) -> tuple[Floats, Floats, Floats]:
    """Place x, y [m] and heading [rad] on the circle."""
    angle = SPEED / RADIUS * t
    return RADIUS * np.sin(angle), RADIUS * (1 - np.cos(angle)), angle + swing(t)


def markers(t: Floats, seed: int = 0) -> tuple[Floats, Floats]:
    """Places of a marker at the rear of the head and one in front [m], shape (n, 3)."""
    x, y, heading = circle(t)
    chance = np.random.default_rng(seed)
    middle = np.stack([x, y, np.full(len(t), 0.05)], axis=1)
    ahead = ARM * np.stack([np.cos(heading), np.sin(heading), np.zeros(len(t))], axis=1)
    rear, front = (
        m + NOISE * chance.standard_normal(m.shape) for m in (middle - ahead, middle + ahead)
    )
    return rear, front


def their_time(t: Floats, begin: float, drift: float) -> Floats:
    """What a clock shows that has `begin` at the log's 0 and goes 1 / (1 + drift) as fast."""
    return begin + t / (1 + drift)


SPAN = np.arange(1.0, LENGTH - 1.0, 1 / RATE)
"""Times of the log at which the table has a row [s]."""


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a head on the circle, whose gyroscope shows what the formula says."""
    path = tmp_path_factory.mktemp("circle") / "circle.mcap"
    still = (0.0,) * len(FEATURED.joint_names)
    common: dict[str, Any] = {"counts": (0.0, 0.0), "reading": (0.0, 0.0), "level": (0.0, 0.0)}
    common |= {"contact": (0, 0), "maneuver": 0, "phase": 0.0, "angles": still}
    times = np.arange(0.0, LENGTH, 1 / RATE)
    turned = circle(times)[2]
    rates = np.diff(turned, prepend=turned[0]) * RATE
    header = Header(controller="open", params=ControlParams(), robot=FEATURED)
    with LogWriter(path, header) as out:
        for number, (t, rate) in enumerate(zip(times.tolist(), rates.tolist(), strict=True), 1):
            felt = {"angular_velocity": (0.0, 0.0, rate), "linear_acceleration": (0.0, 0.0, 9.8)}
            out.write(Tick(number=number, t=t, now=t, **common, **felt))
    return path


def wide(t: Floats, columns: Sequence[Floats], scale: float = 1.0, names: str = "") -> str:
    """Plain CSV with columns of both markers."""
    names = (
        names or "time,head_rear_x,head_rear_y,head_rear_z,head_front_x,head_front_y,head_front_z"
    )
    rows = np.column_stack([t, scale * np.hstack(columns)])
    lines = (",".join("" if math.isnan(v) else f"{v:.6f}" for v in row) for row in rows.tolist())
    return "\n".join([names, *lines, ""])


def read(log: Path, tmp_path: Path, text: str, name: str = "table.csv", **how: Any) -> Poses:
    table = tmp_path / name
    table.write_text(text)
    return poses_of(log, table, **how)


@pytest.mark.ci
@pytest.mark.parametrize("drift", [0.0, 50e-6, 0.01])
def test_offset_and_drift_are_within_their_intervals(drift: float) -> None:
    """The 95 % interval holds the truth in 57 of 60 draws, but for chance: 54 (2 sigma)."""
    times = np.arange(0.0, LENGTH, 1 / RATE)
    within = np.zeros(2)
    for seed in range(60):
        rear, front = markers(SPAN, seed)
        heading = np.unwrap(np.arctan2(*(front - rear)[:, 1::-1].T))
        table = their_time(SPAN, 1000.0, drift), heading
        clock = align(Path("table"), table, (times, circle(times)[2]), 0.9)
        true = (1 + drift) * (clock.centre - 1000.0)
        within += (
            abs(clock.at - true) < clock.at_error,
            abs(clock.drift - drift) < clock.drift_error,
        )
        assert clock.at_error < 0.002
    assert (within >= 54).all()


def test_a_drift_of_one_percent_is_found_and_named(log: Path, tmp_path: Path) -> None:
    text = wide(their_time(SPAN, 5.0, 0.01), markers(SPAN))
    poses = read(log, tmp_path, text)
    assert poses.clock.drift == pytest.approx(0.01, abs=poses.clock.drift_error)
    (warning,) = poses.warnings()
    assert warning.startswith("its clock drifts by")
    x, y, heading = circle(SPAN)
    got = poses.at(SPAN)
    assert np.nanmax(abs(got[:, 0] - x)) < 4 * NOISE
    assert np.nanmax(abs(got[:, 1] - y)) < 4 * NOISE
    assert np.nanmedian(abs(got[:, 2] - heading)) < NOISE / ARM


def motive(t: Floats, rear: Floats, front: Floats, version: str = "1.23") -> str:
    """OptiTrack Motive: y up, its x is our y and its z our x; millimetres."""
    names = "R:Rear,R:Rear,R:Rear,R:Front,R:Front,R:Front"
    above = [",Type" + ",Marker" * 6, f",Name,{names}", ",ID,1,1,1,2,2,2", ",Parent,,,,,,"]
    if version == "1.22":
        above = ["," + ",Marker" * 6, f",,{names}"]
    head = f"Format Version,{version},Take Name,a,Rotation Type,Quaternion,Length Units,Millimeters"
    kinds = ",,Position" + ",Position" * 5
    turned = [each[:, [1, 2, 0]] for each in (rear, front)]
    body = wide(t, turned, 1000.0, "Time (Seconds),X,Y,Z,X,Y,Z").splitlines()
    lines = [f"Frame,{body[0]}", *(f"{number},{row}" for number, row in enumerate(body[1:]))]
    return "\n".join([head, "", *above, kinds, *lines, ""])


def vicon(t: Floats, rear: Floats, front: Floats) -> str:
    """Vicon Nexus: frames of a stated rate; millimetres; another section stands before."""
    body = wide(np.arange(len(t)), [rear, front], 1000.0).splitlines()[1:]
    rows = (f"{number},0,{row.partition(',')[2]}" for number, row in enumerate(body, 1))
    head = f"Events\n100\n\nTrajectories\n{RATE:.0f}\n,,A:HeadRear,,,A:HeadFront,,"
    return "\n".join([head, "Frame,Sub Frame,X,Y,Z,X,Y,Z", ",,mm,mm,mm,mm,mm,mm", *rows, "", ""])


def trc(t: Floats, rear: Floats, front: Floats) -> str:
    """TRC with tabs, an empty line below the header, and empty cells cut off at the end."""
    body = wide(t, [rear, front], 1000.0).replace(",", "\t").splitlines()[1:]
    rows = (f"{number}\t{row}".rstrip("\t") for number, row in enumerate(body, 1))
    head = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tUnits\n100\t100\tmm"
    names = "Frame#\tTime\tHeadRear\t\t\tHeadFront\t\t\n\t\tX1\tY1\tZ1\tX2\tY2\tZ2"
    return "\n".join([head, names, "", *rows, ""])


def pose(t: Floats, rear: Floats, front: Floats) -> str:
    """A pose with units in the names of its columns."""
    heading = np.degrees(np.unwrap(np.arctan2(*(front - rear)[:, 1::-1].T)))
    x, y = (500.0 * (rear + front)).T[:2]
    return wide(1000.0 * t, [np.column_stack([x, y, heading])], 1.0, "t_ms,x [mm],y [mm],yaw_deg")


def quaternions(t: Floats, rear: Floats, front: Floats) -> str:
    """A body of Motive with y up: a turn about y, x is our y and z our x."""
    half = np.arctan2(*(front - rear)[:, 1::-1].T) / 2
    none = np.zeros(len(t))
    place = (rear + front)[:, [1, 2, 0]].T / 2
    columns = np.column_stack([none, np.sin(half), none, np.cos(half), *place])
    head = "Format Version,1.23,Rotation Type,Quaternion,Length Units,Meters\n"
    above = (
        ",Type" + ",Body" * 7,
        ",Name" + ",Body" * 7,
        "," + ",Rotation" * 4 + ",Position" * 3,
    )
    body = wide(t, [columns], 1.0, "Time (Seconds),X,Y,Z,W,X,Y,Z").splitlines()
    lines = [f"Frame,{body[0]}", *(f"{number},{row}" for number, row in enumerate(body[1:]))]
    return "\n".join([head, *above, *lines, ""])


RIGID = ("R:Rear", "R:Front")


def older(t: Floats, rear: Floats, front: Floats) -> str:
    """Motive before version 1.23."""
    return motive(t, rear, front, "1.22")


@pytest.mark.parametrize(
    ("make", "name", "how", "offset"),
    [
        (motive, "take.csv", {"markers": RIGID}, -3.0),
        (older, "old.csv", {"markers": RIGID, "up": "y"}, -3.0),
        (vicon, "nexus.csv", {}, 0.99),  # frame 1 is 1 s of the log
        (trc, "take.trc", {}, -3.0),
        (pose, "pose.csv", {}, -3.0),
        (quaternions, "body.csv", {}, -3.0),
    ],
)
def test_tables_of_each_form_are_read(
    log: Path,
    tmp_path: Path,
    make: Callable[..., str],
    name: str,
    how: dict[str, Any],
    offset: float,
) -> None:
    text = make(their_time(SPAN, 3.0, 0.0), *markers(SPAN))
    poses = read(log, tmp_path, text, name, **how)
    clock = poses.clock
    assert clock.at - clock.centre == pytest.approx(offset, abs=clock.at_error)
    x, y, heading = circle(poses.t)
    assert abs(poses.x - x).max() < 5 * NOISE
    assert abs(poses.y - y).max() < 5 * NOISE
    assert np.median(abs(np.sin(poses.heading - heading))) < NOISE / ARM


def test_gaps_stay_and_exchanged_markers_are_put_back(log: Path, tmp_path: Path) -> None:
    """Rows without a marker, absent rows, rows with both exchanged, and one marker elsewhere."""
    rear, front = markers(SPAN)
    rear[300:420] = np.nan
    rear[900:1100], front[900:1100] = front[900:1100].copy(), rear[900:1100].copy()
    front[2000] += 0.2
    kept = np.delete(np.arange(len(SPAN)), np.arange(1500, 1600))
    poses = read(log, tmp_path, wide(SPAN[kept], (rear[kept], front[kept])))
    assert (poses.head.exchanged, poses.head.strays) == (200, 1)
    assert [text.partition(" in ")[0] for text in poses.warnings()][:2] == [
        "markers were exchanged",
        "a marker was elsewhere",
    ]
    missing = [SPAN[350], SPAN[1550]]
    assert np.isnan(poses.at(np.array(missing))).all()
    told = np.array([SPAN[1000], SPAN[2500]])
    assert np.sin(poses.at(told)[:, 2] - circle(told)[2]) == pytest.approx(0.0, abs=0.1)


def exchanged(text: str) -> str:
    """A pose whose columns x and y are exchanged."""
    return text.replace("x [mm],y [mm]", "y [mm],x [mm]")


def shown(make: Callable[..., str], change: Callable[[Floats], Floats] = lambda v: v) -> str:
    rear, front = markers(SPAN)
    return make(SPAN, change(rear), change(front))


def plain(t: Floats, rear: Floats, front: Floats) -> str:
    return wide(t, (rear, front))


def other(t: Floats, rear: Floats, front: Floats) -> str:
    """A head that swings at another frequency."""
    return wide(t, [np.column_stack([*circle(t)[:2], 0.25 * np.sin(5.1 * t)])], 1.0, "t,x,y,yaw")


def steady(t: Floats, rear: Floats, front: Floats) -> str:
    """A part of the walk in which nothing but the gait turns the head."""
    part = (t > 6.0) & (t < 14.0)
    return wide(t[part], (rear[part], front[part]))


@pytest.mark.parametrize(
    ("text", "how", "said"),
    [
        (shown(plain, lambda v: 1000 * v), {}, "metres, found a robot of 0.72 m that walks 60 m/s"),
        (shown(plain, lambda v: v / 1000), {}, "expected metres"),
        (shown(plain, lambda v: v * [1, -1, 1]), {}, "left-handed"),
        (shown(plain, lambda v: v[:, [1, 0, 2]]), {}, "left-handed"),
        (shown(plain, lambda v: v[:, [1, 2, 0]]), {"up": "z"}, "hardly moves along --up z"),
        (exchanged(shown(pose)), {}, "are its columns x and y exchanged"),
        (shown(pose).replace("yaw_deg", "yaw"), {}, "call its column heading_deg"),
        (shown(pose).replace("yaw_deg", "roll"), {}, "two markers of the head"),
        (shown(other), {}, "one lag at which it turns"),
        (shown(steady), {}, "one lag at which it turns"),
        (shown(plain), {"markers": ("head_rear", "head_frnt")}, "did you mean head_front"),
        (shown(plain).replace("head_", "leg_"), {}, "found none of leg_rear, leg_front"),
        (shown(plain).replace("time", "row"), {}, "a column time"),
        (shown(plain).replace("2.000000,", "9.000000,"), {}, "rising times"),
        (shown(plain).replace("\n2.000000,", "\n2.000000,x"), {}, "row 102: expected a number"),
        (shown(motive).replace("Millimeters", "Furlongs"), {}, "found furlongs"),
        (shown(vicon).replace("100\n,,A", "\n,,A"), {}, "expected the header"),
        ("time,x,y,yaw\n", {}, "expected rows"),
        ("", {}, "an empty file"),
    ],
)
def test_what_is_wrong_with_a_table_is_named(
    log: Path, tmp_path: Path, text: str, how: dict[str, Any], said: str
) -> None:
    with pytest.raises(BadInputError, match=said):
        read(log, tmp_path, text, **how)


def test_c3d_is_refused_with_what_to_do(log: Path, tmp_path: Path) -> None:
    with pytest.raises(BadInputError, match="export it as TRC"):
        read(log, tmp_path, "P", "take.c3d")


def test_a_log_that_tells_no_turn_is_refused(tmp_path: Path) -> None:
    """A dry run: neither an inertial sensor nor measured joints."""
    robot = RobotSpec()
    still = Tick(
        number=1, t=0.0, now=0.0, counts=(0.0, 0.0), reading=(0.0, 0.0), level=(0.0, 0.0),
        contact=(0, 0), maneuver=0, phase=0.0, angles=(0.0,) * len(robot.joint_names),
    )  # fmt: skip
    with LogWriter(
        tmp_path / "a.mcap", Header(controller="open", params=ControlParams(), robot=robot)
    ) as out:
        out.write(still)
    with pytest.raises(BadInputError, match="an inertial sensor, or measured yaw joints"):
        read(tmp_path / "a.mcap", tmp_path, shown(plain))


@pytest.fixture(scope="module")
def simulated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A walk through the tunnel of a robot without an inertial sensor."""
    path = tmp_path_factory.mktemp("simulated") / "walk.mcap"
    antennate.simulate("closed", seed=5, time_limit=14.0, log=path)
    return path


def true_path(log: Path) -> Floats:
    """Time [s], x, y [m] and heading [rad] of the head, from what the engine says, shape (n, 4)."""
    rows = []
    with LogReader(log) as reader:
        for records, tick in reader.groups():
            for record in records:
                if tick is not None and record.topic is COORDINATES:
                    state = COORDINATES.decode(record.data)
                    x, y, _, w, qx, qy, qz = state["position"][state["robot"] :][:7]
                    yaw = math.atan2(2 * (w * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
                    rows.append((tick.now, x, y, yaw))
    return np.array(rows)


def test_a_simulated_walk_lies_over_its_true_path(simulated: Path, tmp_path: Path) -> None:
    """By its joints alone; the table is turned, moved, and shows a point beside the head."""
    t, x, y, heading = true_path(simulated)[5:-5].T
    z = x + 1j * y + 0.05j * np.exp(1j * heading)
    z = z * np.exp(0.8j) + (2.0 - 1.0j)
    text = wide(t + 7.0, [np.column_stack([z.real, z.imag, heading + 0.8])], 1.0, "t,x,y,yaw")
    poses = read(simulated, tmp_path, text)
    assert poses.log.source == "joints"
    clock = poses.clock
    assert (clock.at - clock.centre) == pytest.approx(-7.0, abs=clock.at_error)
    assert clock.at_error < 0.05
    assert abs(clock.drift) < clock.drift_error
    true = poses.beside()
    assert true is not None
    assert true.path_error < 0.01
    assert true.heading_error < math.radians(3.0)
    assert true.scale == pytest.approx(1.0, abs=0.02)


def test_log_plot_draws_poses_and_says_what_is_unusual(
    simulated: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    t, x, y, heading = true_path(simulated).T
    table = tmp_path / "pose.csv"
    table.write_text(
        wide(t, [np.column_stack([1100 * x, 1100 * y, heading])], 1.0, "t,x_mm,y_mm,yaw")
    )
    out = tmp_path / "poses.png"
    assert main(["log", "plot", str(simulated), "--poses", str(table), "--out", str(out)]) == 0
    said = capsys.readouterr()
    assert "By the joints, the clock of the log is" in said.out
    assert "its path is 1.10" in said.err
    assert out.read_bytes().startswith(b"\x89PNG")
    table.write_text(table.read_text().replace("x_mm,y_mm", "x,y"))
    assert main(["log", "plot", str(simulated), "--poses", str(table), "--overwrite"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert main(["log", "info", str(simulated), "--poses", str(table)]) == 2
    assert "--poses: expected `plot`" in capsys.readouterr().err
    assert main(["log", "plot", str(simulated), "--mirrored"]) == 2
