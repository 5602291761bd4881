"""The door: exit codes, errors in one line, and what a run leaves behind."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import numpy as np
import pytest

import antennate
from antennate import experiments
from antennate.cli import commands, main
from antennate.cli.arguments import FromFile, parse
from antennate.errors import ConfigError
from antennate.experiments.tunnel.physics import TunnelConfig
from antennate.messages import one_line
from antennate.params.base import read_file
from antennate.sim.world import World
from antennate.studies.formats import strict, to_csv, to_toml
from antennate.twin.config import TwinConfig

SMALL = ["tunnel", "--trials", "1", "--controllers", "open", "--time-limit", "1", "--workers", "1"]
QUICK = [*SMALL, "--no-figures"]


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")


def table(run: Path) -> list[dict[str, str]]:
    """The rows of trials.csv."""
    with (run / "trials.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def child(code: str, *argv: str, **options) -> subprocess.Popen:
    """A Python of its own that finds this package."""
    source = str(Path(antennate.__file__).resolve().parents[1])
    words = [sys.executable, "-c", code, *argv]
    environment = {**os.environ, "PYTHONPATH": source}
    return subprocess.Popen(words, env=environment, text=True, **options)


def test_version_and_help(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"antennate {antennate.__version__}\n"
    assert main(["--help"]) == 0
    shown = capsys.readouterr().out
    assert max(map(len, shown.splitlines())) <= 80
    first, *sections = (part.splitlines() for part in shown.split("\n\n")[2:-1])
    assert [line.split()[0] for line in first[1:]] == [
        "tunnel",
        "calibrate",
        "study",
        "twin",
        "drive",
    ]
    listed = [line.split()[0] for lines in sections for line in lines[1:] if line[2] != " "]
    assert len(listed) == 24
    assert set(listed) >= {name.split()[0] for name in commands()}


def test_a_group_lists_its_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--help"]) == 0
    page = capsys.readouterr().out
    assert [line.split()[1] for line in page.split("\n\n")[2].splitlines()] == [
        *("wall", "touch", "sweep", "force")
    ]
    assert main(["bench"]) == 2
    assert capsys.readouterr() == (
        page,
        "antennate bench: error: expected a command, found none\n",
    )
    assert main(["setup", "--help"]) == 0
    assert "`antennate setup zero`, `antennate setup jog`" in capsys.readouterr().out


@pytest.mark.smoke
def test_python_runs_the_package_as_the_command():
    words = [sys.executable, "-m", "antennate", "--version"]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout == f"antennate {antennate.__version__}\n"


@pytest.mark.parametrize("command", sorted(commands()))
def test_help_fits_two_screens_and_help_all_shows_every_flag(capsys, command):
    assert main([*command.split(), "--help"]) == 0
    short = capsys.readouterr().out.splitlines()
    assert len(short) <= 2 * 24
    assert max(map(len, short)) <= 80
    assert main([*command.split(), "--help-all"]) == 0
    whole = capsys.readouterr().out
    assert max(map(len, whole.splitlines())) <= 80
    flags = set(re.findall(r"^  (--[a-z0-9-]+)(?!\S)", "\n".join(short), re.MULTILINE))
    assert ("--config" in flags) == (
        command
        not in ("report", "study merge", "study", "antenna", "build", "log view", "parameters")
    ), "these have no parameters, or take the file without a flag"
    assert flags <= set(re.findall(r"^  (--[a-z0-9-]+)(?!\S)", whole, re.MULTILINE))


@pytest.mark.parametrize(
    ("command", "words"),
    [("antenna", "[FILE]"), ("build", "[FILE]"), ("robot", "[NAME|FILE]"), ("study", "FILE")],
)
def test_the_usage_has_what_may_be_left_out_in_brackets(capsys, command, words):
    assert main([command, "--help"]) == 0
    assert capsys.readouterr().out.startswith(f"usage: antennate {command} {words} [OPTIONS]\n")


@pytest.mark.parametrize(
    ("command", "flags"),
    [
        ("tunnel", "--trials --seed --controllers --scene --robot --time-limit --out --workers"),
        ("drive", "--robot --controller --calibration --duration --esp32 --bus --arm --until"),
        ("bench wall", "--trials --seed --profiles --out"),
    ],
)
def test_the_short_help_shows_what_the_command_is_about(capsys, monkeypatch, command, flags):
    """Also on a narrow terminal, where there is no room for everything."""
    monkeypatch.setenv("COLUMNS", "80")
    assert main([*command.split(), "--help"]) == 0
    found = re.findall(r"^  (--[a-z0-9-]+)", capsys.readouterr().out, re.MULTILINE)
    assert set(flags.split()) <= set(found)


def test_help_shows_unit_default_range_and_choices(capsys):
    assert main(["tunnel", "--help-all"]) == 0
    text = " ".join(capsys.readouterr().out.split())
    width = "--tunnel.free-width FLOAT widest free width between the linings [m]; above 0"
    assert f"{width}, at most 100 (default: 0.4)" in text
    assert "--tunnel.mirror {random,never,always}" in text
    assert re.search(r"--trials INT .*?; 1 to 100000 \(default:", text)
    assert text.count("(default:") > 80
    for name in ("--control.gait.frequency", "--robot.antenna.length", "--seed", "--out"):
        assert f"{name} " in text


def test_help_of_a_study_names_what_an_option_takes_and_every_plan(capsys):
    assert main(["study", "--help"]) == 0
    page = capsys.readouterr().out
    assert "--assumed FLOAT" in page
    first = page.split("\n\n")[1].lower()
    assert all(plan in first for plan in ("grid", "list", "random", "sobol", "morris"))


@pytest.mark.ci
def test_the_door_opens_without_heavy_imports():
    code = (
        "import sys, antennate.cli as c; c.main(['--help']); "
        "heavy = {'mujoco', 'matplotlib', 'scipy', 'numpy', 'pydantic', 'rich'}; "
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)"
    )
    door = child(code, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    _, err = door.communicate(timeout=60)
    assert door.returncode == 0, err


_HEAVY = ("scipy", "matplotlib", "rich", "pandas", "pyarrow", "serial")
_SIMULATED = tuple(f"antennate.params.{name}" for name in ("bench", "spring"))
"""Groups of numbers that no command of the real robot has."""


_REAL = ("mujoco", *_SIMULATED)
_REFUSED = [
    (["nonsense"], ("numpy", "antennate.params.control", *_REAL)),
    (["drive", "--nonsense"], _REAL),
    (["drive", "--esp32=/nowhere", "--bus=/nowhere2", "--robot=nobody"], _REAL),
    (["drive", "teleop", "--config=/nowhere.toml"], _REAL),
    (["doctor", "--doctor.silence=x"], _REAL),
    (["setup", "jog", "--joint=nobody", "--bus=/nowhere"], _REAL),
    (["setup", "zero", "--config=/nowhere.toml"], _REAL),
    (["setup", "--nonsense"], _REAL),
    (["record", "--marks", "x"], _REAL),
    (["log", "replay", "/nowhere"], _REAL),
    (["log", "info", "/nowhere"], _REAL),
    (["twin", "--servos=1:nothing"], _SIMULATED),
    (["tunnel", "--trials=x"], _SIMULATED),
    (["bench", "touch", "--nonsense"], _SIMULATED[1:]),
]
"""Words, and what neither they nor those above them need."""


@pytest.mark.ci
def test_a_refusal_imports_nothing_that_it_does_not_need() -> None:
    """One process for all of them, and what it has imported after each."""
    script = """if True:
        import json, sys, antennate.cli as c
        for words in json.loads(sys.argv[1]):
            code = c.main(words)
            print(json.dumps([code, *sys.modules]))"""
    words = json.dumps([words for words, _ in _REFUSED])
    process = child(script, words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    out, err = process.communicate(timeout=60)
    assert len(err.splitlines()) == len(_REFUSED), err
    for (said, unneeded), line in zip(_REFUSED, out.splitlines(), strict=True):
        code, *loaded = json.loads(line)
        assert code == 2, said
        assert not {*_HEAVY, *unneeded} & set(loaded), said


@pytest.mark.parametrize("words", ["scuttle --robot hexapod", "--robot hexapod scuttle"])
def test_a_robot_given_in_two_ways_is_refused(words: str, refused) -> None:
    line = refused("robot", *words.split())
    assert "--robot: expected it once, found also NAME|FILE without" in line


@pytest.mark.parametrize("flag", ["--log", "--readings", "--video", "--view"])
def test_a_flag_of_other_commands_is_refused_with_their_names(flag: str, capsys, refused) -> None:
    line = refused("geometry", flag)
    assert f"expected a flag of this command, found {flag}; " in line
    told = line.partition(f"{flag}; ")[2].partition(" take it;")[0]
    having = set()
    for name in commands():
        assert main([*name.split(), "--help-all"]) == 0
        having |= (
            {name} if re.search(rf"^  {flag}\b(?!-)", capsys.readouterr().out, re.M) else set()
        )
    assert set(re.split(", | and ", told)) == having


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            "[tunnel]\nfree_widht = 0.5",
            [
                "c.toml: tunnel.free_widht: expected a known key of tunnel",
                "did you mean free_width?",
            ],
        ),
        ("trials = 3\ntrials = 4", ["c.toml: expected TOML, found: Cannot overwrite a value"]),
        ("trials = = 3", ["c.toml: expected TOML", "line 1"]),
        ("trials = '3'", ["c.toml: trials: expected a whole number, found '3'"]),
        ("trials = 3.0", ["c.toml: trials: expected a whole number, found 3.0"]),
        ("trials = true", ["c.toml: trials: expected a whole number, found True"]),
        ("tunnel.free_width = -1", ["c.toml: tunnel.free_width: expected a number above 0"]),
        ("tunnel.free_width = nan", ["tunnel.free_width: expected a finite number, found nan"]),
        ("tunnel.free_width = 1e999", ["tunnel.free_width: expected a finite number, found inf"]),
        ("tunnel.free_width = 1979-05-27", ["tunnel.free_width: expected a number"]),
        ("tunnel = 3", ["tunnel: expected a table, found 3"]),
        ("tunnel.segments = [1.0, 'x']", ["tunnel.segments[1]: expected a number, found 'x'"]),
        ("controllers = []", ["controllers: expected at least 1 value, found []"]),
        ("tunnel.turns_deg = [" + 20 * "1.0," + "]", ["expected at most 19 values, found"]),
        ("tunnel.turns_deg = [" + 200 * "1.0," + "]", ["expected at most 19 values, found"]),
        ("arms = ['open']", ["expected a known key (did you mean controllers?), found 'arms'"]),
        ("robot.antenna.active_coils = []", ["active_coils: expected at least 1 value"]),
        ('"a\\u001b[31m\\nb" = 1', ["expected a known key"]),
        ("a = " + "[" * 200_000, ["nested too deeply"]),
        ("seed = " + "9" * 5000, ["c.toml: expected numbers of at most 4300 digits, found more"]),
        ("seed = 0x" + "f" * 5000, ["c.toml: expected numbers of at most 4300 digits"]),
        ("a." * 400_000 + "a = 1", ["line 1: expected at most 100 dots in a key"]),
        ('"a".' * 200_000 + "a = 1", ["line 1: expected at most 100 dots in a key"]),
        ("#" * 1_000_001, ["expected at most 1000000 bytes"]),
        (b"\xff\xfe", ["expected UTF-8 text, found byte 0xff at 0"]),
    ],
)
def test_bad_files(refused, tmp_path, text, parts):
    (tmp_path / "c.toml").write_bytes(text if isinstance(text, bytes) else text.encode())
    start = time.monotonic()
    line = refused("tunnel", "--config", "c.toml").rstrip()
    assert time.monotonic() - start < 2.0
    for part in parts:
        assert part in line
    assert line.isprintable()


def test_a_list_may_be_given_at_once_or_piece_by_piece():
    words = ["--fault", "esp32=reset", "bus=loss:0.1@2s", "--touch=left@1s", "--trial", "3"]
    words += ["--fault=servo:7=silent", "--touch", "right@2s"]
    config, _ = parse("twin", "", TwinConfig, words, FromFile)
    assert config.fault == ("esp32=reset", "bus=loss:0.1@2s", "servo:7=silent")
    assert config.touch == ("left@1s", "right@2s")
    assert config.trial == 3


def test_negative_numbers_and_none_are_values():
    words = ["--tunnel.turns-deg", "90", "-60", "-1e1", "--tunnel.segments=1", "1", "1", "1"]
    config, _ = parse("tunnel", "", TunnelConfig, words, FromFile)
    assert config.tunnel.turns_deg == (90.0, -60.0, -10.0)
    config, _ = parse("twin", "", TwinConfig, ["--duration", "none"], FromFile)
    assert config.duration is None


def test_bad_folders(refused, tmp_path):
    (tmp_path / "file").write_text("mine")
    for words in ((), ("--overwrite",)):
        line = refused(*QUICK, "--out", "file", *words)
        assert "expected to write file, found: File exists" in line
    (tmp_path / "link").symlink_to("nowhere")
    line = refused(*QUICK, "--out", "link", "--overwrite")
    assert "expected to write link, found: File exists" in line
    assert "Not a directory" in refused(*QUICK, "--out", "file/sub")
    assert (tmp_path / "file").read_text() == "mine"
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "config.toml").write_text("trials = 1\n")
    line = refused(*QUICK, "--out", "mine")
    assert "mine: expected no file config.toml but of this run" in line
    assert [p.name for p in (tmp_path / "mine").iterdir()] == ["config.toml"]


@pytest.mark.parametrize(
    "words",
    [
        ("antenna",),
        ("tracks", "--no-figures"),
        ("study", "a.toml"),
        ("doctor",),
    ],
)
def test_a_path_that_is_too_long_is_one_line(refused, tmp_path, words):
    """A name has at most 255 bytes (POSIX NAME_MAX of Linux)."""
    (tmp_path / "a.toml").write_text('experiment = "antenna"\n')
    assert refused(*words, "--out", "a" * 300)


@pytest.mark.parametrize("words", [("--out", "bad\udcff"), ("--out=bad\udcff",)])
def test_a_folder_whose_name_is_no_text_is_one_line_and_is_not_made(refused, tmp_path, words):
    """The shell's `$'bad\\xff'` comes as a lone surrogate (PEP 383), which UTF-8 cannot write."""
    line = refused("antenna", *words)
    assert "--out: expected text in UTF-8, found " in line
    assert not list(tmp_path.iterdir())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission(refused, tmp_path):
    (tmp_path / "closed").mkdir(mode=0o500)
    assert "Permission denied" in refused(*QUICK, "--out", "closed")


