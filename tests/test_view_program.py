"""What a program does for a page that shows it: send, wait, and carry out what a person wants."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import mujoco
import numpy as np
import pytest
from view_rig import ANTENNATE, child_of, shown

from antennate import simulate
from antennate.control.loop import Retunable
from antennate.control.registry import make_controller
from antennate.params.control import ControlParams, RuleParams
from antennate.robots.spec import RobotSpec
from antennate.sim.shapes import VisibleModel, picture, snapshot
from antennate.telemetry import Restart
from antennate.telemetry.view.channel import (
    END,
    ORDER,
    POSES,
    SCENE,
    SNAPSHOT,
    STATE,
    TICK,
    Channel,
    read,
)
from antennate.telemetry.view.pace import Pace
from antennate.telemetry.view.process import ViewProcess
from antennate.types import AntennaFrame, Contact

Pair = tuple[Channel, Channel]


@pytest.fixture
def pair() -> Iterator[Pair]:
    """Both ends of a channel."""
    ours, theirs = map(Channel, Channel.pair())
    yield ours, theirs
    ours.close()
    theirs.close()


def test_a_page_that_takes_nothing_holds_nobody_up(pair: Pair) -> None:
    """A sender is as fast with a full channel as with an empty one, and counts what was lost."""
    ours, _ = pair
    sent = sum(ours.send(POSES, bytes(4000)) for _ in range(5000))
    assert 0 < sent < 5000
    assert ours.dropped == 5000 - sent
    assert not ours.closed


def test_a_long_message_comes_whole(pair: Pair) -> None:
    """Shapes of a scene, of more bytes than a message may have."""
    ours, theirs = pair
    content = np.arange(40_000, dtype=np.int32).tobytes()
    assert ours.send_whole(SCENE, content)
    assert list(theirs.receive()) == [(SCENE, content)]


def test_messages_that_go_together_come_one_by_one(pair: Pair) -> None:
    """In their order, empty ones too; what there is no room for is dropped as one."""
    ours, theirs = pair
    assert ours.send(TICK, b"before")
    assert ours.send_together((POSES, b"poses" * 1000), (TICK, b""), (STATE, b"{}"))
    assert list(theirs.receive()) == [
        (TICK, b"before"),
        (POSES, b"poses" * 1000),
        (TICK, b""),
        (STATE, b"{}"),
    ]
    sent = sum(ours.send_together((POSES, bytes(4000)), (TICK, b"t")) for _ in range(5000))
    assert ours.dropped == 5000 - sent
    assert len(list(theirs.receive())) == 2 * sent


def test_a_message_longer_than_the_channel_comes_whole_and_holds_nobody_up(pair: Pair) -> None:
    """A picture of very many parts. Short messages pass it; further long ones are dropped."""
    ours, theirs = pair
    content = np.arange(1_000_000, dtype=np.int32).tobytes()
    assert ours.send(POSES, content)
    assert not ours.send_together((POSES, content[::-1]), (TICK, b"left out"))
    assert (ours.dropped, ours.closed) == (1, False)
    found = [*theirs.receive()]
    assert found == []
    assert ours.send(TICK, b"next")
    for _ in range(100):
        found += theirs.receive()
        list(ours.receive())  # as a program does that looks for orders
    assert found == [(TICK, b"next"), (POSES, content)]
    assert ours.send_together((POSES, content[::-1]), (TICK, b"now"))
    for _ in range(100):
        found += theirs.receive()
        list(ours.receive())
    assert found[2:] == [(POSES, content[::-1]), (TICK, b"now")]
    assert ours.dropped == 1


def test_the_last_messages_come_before_the_end(pair: Pair) -> None:
    """A picture of very many parts, then the end, however late the page takes them."""
    ours, theirs = pair
    content = np.arange(1_000_000, dtype=np.int32).tobytes()
    assert ours.send(POSES, content)
    found: list[tuple[bytes, bytes]] = []

    def take() -> None:
        time.sleep(0.2)
        until = time.monotonic() + 20.0
        while not theirs.closed and time.monotonic() < until:
            found.extend(theirs.receive())

    page = threading.Thread(target=take)
    page.start()
    ours.finish(END)
    ours.close()
    page.join()
    assert found == [(POSES, content), (END, b"")]


def test_a_page_that_takes_nothing_delays_the_end_but_a_moment(pair: Pair) -> None:
    """Whether it is stuck or gone."""
    ours, theirs = pair
    assert ours.send(POSES, bytes(4_000_000))
    start = time.monotonic()
    ours.finish(END)
    assert not ours.closed
    theirs.close()
    ours.finish(END)
    assert ours.closed
    assert time.monotonic() - start < 30.0


def test_a_scene_of_3000_parts_moves(pair: Pair) -> None:
    """Its snapshot, which holds 12 numbers of 8 bytes of each, is taken while it falls."""
    ours, theirs = pair
    balls = "".join(
        f'<body pos="{0.1 * (i % 60)} {0.1 * (i // 60)} 1"><freejoint/><geom size="0.01"/></body>'
        for i in range(3000)
    )
    model = mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{balls}</worldbody></mujoco>")
    data = mujoco.MjData(model)
    shapes = VisibleModel(model, ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0))).shapes()
    for _ in range(3):
        mujoco.mj_step(model, data)
        assert ours.send_together((SNAPSHOT, snapshot(data)), (TICK, b"first"))
        messages = [*theirs.receive()]
        ours.send(TICK)
        messages += theirs.receive()
        assert [kind for kind, _ in messages] == [SNAPSHOT, TICK, TICK]
        shown = picture(messages[0][1], shapes)
        assert shown is not None
        np.testing.assert_allclose(shown[1][:, :3], data.geom_xpos, rtol=1e-6)
        assert data.geom_xpos.shape == (3000, 3)
    assert data.geom_xpos[:, 2].max() < 1.0


def test_an_end_that_closes_is_noticed(pair: Pair) -> None:
    """The program runs on without a page."""
    ours, theirs = pair
    theirs.close()
    assert not ours.send(TICK, b"x")
    assert list(ours.receive()) == []
    assert ours.closed
    begin = time.monotonic()
    pace = Pace(ours, 0.001)
    pace.wait(0.0)
    pace.wait(3600.0)  # a thousand hours at this speed
    assert time.monotonic() - begin < 60


def test_time_goes_as_fast_as_is_wanted(pair: Pair) -> None:
    """0.2 s of the program at 4 times real time take 0.05 s or more."""
    pace = Pace(pair[0], 4.0)
    pace.wait(10.0)
    begin = time.monotonic()
    pace.wait(10.2)
    assert time.monotonic() - begin >= 0.05


def test_a_page_makes_it_stand_and_step(pair: Pair) -> None:
    """One step lets one tick pass; nobody is asked twice."""
    ours, theirs = pair
    pace = Pace(ours, 0.0)
    theirs.tell(ORDER, do="pause", on=True)
    theirs.tell(ORDER, do="step")
    pace.look()
    pace.wait(0.0)  # the step
    assert pace.state["paused"]
    theirs.tell(ORDER, do="pause", on=False)
    pace.wait(0.01)
    assert not pace.state["paused"]
    states = [read(content)["paused"] for kind, content in theirs.receive() if kind == STATE]
    assert states == [True, True, False]


def test_orders_that_are_none_are_left_alone(pair: Pair) -> None:
    """Whatever comes, the program goes on as before."""
    ours, theirs = pair
    pace = Pace(ours, 2.0)
    before = dict(pace.state)
    for content in (b"", b"[]", b"{", b"null", b'{"do": "speed", "value": "x"}', b"\xff"):
        theirs.send(ORDER, content)
    theirs.tell(ORDER, do="speed", value=-1.0)
    theirs.tell(ORDER, do="speed", value=float("nan"))
    pace.look()
    assert pace.state == before


def test_other_numbers_change_what_is_decided() -> None:
    """A level between two thresholds is contact for one of them; the gait goes on in its phase."""
    control = ControlParams(rule=RuleParams(threshold=0.9))
    robot = RobotSpec()
    controller = Retunable(lambda values: make_controller("paper", values, robot), control)
    controller.reset(np.array([0]), 0.5)
    lasting = round(1.0 / control.period)
    curve = control.conditioning
    span = curve.counts_high - curve.counts_low
    half = curve.counts_low + span * curve.midpoint  # the reading whose level is one half
    frame = AntennaFrame(t=np.zeros(1), counts=np.full((1, 2), half))

    def walk() -> None:
        for _ in range(lasting):
            controller.step(frame)

    walk()
    assert controller.level[0] == pytest.approx([0.5, 0.5])
    assert controller.contact[0].tolist() == [Contact.FREE, Contact.FREE]
    phase = controller.phase
    controller.retune(ControlParams(rule=RuleParams(threshold=0.3)))
    assert controller.phase == pytest.approx(phase)
    walk()
    assert controller.contact[0].tolist() == [Contact.CONTACT, Contact.CONTACT]


def said(*words: str, code: str = "", folder: Path) -> tuple[int, str]:
    """Exit code and stderr of a command; `code` runs before it."""
    start = f"{code}\nfrom antennate.cli import main\nraise SystemExit(main())"
    how = [sys.executable, "-c", start] if code else ANTENNATE
    done = subprocess.run(
        [*how, *words], capture_output=True, text=True, cwd=folder, timeout=120, check=False
    )
    return done.returncode, done.stderr


FLAT = ["--trials", "1", "--controllers", "open", "--scene", "flat", "--time-limit", "1"]
TUNNEL = ["tunnel", *FLAT, "--view"]


@pytest.mark.ci
def test_a_port_that_is_taken_is_told_in_one_line(tmp_path: Path) -> None:
    """Nothing is run and nothing left."""
    with ViewProcess(0, "antennate.cli.pages") as view:
        code, text = said(*TUNNEL, "--view-port", str(view.port), folder=tmp_path)
    assert code == 2
    assert text.count("\n") == 1
    assert str(view.port) in text
    assert "--view-port" in text
    assert not list(tmp_path.iterdir())


@pytest.mark.ci
def test_the_page_of_a_log_names_its_own_option(tmp_path: Path) -> None:
    """`view` has --port, not --view-port."""
    simulate("open", scene="flat", time_limit=0.1, log=tmp_path / "trial.mcap")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = str(taken.getsockname()[1])
        code, text = said("log", "view", "trial.mcap", "--port", port, folder=tmp_path)
    assert code == 2
    assert text.count("\n") == 1
    assert "with --port, 0 takes any" in text


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of a tenth of a second."""
    path = tmp_path_factory.mktemp("trial") / "trial.mcap"
    simulate("open", scene="flat", time_limit=0.1, log=path)
    return path


