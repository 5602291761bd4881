"""Standard streams that are full, closed or know ASCII alone: what was computed is kept."""

from __future__ import annotations

import io
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Sequence
from pathlib import Path

import pytest
from terminal import Terminal

from antennate.cli import main
from antennate.cli.results import print_table
from antennate.cli.terminal import Output
from antennate.control.readings import short_names
from antennate.experiments.tunnel.experiment import EXPERIMENT
from antennate.messages import extra
from antennate.studies.tables import Table

ROOT = Path(__file__).parents[1]
RUN = [sys.executable, "-m", "antennate", "antenna", "--out", "run"]
NO_FIGURES = ["--no-figures"]  # they take most of the time
SHELL = ["bash", "-c"]


def run(
    redirection: str, folder: Path, more: Sequence[str] = NO_FIGURES
) -> subprocess.CompletedProcess[str]:
    """`antennate antenna` with its streams redirected by a shell."""
    words = [*SHELL, f'"$@" {redirection}', "bash", *RUN, *more]
    return subprocess.run(
        words, cwd=folder, capture_output=True, text=True, timeout=120, check=False
    )


def is_whole(folder: Path) -> bool:
    """Whether the run left its result and its page."""
    found = folder / "run"
    assert json.loads((found / "result.json").read_text())["command"] == "antenna"
    return "</html>" in (found / "report.html").read_text()


@pytest.mark.ci
@pytest.mark.parametrize(
    ("redirection", "reason"),
    [("> /dev/full", "No space left on device"), (">&-", "it is closed")],
)
def test_an_output_that_cannot_be_written_costs_no_result(
    redirection: str, reason: str, tmp_path: Path
) -> None:
    done = run(redirection, tmp_path)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        "written to run",
        f"antennate antenna: error: standard output: expected to write, found: {reason}",
    ]
    assert is_whole(tmp_path)


@pytest.mark.ci
def test_a_reader_that_goes_early_is_no_error(tmp_path: Path) -> None:
    done = run('| head -1; exit "${PIPESTATUS[0]}"', tmp_path)
    assert done.returncode == 0
    assert done.stdout.count("\n") == 1
    assert "rror" not in done.stderr
    assert is_whole(tmp_path)


def test_a_table_for_an_output_that_knows_ascii_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    written = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(written, encoding="ascii"))
    assert main([*RUN[3:], *NO_FIGURES]) == 0
    assert "stiffness [N.mm/deg]" in written.getvalue().decode("ascii")
    assert is_whole(tmp_path)


@pytest.mark.ci
@pytest.mark.parametrize("redirection", ["2> /dev/full", "2>&- >&- <&-"])
def test_a_standard_error_that_cannot_be_written_costs_nothing(
    redirection: str, tmp_path: Path
) -> None:
    all_closed = ">&- <&-" in redirection
    done = run(redirection, tmp_path, [] if all_closed else NO_FIGURES)
    assert done.returncode == (2 if all_closed else 0)
    assert ("stiffness" in done.stdout) == (done.returncode == 0)
    assert is_whole(tmp_path)
    if all_closed:  # the files get the numbers of the streams
        assert (tmp_path / "run" / "figures" / "springs.svg").stat().st_size > 1000