def test_a_full_disk_is_one_line_and_keeps_what_was_there(capsys, refused, tmp_path, monkeypatch):
    assert main([*QUICK, "--out", "run"]) == 0
    capsys.readouterr()
    before = (tmp_path / "run" / "result.json").read_bytes()

    def full(*args):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    assert "No space left on device" in refused(*QUICK, "--out", "other")
    assert not (tmp_path / "other").exists()
    assert (tmp_path / "run" / "result.json").read_bytes() == before


def test_no_memory_is_one_line(refused, monkeypatch):
    def none(*args):
        raise MemoryError

    monkeypatch.setattr(os, "fsync", none)
    assert refused(*QUICK, "--out", "run").endswith(
        "error: expected more memory, found none left\n"
    )


def test_a_run_leaves_a_folder_that_explains_itself(capsys, tmp_path):
    assert main([*SMALL, "--seed", "5", "--out", "deep/run"]) == 0
    out, err = capsys.readouterr()
    assert err.endswith("written to deep/run\n")
    assert "1 trial a controller, seed 5" in out
    assert "A failure counts as the time limit, 1 s" in out
    _, *shown = out.splitlines()  # the sentence wraps as the terminal does
    assert max(map(len, shown)) <= 100
    run = tmp_path / "deep" / "run"
    assert sorted(str(p.relative_to(run)) for p in run.rglob("*.*")) == [
        "command.txt",
        "config.toml",
        "figures/summary.png",
        "figures/summary.svg",
        "figures/trajectories.png",
        "figures/trajectories.svg",
        "files.txt",
        "report.html",
        "result.json",
        "trials.csv",
        "trials.jsonl",
        "versions.json",
    ]
    command, *dates = (run / "command.txt").read_text().splitlines()
    assert command == f"antennate {' '.join(SMALL)} --seed 5 --out deep/run"
    assert [line.split()[:2] for line in dates] == [["#", "begun"], ["#", "ended"]]
    versions = json.loads((run / "versions.json").read_text())
    assert versions["antennate"] == antennate.__version__
    assert versions["numpy"] == np.__version__
    [row] = table(run)
    assert (row["controller"], row["trial"], row["outcome"], row["time_s"]) == (
        "open",
        "0",
        "timeout",
        "1.0",
    )


