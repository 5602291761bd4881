"""One robot.toml for drive, doctor and record: the very one that docs/hardware.md shows."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from doctor_rig import Patient, wrong
from test_bad_calibrations import GOOD

from antennate.cli import main
from antennate.cli.robot import RobotOptions, parse_robot
from antennate.cli.terminal import BAD_INPUT
from antennate.hardware.config import DoctorConfig, DriveConfig, RecordConfig, RobotFile
from antennate.hardware.doctor.checkup import examine
from antennate.messages import command_words
from antennate.params.base import read_file
from antennate.studies.formats import to_toml

PAGE = Path(__file__).parents[1] / "docs" / "hardware.md"
MODELS = {"drive": DriveConfig, "doctor": DoctorConfig, "record": RecordConfig}


def parsed(name: str, *words: str) -> Any:
    """The configuration of a command by the file of this folder and these words."""
    model: Any = MODELS[name]
    take: Any = RobotFile.for_record if name == "record" else None
    words = ("--config", "robot.toml", *words)
    return parse_robot(name, "", model, words, RobotOptions, take=take)[0]


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of the page, and the calibration that it names."""
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (tmp_path / "robot.toml").write_text(text)
    (tmp_path / "left").mkdir()
    made = GOOD.model_copy(update={"sensor_id": "left"})
    made.save(tmp_path / "left" / "calibration.json")
    monkeypatch.chdir(tmp_path)
    return Path("robot.toml")


@pytest.mark.parametrize("name", MODELS)
def test_the_file_of_the_page_serves_each_command(name: str, file: Path) -> None:
    robot = read_file(file, RobotFile)
    config = parsed(name)
    assert config == (robot.for_record() if name == "record" else robot.part(MODELS[name]))
    assert config.network == robot.network
    known = robot.record if name == "record" else robot
    for field in set(type(config).model_fields) - {"network"}:
        assert getattr(config, field) == getattr(known, field)


def test_each_command_takes_its_own_numbers_and_a_flag_counts_more(file: Path) -> None:
    tables = "[doctor]\nlisten = 1.5\n[record]\nmarks = [0.0, 10.0]\nduration = 9.0\n"
    file.write_text("duration = 60.0\n" + tables)
    assert parsed("drive").duration == 60.0
    assert parsed("doctor").doctor.listen == 1.5
    assert (parsed("record").marks, parsed("record").duration) == ((0.0, 10.0), 9.0)
    assert parsed("record", "--marks", "0", "5").marks == (0.0, 5.0)


