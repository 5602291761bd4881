"""A controller of one's own: found by every name, run everywhere, and invalid where it fails."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from twin_rig import Driven

import antennate
from antennate.cli import main
from antennate.control.controllers import closed_loop, open_loop
from antennate.control.kind import ControllerKind
from antennate.control.registry import CONTROLLERS, KINDS, looks, make_controller
from antennate.control.rule_controller import RuleController
from antennate.errors import ConfigError, WorkerError
from antennate.experiments.tunnel.experiment import EXPERIMENT
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.robots.antenna import AntennaSpec
from antennate.sim.scenes.registry import SCENES, make_scene
from antennate.sim.scenes.scene import FlatScene
from antennate.sim.trial import draw_trial
from antennate.testing import check_controller
from antennate.types import AntennaFrame, JointCommand, Maneuver, State

EXAMPLE = f"{Path(__file__).parents[1] / 'examples/own_controller.py'}:OwnController"
SHORT = {"trials": 3, "time_limit": 1.0, "seed": 3}


@pytest.fixture(autouse=True)
def _nothing_added() -> Iterator[None]:
    yield
    CONTROLLERS.added.clear()
    SCENES.added.clear()


def rows_of(name: str, **changes: Any) -> list[Any]:
    """The table of short trials."""
    return EXPERIMENT.run(
        TunnelConfig.model_validate({**SHORT, "controllers": [name], **changes})
    ).rows


def phase_of(trial: int) -> float:
    """Gait phase at the start of a trial [rad]."""
    config = TunnelConfig.model_validate(SHORT)
    scene, control = make_scene(config.scene, config.tunnel), config.control
    return draw_trial(config, scene, trial, control.gait, control.period).phase


# names


def test_a_controller_is_found_by_module_and_by_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "beside.py").write_text("OFFSET = 1\n")
    text = "from beside import OFFSET\nfrom antennate.control.controllers import paper as Mine\n"
    (tmp_path / "mine.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    assert isinstance(make_controller("mine.py:Mine"), RuleController)
    assert isinstance(make_controller("antennate.control.controllers:paper"), RuleController)


CTL = """
from antennate.control.registry import make_controller
import {helper}
def C(control, robot, batch):
    import {late}
    return make_controller({helper}.NAME, control, robot, batch)
"""


def two_folders(folder: Path, helper: str, late: str, **others: str) -> list[str]:
    """Names of two controllers, each in a folder of its own with a helper that names another."""
    for place, kind in (("one", "open"), ("two", "paper")):
        files = {
            "ctl": CTL.format(helper=helper, late=late),
            helper: f"NAME = {kind!r}\n",
            **others,
        }
        for name, text in files.items():
            path = folder / place / f"{name}.py"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
    return [str(folder / place / "ctl.py:C") for place in ("one", "two")]


@pytest.fixture
def nothing_imported(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What these tests import is none of others."""
    before = set(sys.modules)
    monkeypatch.setattr(sys, "path", [*sys.path])
    yield
    for name in set(sys.modules) - before:
        if name.startswith(("helper", "late", "antennate_user_code")):
            del sys.modules[name]


@pytest.mark.usefixtures("nothing_imported")
@pytest.mark.parametrize(
    ("helper", "late", "others", "clash"),
    [
        ("helper_a", "json", {}, "helper_a"),
        ("helper_b", "late_b", {"late_b": ""}, "helper_b|late_b"),
        ("helper_c", "json", {"helper_c/__init__": "NAME = 'open'"}, "helper_c"),
    ],
)
def test_a_file_that_would_be_given_the_module_of_another_is_refused(
    tmp_path: Path, helper: str, late: str, others: dict[str, str], clash: str
) -> None:
    """Python gives the first module of a name to all: both would walk alike."""
    one, two = two_folders(tmp_path, helper, late, **others)
    make_controller(one)
    with pytest.raises(ConfigError, match=rf"{two}', found no module ({clash}) of its own: .*one"):
        make_controller(two)


@pytest.mark.usefixtures("nothing_imported")
def test_a_module_that_only_the_second_file_imports_late_is_looked_at(tmp_path: Path) -> None:
    one, two = two_folders(tmp_path, "helper_d", "late_d", late_d="")
    Path(one.partition(":")[0]).write_text(CTL.format(helper="json", late="json"))
    (tmp_path / "two" / "ctl.py").write_text(
        "def C(control, robot, batch):\n    import helper_d\n    return helper_d\n"
    )
    with pytest.raises(ConfigError, match="has no attribute 'NAME'"):
        make_controller(one)  # its folder is searched from now on
    with pytest.raises(ConfigError, match="found no module helper_d of its own"):
        make_controller(two)