def test_default_folders_are_numbered(capsys, tmp_path):
    for n in (1, 2):
        assert main(QUICK) == 0
        assert capsys.readouterr().err.endswith(f"written to runs/tunnel-{n}\n")
    assert sorted(p.name for p in (tmp_path / "runs").iterdir()) == ["tunnel-1", "tunnel-2"]


def test_json_is_strict_and_keeps_its_contract(capsys, tmp_path):
    def refuse(name):
        raise AssertionError(f"{name} is no JSON")

    assert main([*QUICK, "--controllers", "closed", "--json", "--out", "run"]) == 0
    text = capsys.readouterr().out
    assert text == (tmp_path / "run" / "result.json").read_text()
    result = json.loads(text, parse_constant=refuse)
    assert (result["schema"], result["command"], result["seed"]) == (2, "tunnel", 0)
    assert result["interrupted"] is False
    assert list(result["controllers"]) == ["open", "closed"]
    assert {
        "trials",
        "successes",
        "timeouts",
        "left",
        "invalid",
        "wilson95",
        "speed_m_s",
        "time_over_successes_s",
        "progress_per_time_m_s",
        "restricted_mean_time_s",
        "restricted_mean_time_95",
        "stuck",
        "recovered",
        "share",
        "force_mean_n",
        "force_max_n",
    } <= result["controllers"]["open"].keys()
    assert result["controllers"]["open"]["speed_m_s"] is None  # nobody gets out within a second
    assert list(result["paired"]) == ["open-closed"]
    assert {"trials", "only_first", "only_second", "mcnemar_p", "wilcoxon_p"} <= result["paired"][
        "open-closed"
    ].keys()


