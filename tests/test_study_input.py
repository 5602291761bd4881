# ruff: noqa: E501
"""Files of studies that cannot be run: one line says what, and nothing is written."""

from __future__ import annotations

from pathlib import Path

import pytest
from design_plans import refusal

from antennate.experiments.study import run as study
from antennate.experiments.study.config import StudyConfig
from antennate.params.base import read_file

CHOICES = "expected a list of values, or a table with low and high (names with dots need quotes)"
GOOD = '[vary]\n"tunnel.strewn" = [1]'


pytestmark = pytest.mark.usefixtures("there")


RANGES = """
{ low = "a", high = 3 } :: .range.low: expected a number, found 'a'
{ low = 1.0 } :: .range.high: expected a value, found none
{ low = 0.5, high = 0.4 } :: .range: expected low < high, found low 0.5 and high 0.4
{ low = nan, high = 0.5 } :: .range.low: expected a finite number, found nan
{ low = 0.4, high = inf } :: .range.high: expected a finite number, found inf
{ low = -1.0, high = 0.5, log = true } :: .range: expected 0 < low < high, found low -1 and high 0.5
{ low = 1.2, high = 1.8, whole = true } :: .range: expected whole ends, found low 1.2 and high 1.8
{ low = -1e308, high = 1e308 } :: .range: expected ends less far apart, found -1e+308 and 1e+308
{ low = 1, high = 2, hihg = 2 } :: .range.hihg: expected a known key
0.4 :: : CHOICES, found 0.4
"wide" :: : CHOICES, found 'wide'
true :: : CHOICES, found True
"""
BAD = f"""
[vary]; tunnel.free_width = [0.4] :: bad.toml: vary.tunnel: CHOICES, found {{'free_width': [0.4]}}
vary = [1, 2] :: bad.toml: vary: expected a table, found [1, 2]
settings = 3; GOOD :: bad.toml: settings: expected a table, found 3
 :: vary: expected values, found none: the grid is empty
GOOD; "tunnel.free_width" = [] :: vary.tunnel.free_width: expected values, found none: the grid is empty
DRAWN; "tunnel.free_widht" = [0.4] :: vary: tunnel: tunnel.free_widht: expected a known key of tunnel (did you mean free_width?), found 'free_widht'
DRAWN; "tunnel.free_width" = [0.4, nan] :: vary.tunnel.free_width: expected finite numbers, found nan
[vary]; "tunnel.free_width" = [0.4, -1.0] :: vary: tunnel: tunnel.free_width: expected a number above 0, found -1.0
[settings]; trails = 3; GOOD :: settings: tunnel: trails: expected a known key (did you mean trials?), found 'trails'
[settings]; tunnel = 3; GOOD :: settings.tunnel: expected a table, as tunnel.strewn varies, found 3
[settings]; controllers = ["clsoed"]; GOOD :: found 'clsoed' (did you mean closed?)
[vary]; controllers = [["clsoed"]] :: vary: tunnel: controllers: expected one of open
experiment = "tunel"; [vary]; x = [1] :: experiment: expected an experiment (did you mean tunnel?), one of antenna, calibrate
experiment = 3; GOOD :: bad.toml: experiment: expected text, found 3
plan = "gird"; GOOD :: bad.toml: plan: expected one of grid, list, random
trails = 3; GOOD :: trails: expected a known key (did you mean trials?)
[vary]; "tunnel.free_width" = {{ low = 0.4, high = 0.5 }} :: vary.tunnel.free_width: expected a list of values for a grid, found a range
assumed = 0.2 :: assumed: expected plan random, sobol or morris beside it, found grid
assumed = 0.2; plan = "morris"; leave_out = ["tunel"] :: leave_out: expected an assumed number or a group of them (did you mean tunnel?), found tunel
response = "tims_s"; GOOD :: response: expected a measure of tunnel (did you mean time_s?), one of success_share
[vary]; {"; ".join(f"{name} = {list(range(100))}" for name in "abcde")} :: vary: expected at most 100000 points, found 10000000000
trials = 20000; [vary]; "tunnel.strewn" = {list(range(100))} :: trials: expected at most 1000000 at all points, found 2000000
[vary]; "tunnel.strewn" = [1, 2, 1] :: vary.tunnel.strewn: expected each value once, found 1 twice
[vary]; x = [1.0, nan] :: vary.x: expected finite numbers, found nan
plan = "list"; [vary]; "tunnel.strewn" = [1, 1]; seed = [3, 3] :: vary: expected each point once, found [1, 3] twice
points = 8; GOOD :: points: expected plan random, sobol, morris or optuna beside it, found grid
seed = 8; GOOD :: seed: expected plan random, sobol, morris or optuna beside it, found grid
leave_out = ["robot"]; GOOD :: leave_out: expected assumed beside it, found none
trials = 2; [settings]; trials = 3; GOOD :: settings.trials: expected none beside trials = 2
trials = 2; [vary]; trials = [2, 3] :: vary.trials: expected none beside trials = 2
[settings.tunnel]; strewn = 3; GOOD :: settings.tunnel.strewn: expected a parameter that does not vary, found it in vary
plan = "morris"; assumed = 0.2; [settings.tunnel]; lining_gap = 0.03 :: settings.tunnel.lining_gap: expected a parameter that does not vary, found it in assumed; leave_out keeps its value
this is not toml :: bad.toml: expected TOML, found: Expected '=' after a key
experiment = "own.py:trial"; [vary]; x = [1, 2] :: add --experiment own.py:trial
[settings]; controllers = ["own.py:Mine"]; GOOD :: add --trust-code
"""
"""Lines of a file, and what is said of it."""
OWN = 'experiment = "own.py:trial"\n[vary]\nx = [1, 2]\n'
SHORT = {"GOOD": GOOD, "DRAWN": 'plan = "sobol"\n[vary]', "CHOICES": CHOICES}