def ended(process: int) -> bool:
    """Whether a process is gone, or is so soon."""
    end = time.monotonic() + 10.0
    while (there := Path(f"/proc/{process}").exists()) and time.monotonic() < end:
        time.sleep(0.02)
    return not there


@pytest.mark.ci
def test_a_page_whose_process_dies_ends_the_command_with_2(trial: Path) -> None:
    with shown("log", "view", trial.name, "--port", "0", folder=trial.parent) as view:
        assert view.link
        os.kill(child_of(view.process.pid), signal.SIGKILL)
        assert view.process.wait(30) == 2
        assert "found that it ended with code -9" in view.said("antennate log view: error: ")
        assert "Traceback" not in "".join(view.lines)


@pytest.mark.ci
@pytest.mark.parametrize("stop", [signal.SIGTERM, signal.SIGHUP])
def test_a_signal_ends_the_command_and_its_page(trial: Path, stop: signal.Signals) -> None:
    with shown("log", "view", trial.name, "--port", "0", folder=trial.parent) as view:
        assert view.link
        child = child_of(view.process.pid)
        view.process.send_signal(stop)
        assert view.process.wait(30) == 0
        assert ended(child)
        assert len(view.lines) == 1


@pytest.mark.ci
@pytest.mark.parametrize(
    ("package", "flags", "extra"),
    [
        ("viser", ["--view", "--view-port", "0"], "antennate[view]"),
        ("foxglove", ["--foxglove", "--foxglove-port", "0"], "antennate[foxglove]"),
    ],
)
def test_a_missing_package_is_told_in_one_line(
    package: str, flags: list[str], extra: str, tmp_path: Path
) -> None:
    """The line names what to install."""
    hidden = f"import sys; sys.modules['{package}'] = None"
    code, text = said("tunnel", *FLAT, *flags, code=hidden, folder=tmp_path)
    assert code == 2
    assert text.count("\n") == 1
    assert extra in text