@pytest.mark.parametrize("name", experiments.names())
def test_config_survives_the_round_trip(tmp_path, name):
    config = experiments.load(name).config()
    path = tmp_path / "c.toml"
    path.write_text(to_toml(config), encoding="utf-8")
    assert read_file(path, type(config)) == config
    assert tomllib.loads(to_toml(config)) == json.loads(config.model_dump_json(exclude_none=True))


def test_flags_override_the_file_and_the_run_says_so(capsys, tmp_path):
    (tmp_path / "c.toml").write_text("seed = 3\ntime_limit = 1\n[tunnel]\nturns_deg = [60.0]\n")
    words = ["--config", "c.toml", "--seed", "4", "--out", "run", "--tunnel.mirror", "never"]
    words += ["--controllers", "open", "--trials", "1"]
    assert main(["tunnel", *words, "--no-figures", "--workers", "1"]) == 0
    config = read_file(tmp_path / "run" / "config.toml", TunnelConfig)
    assert (config.seed, config.time_limit, config.trials) == (4, 1.0, 1)
    assert (config.tunnel.turns_deg, config.tunnel.mirror) == ((60.0,), "never")
    words = ["--config", "run/config.toml", "--out", "again", "--no-figures", "--workers", "1"]
    assert main(["tunnel", *words]) == 0
    for name in ("result.json", "trials.csv", "config.toml"):
        ours, theirs = (tmp_path / run / name for run in ("run", "again"))
        assert ours.read_bytes() == theirs.read_bytes()