@pytest.mark.parametrize("name", MODELS)
@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[robot]\nbuad = 1\n", "robot.buad: expected a known key of robot (did you mean"),
        ("[record]\nmark = [0, 1]\n", "record.mark: expected a known key of record"),
        ("marks = [0, 1]\n", "marks: expected a known key (did you mean record.marks?)"),
        ("[doctor]\nlisten = 0.0\n", "doctor.listen: expected a number above 0"),
    ],
)
def test_a_key_that_none_of_them_knows_is_an_error_in_all(
    name: str, text: str, said: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text(text)
    assert main([*command_words(name).split(), "--config", str(file)]) == BAD_INPUT
    told = capsys.readouterr().err
    assert f"robot.toml: {said}" in told
    assert told.count("\n") == 1


SAID = "robot.toml of this folder is read"
COMMANDS = {  # a word that each refuses once its file was read
    "drive": ["--esp32", "a", "--bus", "a"],
    "teleop": ["--hold-to-run"],
    "doctor": ["--esp32", "a", "--bus", "a"],
    "record": ["--esp32", "a"],
    "jog": ["--joint", "none"],
    "setup": ["--only", "none"],
    "zero": [],
    "twin": ["--tcp", "x"],
    "robot": ["--out", "/dev/null/x"],
}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_of_the_robot_reads_the_file_of_its_folder_and_says_so(
    name: str, file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [*command_words(name).split(), *COMMANDS[name]]
    file.write_text("[robot]\nbuad = 1\n")
    assert main(words) == BAD_INPUT
    said, why = capsys.readouterr().err.splitlines()
    assert said.startswith(SAID)
    assert "robot.toml: robot.buad: expected a known key" in why
    writes = name in ("setup", "zero")
    if writes:
        assert said == SAID
        assert main([*words, "--no-config"]) == BAD_INPUT
        assert "expected a known flag" in capsys.readouterr().err
    else:
        assert said == f"{SAID}; --no-config leaves it"
        assert main([*words, "--no-config"]) == BAD_INPUT
        (line,) = capsys.readouterr().err.splitlines()
        assert "buad" not in line
    file.rename("other.toml")
    assert main([*words, "--config", "other.toml"]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert "other.toml: robot.buad: expected a known key" in line


def test_a_file_that_is_named_is_read_alone(file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file.write_text("a line that is no TOML\n")
    Path("other.toml").write_text('[ports]\nesp32 = "one"\nbus = "one"\n')
    assert main(["drive", "--config", "other.toml"]) == BAD_INPUT
    (line,) = capsys.readouterr().err.splitlines()
    assert "expected two ports, found one twice" in line
    assert main(["drive", "--config", "other.toml", "--no-config"]) == BAD_INPUT
    assert "--no-config: expected no --config beside it, found both" in capsys.readouterr().err
    assert main(["twin", "--servos", "1:none", "--duration", "1"]) == BAD_INPUT
    assert SAID not in capsys.readouterr().err


def test_twin_and_robot_take_the_robot_of_the_file(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file.write_text('duration = 9.0\nrobot = "hexapod"\n')
    assert main(["twin"]) == BAD_INPUT
    assert "expected a robot with antennae for the twin" in capsys.readouterr().err
    file.write_text("duration = 9.0\n[robot.yaw]\nzeros = [2000, 2001, 2002, 2003, 2004]\n")
    assert main(["robot", "--json", "--out", "run"]) == 0
    joints = json.loads(capsys.readouterr().out)["joints"]
    assert [joints[f"yaw{n}"]["zero"] for n in range(1, 6)] == [2000, 2001, 2002, 2003, 2004]


def test_doctor_judges_the_antennae_by_the_calibration_file(file: Path) -> None:
    robot = read_file(file, RobotFile).part(DoctorConfig).calibrated()
    patient = Patient()
    patient.robot.hold(0, 1700.0)
    checkup = examine(robot, None, ("/dev/esp32", patient.esp32), patient.clock.now)
    rows = {row.check: row for row in checkup.rows}
    low, high = GOOD.counts_low, GOOD.counts_high
    assert rows["left at rest"].expected.startswith(f"{low - 20:.0f} to {high + 20:.0f} counts")
    assert rows["left at rest"].grade == "bad"


def test_S9_doctor_names_the_board_to_which_the_films_do_not_belong(file: Path) -> None:
    patient = Patient()
    robot = RobotFile(sensor_id="0" * 16).part(DoctorConfig)
    row = wrong(examine(robot, None, ("/dev/esp32", patient.esp32), patient.clock.now))[
        "esp32: sensors"
    ]
    assert row.expected == f"on board {'0' * 16}"
    assert row.found == f"board {b'twin'.hex()}00000000"


def test_what_a_run_keeps_is_a_robot_file_that_needs_no_calibration_file(file: Path) -> None:
    robot = read_file(file, RobotFile)
    for model in (DriveConfig, DoctorConfig):
        kept, config = Path("kept.toml"), robot.part(model).calibrated()
        kept.write_text(to_toml(config))
        again = read_file(kept, RobotFile)
        assert again.part(model).calibrated() == config
        assert again.control.conditioning.counts_low == GOOD.counts_low


def test_record_with_the_file_of_drive_gets_as_far_as_the_port(
    file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["record", "--config", str(file), "--esp32", "/dev/null", "--out", "left.csv"]
    assert main(words) == BAD_INPUT
    assert "/dev/null: not a serial port" in capsys.readouterr().err


@pytest.mark.ci
def test_a_file_that_a_user_left_in_the_clone_is_not_read_by_the_tests(tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text('[ports]\nbus = "ports/bus"\nesp32 = "ports/esp32"\n')
    others = Path(__file__).with_name("test_dependent_options.py")
    words = ["-n", "0", "-p", "no:cacheprovider", "--collect-only", "-q", str(others)]
    words += ["-c", str(others.parents[1] / "pyproject.toml")]
    done = subprocess.run(
        [sys.executable, "-m", "pytest", *words], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["robot.toml"]
