"""Films: what is kept, what the strip shows, and what is said where none can be made."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pytest

import antennate
from antennate.cli import main
from antennate.errors import AntennateError, BadInputError
from antennate.experiments.tunnel.experiment import ending, films
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.params.gaits import GaitParams
from antennate.params.scene import PhysicsParams
from antennate.robots.spec import RobotSpec
from antennate.sim import engine_setup
from antennate.sim.camera import Camera
from antennate.sim.parts import ANTENNA_BIT, LEG_BIT
from antennate.sim.scenes.ground import GroundScene
from antennate.sim.trial import make_world, place_at_start
from antennate.telemetry import film
from antennate.telemetry.film import HEIGHT, RATE, STRIP, WIDTH, FilmRecorder, WalkRecorder
from antennate.telemetry.strip import WINDOW, Band, Strip, Trace

QUICK = ["tunnel", "--trials", "1", "--controllers", "open", "--time-limit", "1", "--workers", "1"]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.chdir(tmp_path)
    engine_setup.backend.cache_clear()
    yield
    engine_setup.backend.cache_clear()


def require_drawing() -> None:
    """Skip where the machine has neither EGL nor OSMesa."""
    pytest.importorskip("av")
    try:
        engine_setup.backend()
    except AntennateError as error:
        pytest.skip(str(error))


def test_from_the_side_a_walk_is_seen_lower_and_nearer_and_is_the_same() -> None:
    config = TunnelConfig(trials=1, controllers=("open",), time_limit=0.5, scene="step_up")
    above = films(config, 0)["open"]()
    side = above.seen_from("side")
    assert above.seen_from("above") is above
    assert side.shot.elevation < 30.0 < above.shot.elevation
    assert side.shot.distance < above.shot.distance
    assert side.shot.azimuth == above.shot.azimuth == 90.0
    assert side.positions is above.positions
    assert above.targets[:, 2] == pytest.approx(0.033, abs=0.01)  # the links, not the floor


@pytest.mark.ci
@pytest.mark.parametrize("view", ["above", "side"])
def test_ground_floor_and_sky_are_told_apart_in_a_picture(view: Any) -> None:
    """The floor before the step is grey, ground is warmer, and the sky is white."""
    require_drawing()
    robot = RobotSpec.named("scuttle3d")
    scene = GroundScene("step_up").draw(robot, np.random.default_rng(0))
    world = make_world(PhysicsParams(), robot, scene)
    place_at_start(world, scene, GaitParams())
    world.data.qpos[world.root] = scene.edges[0].x - 0.2
    mujoco.mj_kinematics(world.model, world.data)
    recorder = WalkRecorder(robot)
    recorder.see(world, 0.0, counts=np.zeros(2))
    [picture] = film.pictures(recorder.walk("", [], []).seen_from(view))
    low = picture[HEIGHT // 2 + 40].astype(int)
    floor, ground = low[60], low[WIDTH - 20]
    assert np.ptp(floor) <= 3
    assert floor.min() > 120
    assert ground[0] > ground[2] + 5
    assert (picture[5] == 255).all() == (view == "side")


@pytest.mark.parametrize("speed", [1.0, 2.0])
def test_a_picture_is_kept_whenever_it_is_due(speed: float) -> None:
    recorder = FilmRecorder(speed)
    for tick in range(201):
        recorder.take(0.01 * tick, np.array([float(tick)]), (0.0, 0.0), tick=tick)
    assert len(recorder) == 1 + round(2.0 * RATE / speed)
    assert recorder.values("tick") == pytest.approx(100 * np.arange(len(recorder)) * speed / RATE)


def test_what_is_kept_does_not_change_afterwards() -> None:
    recorder, position = FilmRecorder(), np.zeros(2)
    recorder.take(0.0, position, (1.0, 2.0))
    position += 1.0
    made = recorder.film("one", None, film.Shot(1.0), [], [])
    assert made.positions.tolist() == [[0.0, 0.0]]
    assert made.targets.tolist() == [[1.0, 2.0, 0.0]]
    with pytest.raises(BadInputError, match="two: expected a trial that begins"):
        FilmRecorder().film("two", None, film.Shot(1.0), [], [])


def test_the_strip_shows_the_newest_state_and_value_at_its_right_end() -> None:
    """A trace at the top of its axis, a mark in the middle, and a band that turns red."""
    t = np.arange(0.0, 20.0, 0.1)
    top = np.ones((len(t), 1))
    states = (t > 15.0).astype(int)
    looks = {0: ("calm", "#00FF00"), 1: ("alarm", "#FF0000")}
    bands = [Band("state", states, looks)]
    strip = Strip("title", t, [Trace("x", top, 0.0, 1.0, mark=0.5)], bands, 400, 100)
    pixels = np.asarray(strip.picture(len(t) - 1)).astype(int)
    assert pixels.shape == (100, 400, 3)
    red = np.argwhere((pixels == [255, 0, 0]).all(axis=2))
    green = np.argwhere((pixels == [0, 255, 0]).all(axis=2))
    assert len(red) > 0
    assert green[:, 1].max() <= red[:, 1].min()
    share = np.ptp(red[:, 1]) / (np.ptp(red[:, 1]) + np.ptp(green[:, 1]))
    assert share == pytest.approx((t[-1] - 15.0) / WINDOW, abs=0.05)
    blue = (pixels[..., 2] - pixels[..., 0] > 100)[:, :200]
    line = np.flatnonzero(blue[40:].sum(axis=1) > 100)
    assert len(line) == 0, "no line but at the top of the chart"
    assert (blue[25:40].sum(axis=1) > 100).any()


def test_what_stands_beside_a_chart_is_crossed_by_no_curve() -> None:
    """The same picture of it whatever the curve is, at its top, in the middle and at its foot."""
    t = np.arange(0.0, 20.0, 0.1)

    def left(value: float) -> Any:
        trace = Trace("x", np.full((len(t), 1), value), 0.0, 1.0, ".2f", 0.5, "θ = 0.5")
        pixels = np.asarray(Strip("", t, [trace], [], 400, 150).picture(len(t) - 1)).astype(int)
        blue = (pixels[30:, :200, 2] - pixels[30:, :200, 0]) > 100
        return pixels[30:, : np.nonzero(blue)[1].min() - 1]

    shown = [left(value) for value in (0.0, 0.5, 1.0)]
    assert (shown[0] < 160).any(axis=2).sum() > 100, "there are words"
    assert all(np.array_equal(shown[0], each) for each in shown[1:])


@pytest.mark.parametrize(
    ("outcome", "stuck", "recovered", "word"),
    [
        ("success", 1, 1, "out after 31.9 s"),
        ("timeout", 2, 1, "stuck after 31.9 s"),
        ("timeout", 1, 1, "not out after 31.9 s"),
        ("left", 0, 0, "left the scene after 31.9 s"),
    ],
)
def test_a_film_of_the_tunnel_ends_with_a_word_on_the_outcome(
    outcome: Any, stuck: int, recovered: int, word: str
) -> None:
    shares = dict.fromkeys(("forward", "turn_l", "turn_r", "reverse", "hold"), 0.2)
    row = TrialResult(
        seed=0,
        trial=0,
        controller="open",
        outcome=outcome,
        time_s=31.92,
        progress_m=1.0,
        stuck=stuck,
        recovered=recovered,
        **{f"share_{name}": share for name, share in shares.items()},
        force_mean_n=1.0,
        force_max_n=2.0,
        reason="",
    )
    assert ending(row, TunnelConfig()) == word


@pytest.mark.ci
def test_a_thin_antenna_is_seen_and_the_physics_keeps_its_own() -> None:
    """It is at least three pixels wide; a leg is as it is."""
    require_drawing()
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><worldbody>
        <geom type="capsule" fromto="-1 0 0 1 0 0" size="1e-4" contype="{ANTENNA_BIT}"/>
        <geom type="capsule" fromto="-1 1 0 1 1 0" size="1e-4" contype="{LEG_BIT}"/>
        </worldbody></mujoco>"""
    )
    sides = ((0.0, 0.0, 1.0, 1.0), (1.0, 0.0, 0.0, 1.0))
    shot = film.Shot(2.0, elevation=90.0)
    with Camera(model, shot, (200, 200), sides) as camera:
        picture = camera.picture(np.zeros(0), np.zeros(3)).astype(int)
    blue = picture[60:140, 100, 2] - picture[60:140, 100, 0] > 60
    assert 2 <= blue.sum() <= 5
    assert model.geom_size[:, 0].tolist() == [1e-4, 1e-4]