def test_an_unfinished_run_is_not_overwritten(refused, tmp_path):
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "trials.jsonl").write_text("{}\n")
    assert "trials.jsonl" in refused(*QUICK, "--out", "run")


def test_an_invalid_trial_is_a_row_and_no_success(capsys, tmp_path, monkeypatch):
    sound = World.advance

    def blow_up(self, count):
        if self.t > 0.5:
            self.data.qvel[:] = 1e12
        sound(self, count)

    monkeypatch.setattr(World, "advance", blow_up)
    assert main([*QUICK, "--trials", "2", "--out", "run"]) == 2
    first = capsys.readouterr().out.splitlines()[0]
    assert first.startswith("No trial of open is valid: simulation invalid at physics step")
    open_ = json.loads((tmp_path / "run" / "result.json").read_text())["controllers"]["open"]
    assert (open_["trials"], open_["invalid"], open_["successes"]) == (2, 2, 0)
    assert open_["restricted_mean_time_s"] is None
    rows = table(tmp_path / "run")
    assert [row["outcome"] for row in rows] == ["invalid", "invalid"]
    assert all("physics step" in row["reason"] for row in rows)


def test_interrupted_in_the_middle_keeps_the_finished_trials(capsys, tmp_path, monkeypatch):
    from antennate.studies.run_directory import RunDirectory

    kept = RunDirectory.append
    seen = []

    def append(self, row):
        kept(self, row)
        seen.append(row.trial)
        if len(seen) == 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(RunDirectory, "append", append)
    assert main([*QUICK, "--trials", "30", "--out", "run"]) == 130
    out, err = capsys.readouterr()
    assert "interrupted: kept 2 trials" in err
    assert "trials" in out
    rows = table(tmp_path / "run")
    assert sorted(int(row["trial"]) for row in rows) == sorted(seen)
    names = (tmp_path / "run" / "files.txt").read_text().splitlines()[1:]
    assert "trials.jsonl" in names
    assert all((tmp_path / "run" / name).exists() for name in names)
    assert json.loads((tmp_path / "run" / "result.json").read_text())["interrupted"] is True