@pytest.mark.ci
@pytest.mark.parametrize("command", [["--version"], ["--help"]])
def test_help_for_a_full_disk_is_an_error(command: list[str], tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        words = [sys.executable, "-m", "antennate", *command]
        done = subprocess.run(
            words, stdout=full, stderr=subprocess.PIPE, text=True, timeout=60, check=False
        )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1


@pytest.mark.ci
def test_a_terminal_of_twenty_columns(tmp_path: Path) -> None:
    """One process walks on both kinds, as it takes longer to start than to walk."""
    source = """if True:
        import os, sys
        from antennate.cli import main
        for term in ("xterm", "dumb"):
            os.environ["TERM"] = term
            if main(sys.argv[1:]):
                sys.exit(f"no walk on {term}")
    """
    words = ["gait", "--robot", "hexapod", "--gait.frequency", "1", "--cycles", "2"]
    words += ["--settling-cycles", "0", "--sweep-points", "2", "--no-figures", "--workers", "1"]
    words += ["--physics.timestep", "0.004", "--physics.contact-time", "0.008", "--rate", "50"]
    terminal = Terminal(20)
    command = [sys.executable, "-c", source, *words]
    process = terminal.start(command, {"NO_COLOR": "1"}, cwd=tmp_path)
    terminal.until(lambda _: False)
    assert process.wait(30) == 0
    assert "Traceback" not in terminal.text
    xterm, dumb, rest = re.split(r"written to runs/gait-[12]\r\n", terminal.text)
    assert "\x1b" in xterm
    assert dumb.startswith("gait: 1 of 7")
    assert "\x1b" not in dumb + rest


@pytest.mark.parametrize("columns", ["0", "-3", "²", "wide", ""])
def test_a_width_that_is_none_counts_as_not_given(
    columns: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    def printed() -> str:
        words = ["antenna", "--no-figures", "--out", str(tmp_path), "--overwrite"]
        assert main(words) == 0
        return capsys.readouterr().out

    monkeypatch.delenv("COLUMNS", raising=False)
    assert (plain := printed()).count("\n") > 5
    for name in ("COLUMNS", "LINES"):
        monkeypatch.setenv(name, columns)
    assert printed() == plain


def test_a_stream_that_was_closed_meanwhile_is_flushed_in_silence() -> None:
    file = io.StringIO()
    out = Output(file)
    out.write("text")
    file.close()
    out.flush()
    out.close()
    assert out.error is None


def test_a_column_of_a_controller_has_its_short_name(capsys: pytest.CaptureFixture[str]) -> None:
    names = ["far/away/controllers.py:Mine", "closed", "my.module:Other"]
    short = short_names(names)
    assert list(short) == names
    print_table(Table("Drive", list(short.values()), [("frames", ["1", "2", "3"])]))
    printed = capsys.readouterr().out
    assert ["Mine", "closed", "Other"] in [line.split() for line in printed.splitlines()]


def test_two_controllers_of_one_name_are_told_apart(capsys: pytest.CaptureFixture[str]) -> None:
    short = short_names(
        ["x/a.py:Mine", "x/b.py:Mine", "x/b.py:Other", "y/c.py:Last", "z/c.py:Last"]
    )
    wanted = ["a.py:Mine", "b.py:Mine", "Other", "y/c.py:Last", "z/c.py:Last"]
    assert list(short.values()) == wanted
    print_table(Table("Drive", wanted[:2], [("frames", ["1", "2"])]))
    assert ["a.py:", "b.py:"] in [line.split() for line in capsys.readouterr().out.splitlines()]


def test_readings_that_are_not_its_own_stay_with_the_short_name() -> None:
    names = [
        "closed@delayed:0.25",
        "closed@delayed:0.5",
        "far/a.py:Mine@yoked",
        "at@home/b.py:Mine",
    ]
    wanted = ["closed@delayed:0.25", "closed@delayed:0.5", "Mine@yoked", "Mine"]
    assert list(short_names(names).values()) == wanted


def test_a_policy_is_called_by_folder_or_file_and_a_long_name_is_cut_in_the_middle() -> None:
    names = ["entries/first/policy.onnx", "entries/second/policy.onnx", "/far/away/other.onnx"]
    assert list(short_names(names).values()) == ["first", "second", "other.onnx"]
    alike = ["a/run/policy.onnx", "b/run/policy.onnx", "policy.onnx"]
    assert list(short_names(alike).values()) == [*alike[:2], "policy.onnx"]
    assert short_names(["a/policy_with_a_rather_long_name.onnx", "closed"]) == {
        "a/policy_with_a_rather_long_name.onnx": "policy_wit…_name.onnx",
        "closed": "closed",
    }


def test_a_missing_extra_is_told_as_pip_and_uv_take_it() -> None:
    """docs/install.md says how extras are installed: the package is on no index."""
    pages = (ROOT / "docs" / "install.md").read_text()
    own, laboratory, parts, together = (
        tomllib.loads((folder / "pyproject.toml").read_text())["project"]["optional-dependencies"]
        for folder in (
            *(ROOT / "packages" / name for name in ("antennate", "antennate-lab")),
            *(ROOT / "packages" / "antennate-build", ROOT),
        )
    )
    assert together == {name: [f"antennate[{name}]"] for name in own} | {
        **{name: [f"antennate-lab[{name}]"] for name in laboratory},
        **{name: [f"antennate-build[{name}]"] for name in parts},
    }
    named = set()
    for file in sorted((ROOT / "packages" / "antennate" / "src").rglob("*.py")):
        text = file.read_text()
        assert not re.search(r"pip install '?antennate\[", text), file
        named |= set(re.findall(r"\{extra\([\"'](\w+)[\"']\)\}", text))
    assert {"view", "video", "hardware"} <= named <= set(own)
    uv, pip = re.findall(r"`([^`]*)`", extra("video"))
    assert uv.removesuffix(" ...") in pages
    assert pip in pages


def test_the_page_names_the_extras_that_the_locked_versions_leave_out() -> None:
    lock = (ROOT / "requirements.lock").read_text()
    locked = {name.lower() for name in re.findall(r"^([\w.-]+)==", lock, re.MULTILINE)}
    left_out = set()
    for name in ("antennate", "antennate-build", "antennate-lab"):
        project = tomllib.loads((ROOT / "packages" / name / "pyproject.toml").read_text())[
            "project"
        ]
        for extra_name, needed in project["optional-dependencies"].items():
            if not {re.split(r"[^\w.-]", each)[0] for each in needed} <= locked:
                left_out.add(extra_name)
    page = " ".join((ROOT / "docs" / "install.md").read_text().split())
    said = re.findall(r"It brings all extras but ((?:`\w+`(?:, | and )?)+), tests", page)
    assert set(re.findall(r"\w+", said[0])) - {"and"} == left_out


TALKS = """
import os

from antennate.control.controllers import open_loop

print("imported")
os.write(1, b"by the system\\n")


def Talks(control, robot, batch):
    print("made")
    return open_loop(control, robot, batch)
"""


@pytest.mark.ci
@pytest.mark.parametrize("workers", [pytest.param("1", marks=pytest.mark.slow), "2"])
def test_what_a_controller_prints_does_not_stand_beside_the_json(
    workers: str, tmp_path: Path
) -> None:
    """With `--json` it goes to standard error, from workers too; without, it stays where it was."""
    (tmp_path / "talks.py").write_text(TALKS)
    words = ["tunnel", "--controllers", "talks.py:Talks", "--trials", "2", "--time-limit", "0.1"]
    words += ["--workers", workers, "--no-figures"]
    command = [sys.executable, "-m", "antennate", *words]

    def run(*more: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [*command, *more], cwd=tmp_path, capture_output=True, text=True, timeout=120, check=True
        )

    done = run("--json", "--out", "one")
    assert json.loads(done.stdout) == json.loads((tmp_path / "one" / "result.json").read_text())
    for said in ("imported", "by the system"):
        assert said in done.stderr
    assert "imported" in run("--out", "two").stdout


def test_every_row_of_three_controllers_is_one_line_of_a_terminal_of_80_columns(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """200 trials of each, as docs/science keeps them; no cell can have more characters."""
    monkeypatch.setenv("COLUMNS", "80")
    result = json.loads((ROOT / "docs" / "science" / "evaluation.json").read_text())
    result["controllers"].pop("timed")
    for table in EXPERIMENT.tables(EXPERIMENT.read(result)):
        print_table(table)
        shown = [line.strip() for line in capsys.readouterr().out.splitlines()]
        at = next(i for i, line in enumerate(shown) if line.startswith("─"))
        body = shown[at + 1 : shown.index("", at)]
        assert [line.split("  ")[0] for line in body] == [name.strip() for name, _ in table.rows]


PAIRS = ["closed minus closed@yoked", "closed minus open", "closed@yoked minus open"]


@pytest.mark.parametrize(("columns", "parts"), [(45, 3), (60, 3), (80, 2), (110, 1)])
def test_a_table_is_printed_in_parts_where_its_columns_are_too_many(
    columns: int, parts: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(columns))
    cells = [f"-0.0{n}20m/s[-0.0{n}20,+0.0{n}20]" for n in range(3)]
    print_table(Table("Pairs", PAIRS, [("95 %", cells)], "A note."))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= columns
    rows = [line.split()[2:] for line in lines if line.startswith(" 95 %")]
    assert [cell for row in rows for cell in row] == cells
    assert len(rows) == parts
    assert lines.count("A note.") == 1


def test_a_dumb_terminal_is_as_wide_as_it_says(monkeypatch: pytest.MonkeyPatch) -> None:
    class Dumb(io.StringIO):
        def isatty(self) -> bool:
            return True

    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr("sys.stdout", Dumb())
    print_table(Table("Drive", ["robot"], [("frames", ["1"])], "word " * 30))
    lines = sys.stdout.getvalue().splitlines()
    assert 35 <= max(map(len, lines)) <= 40