def test_values_that_are_missing_leave_a_gap_and_no_error() -> None:
    t = np.arange(0.0, 1.0, 0.1)
    values = np.full((len(t), 2), np.nan)
    strip = Strip("", t, [film.counts_trace(values)], [], 200, 60)
    assert np.asarray(strip.picture(5)).shape == (60, 200, 3)


def refusal(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """The one line with which a command refuses, before it has written anything."""
    assert main([*QUICK, "--out", "run", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert not Path("run").exists()
    return err


def test_without_pyav_the_cure_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    told = refusal(capsys, "--video")
    assert "expected the package PyAV, found none" in told
    assert "antennate[video]" in told


def test_without_an_encoder_it_is_told(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "av", SimpleNamespace(codecs_available={"mpeg4"}))
    assert "expected PyAV with an encoder for H.264" in refusal(capsys, "--video")


@pytest.mark.ci
def test_without_a_driver_the_package_is_named(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("OpenGL")
    monkeypatch.setitem(sys.modules, "av", SimpleNamespace(codecs_available={"libx264"}))
    monkeypatch.setenv("MUJOCO_GL", "egl")
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/nowhere.json")  # libEGL finds no driver
    told = refusal(capsys, "--video")
    assert "expected EGL or OSMesa to draw without a display" in told
    assert "apt-get install libegl1 libgl1-mesa-dri" in told


@pytest.mark.slow
def test_a_way_to_draw_that_does_not_exist_matters_where_something_is_drawn_alone(
    tmp_path: Path,
) -> None:
    """The engine itself raises when it is imported."""
    words = [sys.executable, "-m", "antennate", "tunnel", "--scene", "flat", "--trials", "1"]
    words += ["--controllers", "open", "--time-limit", "0.1", "--no-figures", "--out", "run"]
    env = os.environ | {"MUJOCO_GL": "nonsense"}
    for more, code, said in (([], 0, ""), (["--video", "--overwrite"], 2, "MUJOCO_GL: expected ")):
        done = subprocess.run(
            [*words, *more], cwd=tmp_path, env=env, capture_output=True, text=True, check=False
        )
        assert (done.returncode, "Traceback" in done.stderr) == (code, False), done.stderr
        assert said in done.stderr


def test_words_that_do_not_fit_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert "--video-trial: expected --video beside it" in refusal(capsys, "--video-trial", "1")
    told = refusal(capsys, "--video", "--video-trial", "1")
    assert "expected a trial of this run, 0 to 0, found 1" in told
    assert main(["geometry", "--video"]) == 2
    assert "expected a flag of this command, found --video" in capsys.readouterr().err
    with pytest.raises(BadInputError, match="expected an experiment that can be filmed"):
        antennate.run("geometry", out="run", video=0)
    with pytest.raises(BadInputError, match="expected a run directory"):
        antennate.run("tunnel", video=0)


def test_the_filmed_trial_is_that_of_the_study() -> None:
    """On the flat floor a robot succeeds; its film ends when its row says."""
    config = TunnelConfig(scene="flat", trials=1, controllers=("open",), time_limit=60.0, seed=1)
    row = antennate.run(config).rows[0]
    made = films(config, 0)["open"]()
    assert "success" in made.title
    assert made.t[-1] == pytest.approx(row.time_s, abs=2.0 / RATE)
    assert len(made.positions) == len(made.t) == len(made.bands[0].states)


@pytest.mark.ci
def test_a_film_is_written_and_the_study_stays_as_it_is(
    capsys: pytest.CaptureFixture[str],
) -> None:
    require_drawing()
    import av

    half = [*QUICK, "--time-limit", "0.5", "--no-figures"]
    assert main([*half, "--out", "plain"]) == 0
    assert main([*half, "--out", "filmed", "--video"]) == 0
    for name in ("result.json", "trials.csv"):
        assert Path("plain", name).read_bytes() == Path("filmed", name).read_bytes()
    data = Path("filmed/films/open.mp4").read_bytes()
    with av.open(io.BytesIO(data)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert (stream.width, stream.height) == (WIDTH, HEIGHT + STRIP)
        assert stream.average_rate == RATE
        frames = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    held = RATE  # the outcome is shown for a second
    assert len(frames) == pytest.approx(1 + 0.5 * RATE / 2 + held, abs=1), "twice as fast"
    before, end = (frames[k].astype(int) for k in (-held - 1, -1))
    rows, columns = np.nonzero(np.abs(end - before).max(axis=2) > 60)
    assert len(rows) > 500, "a word is there"
    assert 0.75 * HEIGHT < rows.min() < rows.max() < HEIGHT
    assert abs((columns.min() + columns.max()) / 2 - WIDTH / 2) < 20
    view, strip = frames[-1][:HEIGHT], frames[-1][HEIGHT:]
    assert view.std() > 10, "something is seen"
    assert (strip > 240).mean() > 0.5
    assert "data:video/mp4;base64," in Path("filmed/report.html").read_text()
    assert main([*half, "--out", "filmed", "--overwrite"]) == 0
    assert not Path("filmed/films/open.mp4").exists()


@pytest.mark.ci
def test_the_film_of_a_log_needs_room_before_it_is_drawn(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """26 pictures of 4 kB; nothing of a film that cannot be kept is drawn."""
    require_drawing()
    antennate.simulate("open", scene="flat", time_limit=1.0, log="log.mcap")
    assert main(["log", "film", "log.mcap", "--out", "nowhere/a.mp4"]) == 2
    assert "expected a folder to write nowhere/a.mp4" in capsys.readouterr().err
    monkeypatch.setattr(shutil, "disk_usage", lambda place: SimpleNamespace(free=20_000.0))
    assert main(["log", "film", "log.mcap"]) == 2
    told = capsys.readouterr().err
    assert told.endswith("expected 104 kB free for log.mp4, found 20 kB\n")
    assert told.count("\n") == 1
    assert [path.name for path in Path().iterdir()] == ["log.mcap"]


@pytest.mark.ci
def test_an_encoder_that_fails_is_no_fault_of_the_file(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """H.264 with halved colours takes no odd width."""
    require_drawing()
    antennate.simulate("open", scene="flat", time_limit=0.1, log="log.mcap")
    monkeypatch.setattr(film, "WIDTH", WIDTH + 1)
    assert main(["log", "film", "log.mcap"]) == 2
    told = capsys.readouterr().err.splitlines()[-1]
    assert told.startswith("antennate log: error: video: expected to encode it with ")
    assert [path.name for path in Path().iterdir()] == ["log.mcap"]