@pytest.mark.ci
def test_gait_runs_and_writes_its_result(capsys, tmp_path):
    words = ["gait", "--cycles", "2", "--settling-cycles", "0", "--sweep-points", "2"]
    words += ["--gait.frequency", "0.8"]  # a short cycle
    assert main([*words, "--workers", "1", "--out", "run"]) == 0
    assert "lead of 200 deg" in capsys.readouterr().out
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert (result["schema"], result["command"]) == (1, "gait")
    assert list(result["maneuvers"]) == ["forward", "turn_l", "turn_r", "reverse"]
    assert sorted(p.name for p in (tmp_path / "run" / "figures").iterdir()) == [
        "gait.png",
        "gait.svg",
    ]


def test_table_cells_cannot_become_formulas_and_numbers_stay_numbers():
    rows = [{"name": text, "x": -1.5} for text in ("=1+1", "+1", "-1", "@a", "a\x1b[2Jb\r\n", "ok")]
    lines = to_csv(rows).splitlines()
    assert lines[0] == "name,x"
    assert [line.split(",")[0] for line in lines[1:]] == [
        "'=1+1",
        "'+1",
        "'-1",
        "'@a",
        "a [2Jb ",
        "ok",
    ]
    assert all(line.endswith(",-1.5") for line in lines[1:])


def test_strict_json_has_no_nan():
    value = {"a": (1.0, float("nan")), "b": [float("inf"), {"c": -float("inf")}], "d": "nan"}
    assert strict(value) == {"a": [1.0, None], "b": [None, {"c": None}], "d": "nan"}


def test_messages_hold_no_control_characters():
    assert one_line("a\x1b[31m\n b\x00\x9bc") == "a [31m b c"


def test_reading_stops_at_the_limit():
    if not Path("/dev/zero").exists():
        pytest.skip("needs /dev/zero")
    with pytest.raises(ConfigError, match="a pipe or a device"):
        read_file(Path("/dev/zero"), TunnelConfig)


@pytest.mark.parametrize(("uv", "said"), [("/bin/uv", "uv run antennate"), ("", "antennate")])
def test_hints_are_typed_as_the_program_was_called(
    uv: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("UV", uv)
    assert main(["setup", "zero"]) == 2
    assert f"found none; `{said} setup` finds it" in capsys.readouterr().err


@pytest.mark.parametrize(
    "words", [["drive"], ["drive", "teleop"], ["record", "--marks", "0", "1"], ["doctor"]]
)
def test_a_robot_file_in_this_folder_is_read_where_no_port_is_named(
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    hint = "; robot.toml is here, without --no-config its ports are taken"
    monkeypatch.setenv("UV", "/bin/uv")
    assert main(words) == 2
    said = capsys.readouterr().err
    assert "; `uv run antennate setup` finds it, `uv run antennate twin` simulates a robot" in said
    assert hint not in said
    (tmp_path / "robot.toml").write_text('[ports]\nesp32 = "no-board"\nbus = "no-bus"\n')
    assert main(words) == 2
    first, *said = capsys.readouterr().err.splitlines()
    assert first == "robot.toml of this folder is read; --no-config leaves it"
    assert not [line for line in said if "--esp32: expected a serial port, found none" in line]
    assert main([*words, "--no-config"]) == 2
    (said,) = capsys.readouterr().err.splitlines()
    assert "found none" in said
    assert hint in said


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_signal_ends_the_run_and_keeps_its_trials(tmp_path, number, workers):
    code = (
        "import signal, sys; from antennate.cli import main; "
        "signal.signal(signal.SIGINT, signal.default_int_handler); sys.exit(main(sys.argv[1:]))"
    )
    words = ["tunnel", "--trials", "5000", "--out", "run", "--no-figures", "--workers", workers]
    trials = tmp_path / "run" / "trials.jsonl"
    with child(code, *words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as run:
        try:
            deadline = time.monotonic() + 60
            while not (trials.exists() and trials.read_text().count('"key":') >= 2):
                assert time.monotonic() < deadline
                time.sleep(0.2)
            run.send_signal(number)
            _, err = run.communicate(timeout=30)
        finally:
            run.kill()
    assert run.returncode == 130
    assert "Traceback" not in err
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["interrupted"] is True
    rows = table(tmp_path / "run")
    assert len(rows) == sum(open_["trials"] for open_ in result["controllers"].values()) >= 2
