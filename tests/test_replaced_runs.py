"""A run that replaces another one: the old one goes once the new one has something to keep."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor
from pathlib import Path

import pytest

import antennate
from antennate.cli import main
from antennate.errors import ConfigError, OutputError, WorkerError
from antennate.studies.run_directory import RunDirectory

WALL = ["wall", "--trials", "2", "--profiles", "descending", "--workers", "1", "--no-figures"]
SLOW = """
import os, time
def trial(config, seed):
    if seed >= int(os.environ["FREE"]):
        open("begun", "w").close()
        time.sleep(600)
    return {"value": config["x"]}
"""


@pytest.fixture(scope="module")
def _run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of walls with logs, which is finished."""
    place = tmp_path_factory.mktemp("replaced") / "run"
    assert main([*WALL, "--out", str(place)]) == 0
    (place / "logs").mkdir()
    (place / "logs" / "descending-0.mcap").write_bytes(b"a log")
    listed(place, "logs/descending-0.mcap")
    return place


@pytest.fixture(autouse=True)
def _there(_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(_run, tmp_path / "run")
    monkeypatch.chdir(tmp_path)


def files(place: str = "run") -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in Path(place).rglob("*") if path.is_file()}


def listed(place: Path, *names: str) -> None:
    """Let the run of a folder be the one that wrote these files."""
    with (place / "files.txt").open("a") as file:
        file.writelines(f"{name}\n" for name in names)


def program(*words: str, **environment: str) -> subprocess.Popen[bytes]:
    source = str(Path(antennate.__file__).parents[1])
    known = {**os.environ, "PYTHONPATH": source, **environment}
    return subprocess.Popen([sys.executable, "-m", "antennate", *words], env=known)


def killed_once(there: Path, process: subprocess.Popen[bytes]) -> None:
    """Kill a process and all its workers once there is a file."""
    end = time.monotonic() + 120
    while not there.exists():
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.02)
    process.send_signal(signal.SIGKILL)
    process.wait(60)


