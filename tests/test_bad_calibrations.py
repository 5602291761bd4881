"""S9: two hundred bad calibration files, each refused with its field; the curve never gets wide."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from twin_rig import rig

from antennate.antenna.calibration import Calibration
from antennate.cli import main
from antennate.errors import AntennateError, CalibrationError, ConfigError
from antennate.hardware.config import RobotConfig
from antennate.hardware.esp32.wire import require_sensor
from antennate.params.control import ConditioningParams, ControlParams, RuleParams
from antennate.twin.config import TwinConfig

GOOD = Calibration(
    made_by="antennate 0",
    sensor_id="left-1",
    data_sha256="0" * 64,
    polarity=-1,
    slope=4.5,
    slope_95=(4.4, 4.6),
    midpoint=0.49,
    midpoint_95=(0.48, 0.50),
    counts_low=1616.0,
    counts_high=1874.0,
    threshold=0.5,
    valid_counts=(1616.0, 1874.0),
    valid_bend=(0.0, 1.0),
    samples=1000,
    trials=9,
    r2=0.97,
    rmse=0.05,
    speeds=(),
    cross_validated_rmse={"sigmoid": 0.05, "line": 0.06, "isotonic": 0.05},
    better_than_sigmoid=(),
)
CONTENT: dict[str, Any] = GOOD.model_dump(mode="json")
NUMBERS = [
    "slope",
    "midpoint",
    "counts_low",
    "counts_high",
    "threshold",
    "rmse",
    "r2",
    "samples",
    "trials",
    "polarity",
    "schema_version",
]
PAIRS = ["slope_95", "midpoint_95", "valid_counts", "valid_bend"]


def raw(field: str, value: str) -> str:
    """The good file with one value replaced by some text."""
    text = json.dumps(CONTENT | {field: "@"})
    return text.replace('"@"', value)


def _everywhere() -> Iterator[tuple[str, str, str]]:
    """Name, text and the field that is to be named."""
    for field in CONTENT:
        if field not in (
            "schema_version",
            "reach",
            "noise_counts",
            "kind",
            "knots",
            "knot_levels",
            "misfit",
        ):  # they have a default, like no other
            yield f"no {field}", json.dumps({k: v for k, v in CONTENT.items() if k != field}), field
        if field not in ("slope_95", "midpoint_95", "noise_counts", "misfit"):  # not always known
            yield f"null {field}", raw(field, "null"), field
        yield f"table {field}", raw(field, '{"a": 1}'), field
        again = f", {json.dumps(field)}: {json.dumps(CONTENT[field])}}}"
        yield f"twice {field}", json.dumps(CONTENT)[:-1] + again, field
    for field in NUMBERS:
        for value in ("NaN", "Infinity", "1e999", "-1e999", '"4.5"', "[4.5]"):
            yield f"{value} {field}", raw(field, value), field
    for field in PAIRS:
        for value in ("[1, NaN]", "[1e999, 2]", "[2, 1]", "[1]", "[1, 2, 3]", '"1, 2"'):
            yield f"{value} {field}", raw(field, value), field


def _one_by_one() -> Iterator[tuple[str, str, str]]:
    for field, values in {
        "slope": ["0", "-4.5", "1e9", "1001", "1e-320", "1000", "999.5", "500"],
        "midpoint": ["-1", "2", "-0.9", "1.9", "1e308"],
        "counts_low": ["-1", "4096"],
        "counts_high": ["1616", "1600", "0", "1617", "1635.5", "4096", "1e10"],
        "threshold": ["0", "1", "-0.5", "0.99", "0.01"],
        "samples": ["0", "19", "3.5"],
        "trials": ["0", "-1"],
        "polarity": ["0", "2", "-2", "true"],
        "schema_version": ["0", "2", "99", '"1"'],
        "sensor_id": ['""', '"../left"', '"a b"', '"' + "x" * 65 + '"', "7"],
        "data_sha256": ['""', '"' + "g" * 64 + '"'],
        "valid_counts": ["[-5, 1800]", "[1616, 5000]", "[1700, 1700]"],
    }.items():
        for value in values:
            flat = value in ("1e-320", "0.99", "0.01")  # the curve does not cross the threshold
            name = "midpoint" if flat else field
            yield f"{field} {value}", raw(field, value), name
    yield "swapped ends", json.dumps(CONTENT | {"counts_low": 1874, "counts_high": 1616}), "counts"
    yield "another key", json.dumps(CONTENT | {"limits": "off"}), "limits"


def _no_file() -> Iterator[tuple[str, str, str]]:
    text = json.dumps(CONTENT)
    for share in range(20):
        cut = len(text) * share // 20
        yield f"cut at {cut}", text[:cut], "the file"
    yield "deep list", "[" * 100_000, "the file"
    yield "deep table", '{"a":' * 5000 + "1" + "}" * 5000, "the file"
    yield "deep field", raw("speeds", "[" * 5000 + "]" * 5000), "the file"
    yield "10 MB", text + " " * 10_000_000, "at most 1000000 bytes"
    yield "binary", "\x00\x01\x02", "the file"
    yield "list", "[]", "the file"
    yield "number", "1", "the file"
    yield "two files", text + text, "the file"


FILES = [*_everywhere(), *_one_by_one(), *_no_file()]


def test_S9_there_are_two_hundred_bad_files_and_a_good_one(tmp_path: Path) -> None:
    assert len({text for _, text, _ in FILES}) >= 200
    path = tmp_path / "good.json"
    path.write_text(json.dumps(CONTENT))
    assert Calibration.load(path, "left-1") == GOOD


@pytest.mark.parametrize(("name", "text", "field"), FILES, ids=[name for name, _, _ in FILES])
def test_S9_a_bad_file_is_refused_with_field_and_reason(
    tmp_path: Path, name: str, text: str, field: str, refused: Callable[..., str]
) -> None:
    path = tmp_path / "left.json"
    path.write_text(text)
    with pytest.raises(CalibrationError) as refusal:
        Calibration.load(path)
    assert isinstance(refusal.value, AntennateError)
    said = str(refusal.value)
    assert said.startswith(f"{path}: ")
    assert field in said.removeprefix(f"{path}: ").split(": ")[0] or field in said
    words = ["drive", "--esp32", "/nowhere", "--bus", "/nothing", "--calibration", str(path)]
    told = refused(*words)
    assert field in told
    assert path.read_text() == text


def test_S9_the_file_of_another_sensor_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "left.json"
    GOOD.save(path)
    with pytest.raises(CalibrationError, match="sensor_id: expected right-1, found left-1"):
        Calibration.load(path, "right-1")


def test_S9_the_file_of_another_board_is_refused() -> None:
    require_sensor(rig(TwinConfig()).session.board.hello, "0" * 16)  # it has not greeted yet
    made = rig(TwinConfig())
    made.clock.sleep(0.1)
    made.session.board.poll(made.clock.now)
    twin = b"twin\0\0\0\0".hex()
    require_sensor(made.session.board.hello, twin)
    require_sensor(made.session.board.hello, "left-1")
    require_sensor(made.session.board.hello, None)
    with pytest.raises(CalibrationError, match=f"expected the board {'0' * 16} .* {twin}"):
        require_sensor(made.session.board.hello, "0" * 16)


def test_S9_a_bad_recording_keeps_the_calibration_that_is_there(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, bad = tmp_path / "out", tmp_path / "bad.csv"
    out.mkdir()
    GOOD.save(out / "calibration.json")
    bad.write_text("time,counts,bend\n")
    words = ["calibrate", "--recording", str(bad), "--out", str(out), "--overwrite"]
    assert main(words) == 2
    assert Calibration.load(out / "calibration.json") == GOOD
    assert capsys.readouterr().err.count("\n") == 1


def test_a_calibration_file_gives_the_controller_its_curve(tmp_path: Path) -> None:
    path = tmp_path / "left.json"
    GOOD.save(path)
    control = ControlParams(conditioning=ConditioningParams(averaging_time=0.05))
    config = RobotConfig(control=control, calibration=str(path), sensor_id="left-1")
    made = config.calibrated()
    assert made.sensor_id == GOOD.sensor_id
    assert made.control.conditioning == GOOD.conditioning(0.05)
    assert made.control.rule == control.rule


@pytest.mark.parametrize(
    ("control", "said"),
    [
        (ControlParams(conditioning=ConditioningParams(slope=9.0)), "no curve beside"),
        (ControlParams(rule=RuleParams(threshold=0.6)), "expected theta"),
    ],
)
def test_a_curve_or_a_theta_beside_the_file_is_refused(
    tmp_path: Path, control: ControlParams, said: str
) -> None:
    path = tmp_path / "left.json"
    GOOD.save(path)
    with pytest.raises(ConfigError, match=said):
        RobotConfig(control=control, calibration=str(path)).calibrated()
