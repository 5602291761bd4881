"""A run with --overwrite: the folder NAME is renamed to NAME.old, and a new one begins."""

from __future__ import annotations

import errno
import json
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

WALL = [
    "bench",
    "wall",
    "--trials",
    "2",
    "--profiles",
    "descending",
    "--workers",
    "1",
    "--no-figures",
    "--wall.start",
    "0.002",
    "--wall.travel",
    "0.03",
    "--wall.speed",
    "0.2",
]
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


def contents(place: str | Path) -> dict[Path, bytes]:
    """The same, by names within the folder."""
    return {path.relative_to(place): data for path, data in files(str(place)).items()}


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


SPRINGS = ["antenna", "--no-figures"]


@pytest.mark.ci
def test_the_old_run_is_whole_in_a_folder_beside_the_new_one(tmp_path: Path) -> None:
    replaced = ["run.old", "run.old2", "run.old3"]
    for words in (SPRINGS, ["robot"], WALL):
        before = contents("run")
        assert main([*words, "--out", "run", "--overwrite"]) == 0
        assert contents(replaced.pop(0)) == before
        fresh = tmp_path / "fresh" / words[0]
        assert main([*words, "--out", str(fresh)]) == 0
        assert contents("run").keys() == contents(fresh).keys()
    folders = ["fresh", "run", "run.old", "run.old2", "run.old3"]
    assert sorted(path.name for path in Path().iterdir()) == folders


@pytest.mark.parametrize("name", ["run/", "./run", "sub/../run"])
def test_the_old_run_lies_beside_the_new_one_however_its_path_is_written(name: str) -> None:
    Path("sub").mkdir()
    before = contents("run")
    assert main([*SPRINGS, "--out", name, "--overwrite"]) == 0
    assert contents("run.old") == before
    assert RunDirectory.open("run").result()
    assert sorted(path.name for path in Path().iterdir()) == ["run", "run.old", "sub"]


def test_a_run_without_a_result_takes_the_place_of_none() -> None:
    before = files()
    with RunDirectory.create("robot", "run", overwrite=True) as run:
        run.write("bom.csv", "part,count\n")
    assert files() == before
    assert not Path("run.old").exists()


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


@pytest.mark.ci
def test_killed_before_its_first_trial_the_old_run_is_beside_it() -> None:
    before = contents("run")
    killed_once(Path("begun"), slow_study(free=0))
    assert contents("run.old") == before
    assert RunDirectory.open("run.old").rows()
    assert slow_study(free=9).wait(120) == 0
    assert len(RunDirectory.open("run").rows()) == 3


KILLED = """
import json, os, shutil, signal, sys
from pathlib import Path
from antennate.cli import main
WORDS = ["antenna", "--no-figures", "--out", "run", "--overwrite"]
def killed(left):
    def watch(name, arguments):
        nonlocal left
        if name == "open" and not arguments[2] & (os.O_WRONLY | os.O_RDWR):
            return
        if name in ("os.rename", "os.remove", "os.mkdir", "os.link", "os.rmdir", "open"):
            path = str(arguments[0])
            if "run" in path and not path.endswith(".py") and "site-packages" not in path:
                left -= 1
                if left == 0:
                    os.kill(os.getpid(), signal.SIGKILL)
    sys.addaudithook(watch)
    sys.exit(main(WORDS))
main([*WORDS[:2], "--out", "imported"])  # all that the others import
codes = []
while not codes or codes[-1] == -signal.SIGKILL:  # until one meets its end
    kill = len(codes) + 1
    place = Path(str(kill))
    shutil.copytree("old", place / "run")
    os.chdir(place)
    if not (child := os.fork()):
        killed(kill)
    codes.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    os.chdir("..")
Path("codes.json").write_text(json.dumps(codes))
"""


@pytest.mark.ci
def test_killed_at_any_change_of_a_file_the_old_run_is_whole(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Under one of both names; and the same command ends, whatever the killed one left."""
    shutil.move("run", "old")
    done = subprocess.run([sys.executable, "-c", KILLED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    codes = json.loads(Path("codes.json").read_text())
    assert codes == [*[-signal.SIGKILL] * (len(codes) - 1), 0]
    before, seen = contents("old"), set[str]()
    for kill in range(1, len(codes)):
        monkeypatch.chdir(tmp_path / str(kill))
        whole = "run.old" if Path("run.old").exists() else "run"
        assert contents(whole) == before
        seen.add(whole)
        assert main([*SPRINGS, "--out", "run", "--overwrite"]) == 0
        assert RunDirectory.open("run").result()
        assert not [path for path in Path("run").iterdir() if path.name.startswith(".")]
        assert contents("run.old") == before
    assert seen == {"run", "run.old"}


@pytest.mark.ci
def test_a_file_system_without_room_costs_no_old_run() -> None:
    """No file can have a single byte; the folder has its name again."""
    before = files()
    code = """
import resource, sys
from antennate.cli import main
resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))
sys.exit(main(["antenna", "--out", "run", "--overwrite"]))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert files() == before
    assert not Path("run.old").exists()


@pytest.mark.skipif(os.geteuid() == 0, reason="the administrator may write everywhere")
def test_a_parent_that_cannot_be_written_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree("run", "run.old")
    before = files(".")
    Path().chmod(0o555)
    code = main(["antenna", "--out", "run", "--overwrite"])
    Path().chmod(0o755)
    assert code == 2
    assert capsys.readouterr().err.endswith("run, found: Permission denied\n")
    assert files(".") == before