@pytest.mark.parametrize("more", [[], ["--log"]])
def test_an_engine_that_is_not_there_costs_no_old_run(
    more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    if more:
        pytest.importorskip("distributed")
    before = files()
    words = ["tunnel", "--trials", "1", "--out", "run", "--overwrite", *more]
    assert main([*words, "--engine", "dask://127.0.0.1:1"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
    assert files() == before


def test_python_keeps_the_old_run_where_an_engine_takes_nothing() -> None:
    class Refusing(Executor):
        def submit(self, *_: object, **__: object) -> None:  # type: ignore[override]
            raise WorkerError("no room")

    before = files()
    for _ in range(2):
        with pytest.raises(WorkerError, match="no room"):
            antennate.run("wall", trials=1, out="run", overwrite=True, engine=Refusing())
        assert files() == before


def test_a_drive_that_finds_no_robot_costs_no_old_run(capsys: pytest.CaptureFixture[str]) -> None:
    before = files()
    words = ["drive", "--esp32", "/dev/no-board", "--bus", "/dev/no-bus"]
    assert main([*words, "--out", "run", "--overwrite"]) == 2
    assert "Traceback" not in capsys.readouterr().err
    assert files() == before


def test_a_run_that_replaces_another_leaves_nothing_of_it() -> None:
    assert main(["springs", "--no-figures", "--out", "run", "--overwrite"]) == 0
    assert main(["springs", "--no-figures", "--out", "other"]) == 0
    assert {path.name for path in files()} == {path.name for path in files("other")}


def test_a_run_without_a_result_takes_the_place_of_none() -> None:
    before = files()
    with RunDirectory.create("robot", "run", overwrite=True) as run:
        run.write("bom.csv", "part,count\n")
    assert files() == before


def test_no_second_process_replaces_a_run_meanwhile() -> None:
    with RunDirectory.create("springs", "run", overwrite=True):
        for _ in range(2):
            with pytest.raises(OutputError, match="found another process at it"):
                RunDirectory.create("springs", "run", overwrite=True)


def slow_study(free: int) -> subprocess.Popen[bytes]:
    """A study whose trials from a seed on do not end, in place of the run."""
    Path("code.py").write_text(SLOW)
    Path("plan.toml").write_text(
        'experiment = "code.py:trial"\nplan = "grid"\ntrials = 3\n[vary]\nx = [0.5]\n'
    )
    words = ["study", "plan.toml", "--trust-code", "--out", "run", "--overwrite"]
    return program(*words, "--workers", "1", "--no-figures", FREE=str(free))


def test_killed_before_its_first_trial_the_old_run_is_there_again(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """For each command that is given its folder."""
    before = files()
    killed_once(Path("begun"), slow_study(free=0))
    shutil.copytree("run", "killed")
    assert RunDirectory.open("run").rows()
    assert files() == before
    for words in (["log", "info"], ["replay"], ["view"]):
        shutil.rmtree("run")
        shutil.copytree("killed", "run")
        assert main([*words, "run"]) == 2  # what this run has is none that can be read
        assert "run/logs/descending-0.mcap" in capsys.readouterr().err
        assert files() == before


def test_the_log_of_a_killed_first_trial_is_read_and_not_removed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The old run is there again for the next command that takes the folder."""
    before = files()
    killed_once(Path("begun"), slow_study(free=0))
    new = Path("run/logs/open-0.mcap")
    new.parent.mkdir(exist_ok=True)
    new.write_bytes(b"a log that was begun")
    listed(Path("run"), "logs/open-0.mcap")
    for words in (["log", "info"], ["log", "recover"], ["replay"], ["view"]):
        assert main([*words, "run"]) == 2  # it is no whole log
        assert "run/logs/open-0.mcap" in capsys.readouterr().err
        assert new.read_bytes() == b"a log that was begun"
    assert RunDirectory.open("run").rows()
    assert files() == before


def test_killed_after_its_first_trial_the_new_run_goes_on() -> None:
    killed_once(Path("begun"), slow_study(free=1))
    process = program(
        *["study", "plan.toml", "--trust-code", "--out", "run", "--workers", "1", "--no-figures"],
        FREE="9",
    )
    assert process.wait(120) == 0
    assert len(RunDirectory.open("run").rows()) == 3
    assert not list(Path("run").rglob(".*"))
    assert not Path("run/logs/descending-0.mcap").exists()


KILLED = """
import os, signal, sys
from antennate.cli import main
left = int(sys.argv[1])
def watch(name, arguments):
    global left
    if name == "open" and not arguments[2] & (os.O_WRONLY | os.O_RDWR):
        return
    if name in ("os.rename", "os.remove", "os.mkdir", "os.link", "os.rmdir", "open"):
        path = str(arguments[0])
        if "run" in path and not path.endswith(".py") and "site-packages" not in path:
            left -= 1
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)
sys.addaudithook(watch)
sys.exit(main(["springs", "--no-figures", "--out", "run", "--overwrite"]))
"""


@pytest.mark.parametrize("first", [1, 2, 3])
def test_killed_at_any_change_of_a_file_one_whole_run_is_there(first: int) -> None:
    """The old one or the new one, with nothing of the other, and nothing hidden."""
    shutil.copytree("run", "old")
    before = {path.relative_to("old"): data for path, data in files("old").items()}
    seen = set[str]()
    for kill in range(first, 60, 9):
        shutil.rmtree("run")
        shutil.copytree("old", "run")
        done = subprocess.run([sys.executable, "-c", KILLED, str(kill)], capture_output=True)
        assert done.returncode in (0, -signal.SIGKILL), done.stderr
        RunDirectory.open("run").result()
        found = {path.relative_to("run"): data for path, data in files().items()}
        if found == before:
            seen.add("old")
            continue
        seen.add("new")
        names = {str(path) for path in found if not path.name.startswith(".")}
        assert names <= {"config.toml", "versions.json", "command.txt", "result.json"} | {
            *("points.csv", "trials.csv", "report.html", "trials.partial.jsonl"),
            *("trials.store.jsonl", "files.txt"),
        }
        assert main(["springs", "--no-figures", "--out", "run", "--overwrite"]) == 0
        assert not [path for path in Path("run").iterdir() if path.name.startswith(".")]
    assert seen == {"old", "new"}


def test_W7_temporary_files_of_a_killed_run_are_swept_and_no_others() -> None:
    ours = [".config.toml.94e05034ca1ee134", "figures/.a.svg.00112233445566ff"]
    theirs = [".config.toml.94e0", ".mine.94e05034ca1ee134", "figures/.a.txt.00112233445566ff"]
    Path("run/figures").mkdir(exist_ok=True)
    listed(Path("run"), "figures/a.svg")
    for name in [*ours, *theirs]:
        Path("run", name).write_text("half of a file")
    words = ["springs", "--no-figures", "--out", "run"]
    assert main([*words, "--overwrite"]) == 0
    assert [name for name in [*ours, *theirs] if Path("run", name).exists()] == theirs


def test_the_file_that_configures_a_run_is_refused_in_its_folder(
    capsys: pytest.CaptureFixture[str],
) -> None:
    before = files()
    for more in (["--overwrite"], ["--resume"]):
        assert main([*WALL, "--config", "run/config.toml", "--out", "run", *more]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert "expected another folder than that of run/config.toml, found run" in line
        assert files() == before


def test_a_run_directory_reads_and_writes_only_its_own(tmp_path: Path) -> None:
    run = RunDirectory.open("run")
    Path("secret.txt").write_text("of somebody")
    for name in ("/etc/hostname", str(tmp_path / "secret.txt"), "../secret.txt"):
        with pytest.raises(ConfigError, match="name: expected one within the run"):
            run.text(name)
    assert run.text("config.toml").startswith("trials = 2")
    for content in (iter([3]), iter(["a", None])):
        with pytest.raises(ConfigError, match="content: expected pieces of text, found"):
            run.write("x", content)  # type: ignore[arg-type]
    assert not Path("run/x").exists()


def test_overwrite_takes_a_run_of_ours_alone(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No file of a folder of somebody else goes, or comes beside theirs; nor behind a link."""
    theirs = tmp_path / "theirs"
    (theirs / "figures").mkdir(parents=True)
    (theirs / "figures" / "mine.png").write_bytes(b"a picture")
    Path("link").symlink_to(theirs)
    Path("forged").mkdir()
    for name in ("result.json", "config.toml", "versions.json"):
        shutil.copy(f"run/{name}", f"forged/{name}")
    for place in ("theirs", "link", "forged"):
        before = files(place)
        for words in (["springs"], WALL, ["replay", "no.mcap"], ["robot"]):
            assert main([*words, "--out", place, "--overwrite"]) == 2
            (line,) = capsys.readouterr().err.splitlines()
            if words[0] != "replay":
                assert f"{place}: expected a run of this program to overwrite" in line
            assert files(place) == before
        with pytest.raises(OutputError, match="expected a run of this program to overwrite"):
            antennate.run("springs", out=place, overwrite=True)
        assert files(place) == before
    words = ["drive", "--esp32", "/dev/no-board", "--bus", "/dev/no-bus"]
    assert main([*words, "--out", "theirs", "--overwrite"]) == 2
    assert [path.name for path in files("theirs")] == ["mine.png"]


@pytest.mark.parametrize("more", [["--overwrite"], ["--resume"]])
def test_what_somebody_laid_into_a_run_stays_there(more: list[str]) -> None:
    theirs = ["notes.txt", "figures/mine.png", "logs/of-the-robot.mcap"]
    for name in theirs:
        Path("run", name).parent.mkdir(exist_ok=True)
        Path("run", name).write_text("mine")
    words = ["wall", "--trials", "1", "--profiles", "descending", "--workers", "1", "--out", "run"]
    code = main([*words, *more])
    assert [Path("run", name).read_text() for name in theirs] == ["mine"] * 3
    if more == ["--overwrite"]:
        assert code == 0
        assert not Path("run/logs/descending-0.mcap").exists()
        assert main([*words, "--no-figures", "--overwrite"]) == 0
        assert [path.name for path in Path("run/figures").iterdir()] == ["mine.png"]
        assert [Path("run", name).read_text() for name in theirs] == ["mine"] * 3


def test_a_file_of_somebody_with_the_name_of_one_of_a_run_is_not_replaced(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("run/frames.csv").write_text("mine")
    before = files()
    assert main([*WALL, "--out", "run", "--overwrite"]) == 2
    assert "found frames.csv, which is of none" in capsys.readouterr().err
    assert files() == before
    Path("run/frames.csv").unlink()
    figure = Path("run/figures/trials.svg")
    figure.parent.mkdir()
    figure.write_text("mine")
    with (
        pytest.raises(OutputError, match="found one of somebody else"),
        RunDirectory.create("wall", "run", overwrite=True) as run,
    ):
        run.write("figures/trials.svg", "another")
    assert figure.read_text() == "mine"


def test_a_list_leads_to_no_file_outside_its_folder() -> None:
    Path("secret.txt").write_text("of somebody")
    Path("elsewhere").mkdir()
    Path("elsewhere/secret.txt").write_text("of somebody")
    Path("run/behind").symlink_to(Path("elsewhere").absolute())
    listed(Path("run"), "../secret.txt", str(Path("secret.txt").absolute()), "behind/secret.txt")
    assert main(["springs", "--no-figures", "--out", "run", "--overwrite"]) == 0
    assert Path("secret.txt").exists()
    assert Path("elsewhere/secret.txt").exists()