@pytest.mark.usefixtures("nothing_imported")
def test_files_beside_that_are_not_imported_or_are_the_same_do_not_matter(tmp_path: Path) -> None:
    others = {"__main__": "", "control": "", "types": "", "draft (old": "", "late_e": ""}
    one, two = two_folders(tmp_path, "helper_e", "json", **others)
    shared = tmp_path / "shared.py"
    shared.write_text("NAME = 'open'\n")
    for place in ("one", "two"):
        (tmp_path / place / "helper_e.py").unlink()
        (tmp_path / place / "helper_e.py").symlink_to(shared)
        (tmp_path / place / "closed").mkdir(mode=0)
        (tmp_path / place / "antennate").mkdir()  # as a clone beside one's file is
    assert type(make_controller(one)) is type(make_controller(two))


def test_an_installed_package_can_bring_a_controller(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    about = tmp_path / "theirs-1.0.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text(
        "[antennate.controllers]\ntheirs = antennate.control.controllers:paper\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    assert CONTROLLERS.names[-1] == "theirs"
    assert isinstance(make_controller("theirs"), RuleController)


@pytest.mark.parametrize(
    ("name", "what"),
    [
        ("clsoed", r"expected one of open, timed, paper, closed, .*did you mean closed\?"),
        ("missing.py:Mine", "no file"),
        ("no_such_module:Mine", "No module named 'no_such_module'"),
        ("antennate.control.controllers:Nobody", "no Nobody in antennate.control.controllers$"),
        ("math:pi", "expected a class or a function at 'math:pi', found float"),
        ("math:sqrt", "made from .control, robot, batch."),
        ("builtins:max", "made from .control, robot, batch.|without reset"),
    ],
)
def test_a_name_without_a_controller_is_refused(name: str, what: str) -> None:
    with pytest.raises(ConfigError, match=what) as found:
        make_controller(name)
    assert "\n" not in str(found.value)


def test_a_controller_can_be_added_in_python_but_not_in_place_of_ours() -> None:
    CONTROLLERS.add("added", open_loop)
    CONTROLLERS.add("added", closed_loop)
    assert CONTROLLERS.find("added") is closed_loop
    with pytest.raises(ConfigError, match="expected a new name"):
        CONTROLLERS.add("paper", open_loop)


@pytest.mark.ci
def test_what_is_added_in_python_is_known_in_worker_processes() -> None:
    CONTROLLERS.add("mine", closed_loop)
    SCENES.add("my_floor", FlatScene)
    changes = {"controllers": ["mine"], "scene": "my_floor", "trials": 2, "time_limit": 0.3}
    found = EXPERIMENT.run(TunnelConfig.model_validate(changes), workers=2).rows
    assert [(row.controller, row.outcome) for row in found] == [("mine", "timeout")] * 2


@pytest.mark.ci
def test_what_cannot_be_sent_to_workers_is_refused_in_one_line() -> None:
    CONTROLLERS.add("mine", lambda *words: closed_loop(*words))
    changes = {"controllers": ["mine"], "trials": 2, "time_limit": 0.3}
    with pytest.raises(WorkerError, match=r"sent to workers, found .*at the top of a module") as e:
        EXPERIMENT.run(TunnelConfig.model_validate(changes), workers=2)
    assert "\n" not in str(e.value)


# the example


@pytest.mark.ci
def test_a_file_with_a_kind_brings_sentence_and_colour(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "straight.py"
    file.write_text(
        "from antennate.control.controllers import open_loop\n"
        "from antennate.control.kind import ControllerKind\n"
        'STRAIGHT = ControllerKind("straight", "walks on and on", open_loop, colour="#123456")\n'
    )
    name = f"{file}:STRAIGHT"
    words = f"tunnel --trials 1 --time-limit 1 --controllers {name} open --out {tmp_path / 'run'}"
    assert main(words.split()) == 0
    assert f"{name}: walks on and on" in capsys.readouterr().out
    assert looks([name, "open"]) == {name: ("#123456", "solid"), "open": ("#8C8C8C", (0, (4, 1.5)))}
    (first, _) = json.loads((tmp_path / "run/result.json").read_text())["controllers"].items()
    assert first[0] == name
    assert "walks on and on" in (tmp_path / "run/report.html").read_text()


def test_a_kind_is_given_in_python_as_a_factory_is() -> None:
    kind = ControllerKind("straight", "walks on and on", open_loop)
    (row,) = antennate.run("tunnel", trials=1, time_limit=1.0, controllers=[kind]).rows
    assert row.controller == "straight"
    assert antennate.simulate(kind, time_limit=0.1).meta["controller"] == "straight"
    (row,) = antennate.run("tunnel", trials=1, time_limit=1.0, controllers=[KINDS["open"]]).rows
    assert row.controller == "open"
    failing = ControllerKind("lifted", "needs pitch servos", KINDS["lifted"].make)
    with pytest.raises(ConfigError, match=r"^<ControllerKind lifted>: expected "):
        make_controller(failing)


@pytest.mark.parametrize(
    ("part", "found"),
    [
        ("colour", "rot"),
        ("colour", "#12345"),
        ("reads", "rule"),
        ("make", None),
        ("about", 1),
    ],
)
def test_a_kind_with_a_part_that_cannot_be_is_refused_where_it_is_made(
    part: str, found: Any
) -> None:
    parts = {"name": "mine", "about": "", "make": open_loop} | {part: found}
    with pytest.raises(ConfigError, match=f"controller kind: {part}: expected .*, found "):
        ControllerKind(**parts)


def test_the_example_is_short() -> None:
    assert len(Path(EXAMPLE.rpartition(":")[0]).read_text().splitlines()) <= 40


@pytest.mark.ci
def test_the_example_runs_in_the_tunnel_in_worker_processes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["--trials", "2", "--time-limit", "0.5", "--workers", "2", "--no-figures"]
    out = ["--out", str(tmp_path / "run")]
    assert main(["tunnel", *words, *out, "--controllers", "open", EXAMPLE]) == 0
    table = (tmp_path / "run" / "trials.csv").read_text()
    assert table.count(EXAMPLE) == 2
    assert "invalid" not in table
    assert "OwnController" in capsys.readouterr().out


@pytest.mark.ci
def test_the_example_drives_the_twin() -> None:
    """By the code of `drive`, all of it through bytes, in lock-step."""
    driven = Driven(EXAMPLE)
    report, maneuvers, goals = driven.report, driven.maneuvers, set(driven.goals)
    assert report.worst < State.HOLD, report.why
    assert set(maneuvers[-200:]) <= {Maneuver.FORWARD, Maneuver.TURN_R}
    assert len(goals) > 200


# controllers that fail


class Clumsy:
    """`open`, which fails in one trial: that whose gait begins at a given phase."""

    phase = 0.0

    def __init__(self, control: Any, robot: Any, batch: int) -> None:
        self.inner = open_loop(control, robot, batch)
        self.bad, self.ticks = np.zeros(batch, bool), np.zeros(batch, int)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        self.inner.reset(rows, phase)
        self.bad[rows], self.ticks[rows] = abs(phase - self.phase) < 1e-9, 0

    def step(self, frame: AntennaFrame) -> JointCommand:
        self.ticks += 1
        return self.fail(self.inner.step(frame), self.bad & (self.ticks > 50))

    def fail(self, command: JointCommand, bad: Any) -> JointCommand:
        return command


class NotFinite(Clumsy):
    def fail(self, command: JointCommand, bad: Any) -> JointCommand:
        command.yaw[bad, 2] = np.nan
        return command


class NoManeuver(Clumsy):
    def fail(self, command: JointCommand, bad: Any) -> JointCommand:
        self.maneuver = np.where(bad, -1, self.inner.maneuver)
        return command


class NoContact(Clumsy):
    def fail(self, command: JointCommand, bad: Any) -> JointCommand:
        self.contact = np.where(bad[:, None], 7, self.inner.contact)
        return command


class Complex(Clumsy):
    def fail(self, command: JointCommand, bad: Any) -> JointCommand:
        yaw = command.yaw * (1j if bad.any() else 1)
        return JointCommand(yaw, command.leg, command.antenna)


class Raises(Clumsy):
    def fail(self, command: JointCommand, bad: Any) -> JointCommand:
        if bad.any():
            raise SystemExit("of my own")
        return command


class WrongShape(Clumsy):
    def fail(self, command: JointCommand, bad: Any) -> JointCommand:
        joints = 4 if bad.any() else 5
        return JointCommand(command.yaw[:, :joints], command.leg, command.antenna)


class BadReset(Clumsy):
    def reset(self, rows: Any, phase: Any = 0.0) -> None:
        super().reset(rows, phase)
        if self.bad.any():
            raise KeyError("of my own")


@pytest.fixture(scope="module")
def sound() -> list[Any]:
    """The trials of a controller that does not fail."""
    return rows_of("open")


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        (NotFinite, "controller: expected finite angles in yaw, found"),
        (NoManeuver, "controller: expected a maneuver of 0 to 4, found -1"),
        (NoContact, "controller: expected contacts of 0 to 2, found [7 7]"),
        (Complex, "controller: expected real numbers as yaw, found an array of complex128"),
        (Raises, "controller: step raised SystemExit: of my own"),
        (WrongShape, "controller: expected yaw of shape (1, 5), found (1, 4)"),
        (BadReset, "controller: reset raised KeyError: 'of my own'"),
    ],
    ids=lambda what: getattr(what, "__name__", ""),
)
def test_a_controller_that_fails_makes_its_trial_invalid_and_no_other(
    kind: type[Clumsy], reason: str, sound: list[Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Clumsy, "phase", phase_of(1))
    CONTROLLERS.add("clumsy", kind)
    found = rows_of("clumsy")
    assert [row.outcome for row in found] == ["timeout", "invalid", "timeout"]
    assert found[1].reason.startswith(reason)
    for mine, theirs in zip(found, sound, strict=True):
        if mine.trial != 1:
            assert (mine.progress_m, mine.force_mean_n) == (theirs.progress_m, theirs.force_mean_n)


@pytest.mark.ci
def test_a_failing_controller_is_named_by_its_path_and_its_invalid_trials_are_told(
    capsys, tmp_path
):
    (tmp_path / "my_file.py").write_text(
        "from antennate.control.controllers import open_loop\n"
        "def Fails(control, robot, batch):\n"
        "    made = open_loop(control, robot, batch)\n"
        "    made.step = lambda frame: 1 / 0\n"
        "    return made\n"
    )
    name = f"{tmp_path / 'my_file.py'}:Fails"
    argv = ["tunnel", "--trials", "1", "--workers", "1", "--time-limit", "0.2", "--no-figures"]
    assert main([*argv, "--controllers", name, "--out", str(tmp_path / "run")]) == 2
    out = capsys.readouterr().out
    assert f"No trial of {name} is valid: controller: step raised ZeroDivisionError" in out
    assert "my file" not in out
    assert out.splitlines()[0].endswith("Invalid trials: 1; trials.csv gives the reason of each.")
    assert "ZeroDivisionError" in (tmp_path / "run" / "trials.csv").read_text()


@pytest.mark.ci
def test_one_worker_survives_a_controller_that_ends_its_process_and_prints(
    tmp_path: Path,
) -> None:
    """Both in a process beside the command, whose output holds its own words alone."""
    (tmp_path / "my_file.py").write_text(
        "import signal\nfrom antennate.control.controllers import open_loop\n"
        "def Ends(control, robot, batch):\n"
        "    made = open_loop(control, robot, batch)\n"
        "    end = signal.raise_signal\n"
        "    made.step = lambda frame: print('my own words', flush=True) or end(9)\n"
        "    return made\n"
    )
    words = ["tunnel", "--trials", "1", "--workers", "1", "--no-figures", "--json", "--controllers"]
    done = subprocess.run(
        [sys.executable, "-m", "antennate", *words, "open", "my_file.py:Ends", "--time-limit", "1"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    result = json.loads(done.stdout)
    assert result["controllers"]["my_file.py:Ends"]["invalid"] == 1
    assert (
        "a worker process ended with code -9" in (tmp_path / "runs/tunnel-1/trials.csv").read_text()
    )
    assert "my own words" in done.stderr


def test_the_reason_of_a_failure_names_the_line_of_the_user(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "from antennate.control.controllers import open_loop\n"
        "def Fails(control, robot, batch):\n"
        "    made = open_loop(control, robot, batch)\n"
        "    made.step = lambda frame: int('x')\n"
        "    return made\n"
        "def Forgets(control, robot, batch):\n"
        "    made = open_loop(control, robot, batch)\n"
        "    made.step = lambda frame: None\n"
        "    return made\n"
    )
    with pytest.raises(AssertionError, match=r"step raised ValueError: .*mine\.py:4\)"):
        check_controller(f"{file}:Fails")
    with pytest.raises(AssertionError, match="expected a JointCommand from step, found None"):
        check_controller(f"{file}:Forgets")
    with pytest.raises(ConfigError, match=r"found no forgets in .*\(did you mean Forgets\?\)"):
        CONTROLLERS.find(f"{file}:forgets")


def test_a_sensor_longer_than_its_antenna_is_refused() -> None:
    with pytest.raises(ValueError, match=r"at most the length of 0\.14 m, found 0\.5 m"):
        AntennaSpec.model_validate({"length": 0.14, "sensor": {"active_length": 0.5}})


@pytest.mark.parametrize("part", ["reset", "step", "turn_offset"])
def test_a_rule_that_lacks_a_part_is_told_so_before_anything_runs(
    part: str, tmp_path: Path
) -> None:
    parts = {
        "reset": "def reset(self, rows): pass",
        "step": "def step(self, t, level, contact, flex): return np.zeros(len(t), int)",
        "turn_offset": "turn_offset = 0.5",
    }
    del parts[part]
    path = tmp_path / f"lacks_{part}.py"
    path.write_text(
        "import numpy as np\nfrom antennate.control.rule_controller import RuleController\n\n"
        "class Lame:\n" + "".join(f"    {text}\n" for text in parts.values()) + "\n"
        "def lame(control, robot, batch):\n"
        "    return RuleController(Lame(), control, robot, batch)\n"
    )
    told = rf"expected a rule with reset, step and turn_offset, .* found Lame without {part}$"
    with pytest.raises(ConfigError, match=told):
        make_controller(f"{path}:lame")