@pytest.mark.ci
def test_a_port_of_foxglove_that_is_taken_is_told_in_one_line(tmp_path: Path) -> None:
    """Its own server finds that out."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        code, text = said("tunnel", *FLAT, "--foxglove", "--foxglove-port", port, folder=tmp_path)
    assert code == 2
    assert text.count("\n") == 1
    assert "--foxglove-port" in text


@pytest.mark.ci
@pytest.mark.parametrize(
    ("words", "flag"),
    [
        (
            ["gait", "--view", "--view-port", "8765", "--foxglove", "--foxglove-port", "8765"],
            "found 8765 twice",
        ),
        (["tunnel", "--view-port", "1234"], "--view-port"),
        (["tunnel", "--view-speed", "2"], "--view-speed"),
        (["tunnel", "--view-paused"], "--view-paused"),
        (["tunnel", "--view", "--workers", "2"], "--workers"),
        (["tunnel", "--foxglove", "--engine", "dask"], "--engine"),
        (["tunnel", "--view", "--trial-timeout", "9"], "--trial-timeout"),
        (["tunnel", "--foxglove", "--retry"], "--retry"),
        (["tunnel", "--view", "--view-port", "65536"], "--view-port"),
        (["tunnel", "--view", "--view-speed", "-1"], "--view-speed"),
        (["tunnel", "--foxglove-port", "1"], "--foxglove-port"),
        (["antenna", "--view"], "--view"),
    ],
)
def test_what_would_be_ignored_is_refused(words: list[str], flag: str, tmp_path: Path) -> None:
    """A flag that says something of a page needs one."""
    code, text = said(*words, folder=tmp_path)
    assert code == 2
    assert text.count("\n") == 1
    assert flag in text


def test_a_restart_has_its_seed() -> None:
    """What a person wants comes as an exception, out of whatever runs."""
    assert Restart(7).seed == 7