def told(table: str) -> list[tuple[str, str]]:
    """The text of each file, and what is said of it, with what is short for more written out."""
    rows = [line.split(" :: ") for line in table[1:-1].split("\n")]
    for short, long in SHORT.items():
        rows = [[cell.replace(short, long) for cell in row] for row in rows]
    return [(text.replace("; ", "\n"), said) for text, said in rows]


@pytest.mark.parametrize(("axis", "expected"), told(RANGES))
def test_a_bad_range_is_named_as_it_stands_in_the_file(
    axis: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.toml").write_text(f'plan = "sobol"\n[vary]\n"tunnel.free_width" = {axis}\n')
    line = refusal(capsys, "study", "bad.toml")
    assert f"bad.toml: vary.tunnel.free_width{expected}" in line
    assert "tuple" not in line


@pytest.mark.parametrize(("text", "expected"), told(BAD))
def test_a_bad_study_is_one_line(
    text: str, expected: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("bad.toml").write_text(f"{text}\n")
    assert expected in refusal(capsys, "study", "bad.toml")
    assert not Path("runs").exists()


def test_an_experiment_may_be_named_as_its_command() -> None:
    assert StudyConfig(experiment="bench wall") == StudyConfig(experiment="wall")


def test_bad_words_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert "nobody.toml: expected a readable file: No such file" in refusal(
        capsys, "study", "nobody.toml"
    )
    Path("good.toml").write_text(GOOD)
    for shard in ("3/2", "0/2", "1/1000000", "1"):
        line = refusal(capsys, "study", "good.toml", "--shard", shard)
        assert f"--shard: expected I/N, I from 1 to N, N up to 999999, found {shard}" in line
    engine = refusal(capsys, "study", "good.toml", "--engine", "rya")
    assert "engine: expected one of local" in engine
    assert not Path("runs").exists()


@pytest.mark.ci
@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_measure_that_a_function_has_not_is_found_at_its_first_row(
    workers: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("own.py").write_text(
        "def trial(config, seed):\n    return {'value': config['x'], 'word': 'a'}\n"
    )
    Path("own.toml").write_text(f'response = "valeu"\ntrials = 3\n{OWN}')
    words = ["study", "own.toml", "--trust-code", "--workers", workers]
    assert "(did you mean value?), one of value; found valeu" in refusal(capsys, *words)


@pytest.mark.parametrize("name", ["point", "trial", "seed", "status", "reason", "", "a\\nb"])
def test_what_varies_for_a_function_has_a_name_of_its_own(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("own.py").write_text("def trial(config, seed):\n    return {'value': 1.0}\n")
    Path("bad.toml").write_text(f'experiment = "own.py:trial"\n[vary]\n"{name}" = [1, 2]\n')
    line = refusal(capsys, "study", "bad.toml", "--trust-code")
    assert ": expected another name, " in line


@pytest.mark.parametrize(
    "name", [pytest.param("assumptions", marks=pytest.mark.slow), "difficulty"]
)
def test_the_studies_of_the_tunnel_can_be_run(name: str) -> None:
    file = Path(__file__).parents[1] / "studies" / f"tunnel_{name}.toml"
    study.check(read_file(file, StudyConfig))


def test_a_sensor_of_another_kind_without_its_curve_is_refused_at_any_point(
    capsys: pytest.CaptureFixture[str],
) -> None:
    kinds = '"robot.antenna.sensor.kind" = ["flex", "fsr"]\n'
    Path("kinds.toml").write_text(f"[vary]\n{kinds}")
    assert "polarity must be 1 for a fsr sensor" in refusal(capsys, "study", "kinds.toml")