@pytest.mark.parametrize("place", [".", "..", "sub/.."])
def test_a_folder_without_a_name_of_its_own_is_not_renamed(
    place: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("run/sub").mkdir()
    monkeypatch.chdir("run/sub" if place == ".." else "run")
    before = files(".")
    assert main(["antenna", "--out", place, "--overwrite"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"expected to write {place}, found: Device or resource busy" in line
    assert files(".") == before


def test_W7_temporary_files_of_a_killed_run_are_swept_and_no_others() -> None:
    ours = [".config.toml.94e05034ca1ee134", "figures/.a.svg.00112233445566ff"]
    theirs = [".config.toml.94e0", ".mine.94e05034ca1ee134", "figures/.a.txt.00112233445566ff"]
    Path("run/figures").mkdir(exist_ok=True)
    listed(Path("run"), "figures/a.svg")
    for name in [*ours, *theirs]:
        Path("run", name).write_text("half of a file")
    assert main([*SPRINGS, "--out", "run", "--overwrite"]) == 0
    assert [name for name in [*ours, *theirs] if Path("run.old", name).exists()] == theirs


def test_a_run_directory_reads_and_writes_only_its_own(tmp_path: Path) -> None:
    run = RunDirectory.open("run")
    Path("secret.txt").write_text("of somebody")
    for name in ("/etc/hostname", str(tmp_path / "secret.txt"), "../secret.txt"):
        with pytest.raises(ConfigError, match="name: expected one within the run"):
            run.text(name)
    assert run.text("config.toml").startswith("trials = 2")
    for content in (iter([3]), iter(["a", None])):
        with pytest.raises(ConfigError, match="content: expected text, bytes or pieces, found"):
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
        for words in (["antenna"], WALL, ["log", "replay", "no.mcap"], ["robot"]):
            assert main([*words, "--out", place, "--overwrite"]) == 2
            (line,) = capsys.readouterr().err.splitlines()
            if words[0] != "log":
                assert f"{place}: expected a run of this program to overwrite" in line
            assert files(place) == before
        with pytest.raises(OutputError, match="expected a run of this program to overwrite"):
            antennate.run("antenna", out=place, overwrite=True)
        assert files(place) == before
    words = ["drive", "--esp32", "/dev/no-board", "--bus", "/dev/no-bus"]
    assert main([*words, "--out", "theirs", "--overwrite"]) == 2
    assert [path.name for path in files("theirs")] == ["mine.png"]


def test_of_a_link_to_a_run_the_link_is_renamed() -> None:
    Path("link").symlink_to("run")
    before = contents("run")
    assert main([*SPRINGS, "--out", "link", "--overwrite"]) == 0
    assert Path("link.old").is_symlink()
    assert contents("run") == contents("link.old") == before
    assert RunDirectory.open("link").result()["command"] == "antenna"


THEIRS = ["notes.txt", "frames.csv", "figures/mine.png", "logs/of-the-robot.mcap", "sub/run.txt"]


def lay_theirs() -> None:
    for name in THEIRS:
        Path("run", name).parent.mkdir(exist_ok=True)
        Path("run", name).write_text("mine")


def test_what_somebody_laid_into_a_run_stays_where_it_goes_on() -> None:
    lay_theirs()
    Path("run/frames.csv").unlink()  # a run writes that name, so it would not go on
    assert main([*WALL, "--out", "run", "--resume"]) == 0
    assert all(Path("run", name).exists() for name in THEIRS if name != "frames.csv")


def test_what_somebody_laid_into_a_run_goes_along_and_is_never_removed() -> None:
    lay_theirs()
    Path("run/link").symlink_to("result.json")
    Path("run/empty").mkdir()
    before = contents("run")
    for _ in range(2):
        assert main([*SPRINGS, "--out", "run", "--overwrite"]) == 0
        assert contents("run.old") == before
        assert Path("run.old/link").is_symlink()
        assert Path("run.old/empty").is_dir()


def test_a_rename_that_fails_costs_neither_run(monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree("run", "run.old")
    before, rename = files("."), Path.rename

    def busy(path: Path, target: str | Path) -> Path:
        if path == Path("run"):
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
        return rename(path, target)

    monkeypatch.setattr(Path, "rename", busy)
    assert main([*SPRINGS, "--out", "run", "--overwrite"]) == 2
    assert files(".") == before


def test_a_run_writes_over_no_file_of_somebody() -> None:
    figure = Path("new/figures/trials.svg")
    with RunDirectory.create("wall", "new") as run:
        figure.parent.mkdir()
        figure.write_text("mine")
        with pytest.raises(OutputError, match="found one of somebody else"):
            run.write("figures/trials.svg", "another")
    assert figure.read_text() == "mine"


def test_a_list_leads_to_no_file_outside_its_folder() -> None:
    """A run that goes on removes what the list names, but nothing elsewhere."""
    Path("secret.txt").write_text("of somebody")
    Path("elsewhere").mkdir()
    Path("elsewhere/secret.txt").write_text("of somebody")
    Path("run/behind").symlink_to(Path("elsewhere").absolute())
    Path("run/result.json").unlink()
    listed(Path("run"), "../secret.txt", str(Path("secret.txt").absolute()), "behind/secret.txt")
    assert main([*WALL, "--out", "run", "--resume"]) == 0
    assert Path("secret.txt").exists()
    assert Path("elsewhere/secret.txt").exists()
