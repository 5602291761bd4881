"""The same study on every engine: Dask, SLURM's jobs as processes, Snakemake's commands, Python."""

from __future__ import annotations

import contextlib
import functools
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import types
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from importlib import metadata
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import pytest
from study_trials import trial

import antennate
from antennate.cli import main
from antennate.control.registry import CONTROLLERS
from antennate.errors import AntennateError, WorkerError
from antennate.experiments.study.config import StudyConfig
from antennate.messages import command_words
from antennate.studies.engines import make_engine
from antennate.studies.identity import environment, identity, packages_used
from antennate.studies.pool import Workers, gather
from antennate.studies.slurm import Resumable
from antennate.studies.submitted import Submitted
from antennate.studies.trial_file import TrialFile, read_trials
from antennate.studies.work import Call, Work

pytestmark = pytest.mark.ci

HERE = Path(__file__).parent
ROOT = HERE.parent
VARY = {"x": [0.5, 1.5]}
QUICK = ["--gait.frequency", "1"]
"""The shortest cycle."""
CLIMB = [
    "--heights",
    "0.05",
    "--grounds",
    "flat",
    "step_tunnel:0.08",
    "--conditions",
    "level",
    "edges",
]
CLIMB += ["--divisors", "256", "--time-limit", "0.1", "--sensing", "0", "--trials", "1"]
NEAR = ["--wall.travel", "0.03", "--wall.start", "0.002", "--wall.speed", "0.05"]


@pytest.fixture(autouse=True)
def _there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    path = os.pathsep.join([str(Path(antennate.__file__).parents[1]), str(HERE)])
    monkeypatch.setenv("PYTHONPATH", path)


def table(out: str, sleep: float = 0.01, **how: Any) -> bytes:
    """The table of a small study of a function."""
    antennate.study(trial, VARY, {"sleep": sleep}, trials=8, out=out, **how)
    return Path(out, "trials.csv").read_bytes()


def test_a_function_is_studied_from_python() -> None:
    result = antennate.study(trial, VARY, trials=3)
    assert [row["value"] for row in result.rows[:3]] == pytest.approx([0.2, 0.4, 0.6])
    assert result.summary["statuses"] == {"ok": 6}
    assert list(result.to_dataframe().columns[:2]) == ["point", "x"]
    springs = antennate.study("antenna", {"coil_mm": [3.5, 4.0]})
    assert len(springs.rows) == 2
    with pytest.raises(antennate.BadInputError, match="did you mean"):
        antennate.study("antenna", {"coil_m": [1.0]})
    with pytest.raises(
        antennate.BadInputError, match=r"assumed: .* whose parameters have no sources"
    ):
        antennate.study(trial, VARY, plan="sobol", assumed=0.2)


@pytest.mark.parametrize("engine", ["dask", "slurm-local"])
def test_a_class_that_workers_cannot_import_costs_no_study(
    engine: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An earlier run of the same program had it as its controller."""
    pytest.importorskip("distributed" if engine == "dask" else "submitit")
    nowhere = types.ModuleType("nowhere_to_be_found")
    exec("class Own: pass", vars(nowhere))
    monkeypatch.setitem(sys.modules, "nowhere_to_be_found", nowhere)
    CONTROLLERS.add("Own", nowhere.Own)
    assert table("here", workers=1, engine=engine).count(b",ok,") == 16


def test_a_function_that_workers_cannot_import_costs_no_other_study(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As one of a module that the program itself has made."""
    module = types.ModuleType("made_here")
    exec("def own(config, seed):\n    return {'value': config['x']}", module.__dict__)
    monkeypatch.setitem(sys.modules, "made_here", module)
    here = antennate.study(module.own, {"x": [1.0, 2.0]}, trials=1, workers=1)
    assert [row["value"] for row in here.rows] == [1.0, 2.0]
    springs = antennate.study("antenna", {"coil_mm": [3.5, 4.0]}, workers=2)
    assert springs.summary["statuses"] == {"ok": 2}
    with pytest.raises(WorkerError, match=r"^own: expected what workers can import.* one worker$"):
        antennate.study(module.own, {"x": [1.0, 2.0]}, trials=1, workers=2, out="there")
    assert not Path("there").exists()


PROMPT = """
import sys
if {core}: sys.modules["cloudpickle"] = None  # as where it is not installed
import antennate
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
def trial(config, seed): return dict(y=seed * config["w"])
engine = ProcessPoolExecutor(1, get_context("spawn")) if {apart} else "local"
print(antennate.study(trial, vary=dict(w=[1, 2]), trials=2, workers=2, engine=engine).rows)
"""


@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("core", [False, True])
def test_a_function_of_a_prompt_is_sent_or_refused_alike_on_any_engine(
    core: bool, apart: bool
) -> None:
    """A cell of a notebook has no file either; cloudpickle sends it whole where it is there."""
    pytest.importorskip("cloudpickle")
    words = [sys.executable, "-c", PROMPT.format(core=core, apart=apart)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    if core:
        assert done.returncode == 1
        assert done.stderr.splitlines()[-1] == (
            "antennate.errors.WorkerError: trial: expected what workers can import, found it in "
            "__main__ without a file, as in a notebook cell or after -c; put it in a file and "
            "import that, or use one worker"
        )
    else:
        assert (done.returncode, done.stdout.count("'ok'")) == (0, 4), done.stderr


def test_what_is_no_function_of_its_own_is_refused() -> None:
    def tunnel(config: dict[str, Any], seed: int) -> dict[str, float]:
        raise AssertionError

    for other in (tunnel, functools.partial(trial), 3):
        with pytest.raises(antennate.BadInputError, match="name that no experiment has, found"):
            antennate.study(other, VARY, trials=1)


@pytest.fixture(scope="module")
def alone(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """The table of a study without an engine."""
    return table(str(tmp_path_factory.mktemp("alone") / "here"))


def test_jobs_of_slurm_leave_the_same_table(alone: bytes) -> None:
    pytest.importorskip("submitit")
    assert table("jobs", workers=2, engine="slurm-local") == alone


def job_of(file: Path, part: Work, theirs: Mapping[str, Any] | None = None) -> Resumable:
    """What a job of SLURM calls, whose driver has made its file."""
    file.touch()
    return Resumable(str(file), theirs or environment(), part, {})


def test_a_job_whose_driver_needs_it_no_more_runs_no_further_trial(tmp_path: Path) -> None:
    """Its driver has removed its file: before it begins, or while it runs."""
    pytest.importorskip("cloudpickle")
    removes = {place: (str(tmp_path / "job.jsonl"),) for place in range(3)}
    job = job_of(tmp_path / "job.jsonl", Work(os.unlink, removes, timeout=60.0))
    with pytest.raises(WorkerError, match="expected a driver that reads what this job finishes"):
        job.carry_out()
    assert job.carry_out() == 0
    assert not list(tmp_path.glob("*.jsonl"))


def test_a_job_that_begins_again_goes_on(tmp_path: Path) -> None:
    """SLURM begins a job again with the tasks that it was first given."""
    pytest.importorskip("cloudpickle")
    notes = tmp_path / "notes.txt"
    os.environ["STUDY_NOTES"] = str(notes)
    try:
        tasks = {place: ({"x": 1.0}, place) for place in range(3)}
        part = Work(trial, tasks, timeout=60.0)
        job = job_of(tmp_path / "job.jsonl", part)
        assert job.carry_out() == 3
        assert job.carry_out() == 0
        assert len(notes.read_text().splitlines()) == 3
        assert sorted(read_trials(tmp_path / "job.jsonl").records) == ["0", "1", "2"]
    finally:
        del os.environ["STUDY_NOTES"]


def test_trials_of_a_job_of_slurm_crash_or_hang_as_on_one_machine(tmp_path: Path) -> None:
    pytest.importorskip("cloudpickle")
    tasks = {place: ({"x": 1.0, "mode": "hang"}, place) for place in (1, 2)}
    part = Work(trial, tasks, timeout=1.0)
    job_of(tmp_path / "hung.jsonl", part).carry_out()
    found = read_trials(tmp_path / "hung.jsonl").records
    assert found["1"]["failure"] == ["hung", "no result within 1 s"]
    assert found["2"]["result"]
    signals = {0: (signal.SIGTERM,), 1: (signal.SIGUSR2,), 2: (signal.SIGKILL,)}
    part = Work(signal.raise_signal, signals, timeout=60.0)
    job_of(tmp_path / "asked.jsonl", part).carry_out()
    found = read_trials(tmp_path / "asked.jsonl").records
    assert all("result" in found[place] for place in "01"), "asked to end, it goes on"
    assert found["2"]["failure"] == ["crashed", "a worker process ended with code -9 in its work"]


def test_a_result_that_cannot_be_kept_is_one_line_as_on_one_machine(tmp_path: Path) -> None:
    """It ends the run at once: no job is begun again for it."""
    pytest.importorskip("submitit")
    said = "expected a result that can be kept, found set"
    for engine, line in ((None, said), (make_engine("slurm-local"), f"slurm: {said}")):
        store = TrialFile(tmp_path / f"{len(line)}.jsonl")
        store.begin({"results": "sets"})
        workers = Workers(1, engine, trials=store)
        with pytest.raises(AntennateError, match=f"^{line}$"):
            gather(set, [((1, 2),)], workers, lambda done, total: None)
        store.close()
    assert len(list((tmp_path / "slurm").glob("*_submitted.pkl"))) == 1


def test_a_trial_that_hangs_beside_a_worker_of_dask_is_found(tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    from antennate.studies.dask import carry_out_apart

    tasks = {place: ({"x": 1.0, "mode": "hang"}, place) for place in (1, 2)}
    part = Work(trial, tasks, timeout=1.0)
    found = dict(carry_out_apart(part, environment(), {}, "one"))
    assert (found[1].status, found[2]["value"]) == ("hung", pytest.approx(1.1))


def test_a_process_beside_a_worker_of_dask_serves_one_run_alone() -> None:
    """It has imported the user's code, which may have been edited before the next run."""
    pytest.importorskip("distributed")
    from antennate.studies.dask import carry_out_apart

    part = Work(os.getpid, {0: ()}, timeout=60.0)
    runs = ("one", "one", "two")
    first, again, other = (dict(carry_out_apart(part, environment(), {}, run))[0] for run in runs)
    assert first == again != other


def test_an_engine_gives_work_to_workers_that_join_later() -> None:
    """One part for each worker: the second is given before the first has ended."""
    joined = [1, 1, 2]
    given: list[Future[Any]] = []

    def submit(function: Any, part: Work, *told: Any) -> Future[Any]:
        given.append(Future())
        if len(given) == 2:
            for place, future in enumerate(given):
                future.set_result([(place, None)])
        return given[-1]

    def workers() -> int:
        return joined.pop(0) if len(joined) > 1 else joined[0]

    found: list[int] = []
    work = Work(trial, {0: ({}, 0), 1: ({}, 1)}, timeout=60.0)
    engine = Submitted("later", submit, ahead=1, workers=workers)
    call = Call(work, [[0], [1]], lambda place, result: found.append(place), pytest.fail)
    engine.run(call, 1)
    assert sorted(found) == [0, 1]


def test_a_job_of_another_version_is_refused(tmp_path: Path) -> None:
    part = Work(trial, {}, timeout=60.0)
    old = {**environment(), "versions": {"numpy": "1.0"}}
    with pytest.raises(WorkerError, match=r'numpy "1\.0", now'):
        job_of(tmp_path / "job.jsonl", part, old).carry_out()


def test_versions_of_optional_packages_count_where_a_run_uses_them(tmp_path: Path) -> None:
    """Optuna proposes designs, and does nothing else."""
    pytest.importorskip("optuna")
    config = StudyConfig(plan="optuna")
    assert packages_used("study", config) == ("optuna",)
    assert identity("study", config)["versions"]["optuna"] == metadata.version("optuna")
    assert "optuna" not in identity("study", StudyConfig())["versions"]
    theirs = environment("study", config)
    theirs["versions"]["optuna"] = "0.1"
    with pytest.raises(WorkerError, match=r'optuna "0\.1", now'):
        job_of(tmp_path / "job.jsonl", Work(trial, {}, 9.0), theirs).carry_out()


def test_a_scheduler_that_is_not_there_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("distributed")
    Path("plan.toml").write_text('experiment = "antenna"\n[vary]\ncoil_mm = [3.5, 4.0]\n')
    assert main(["study", "plan.toml", "--engine", "dask://127.0.0.1:9", "--out", "run"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert said[-1].startswith("antennate study: error: dask: expected a scheduler at")
    assert main(["study", "plan.toml", "--slurm", "timeout_min=5", "--out", "run"]) == 2
    assert "expected --engine slurm beside it" in capsys.readouterr().err


POOL = """
import sys
import antennate
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
def half(number): return number / 2
def trial(config, seed):
    with ProcessPoolExecutor(1, get_context(config["start"])) as pool:
        return dict(y=pool.submit(half, seed).result(timeout=60))
def study(engine):
    vary = dict(start=["fork", "spawn"])
    return antennate.study(trial, vary, trials=1, workers=2, engine=engine, out="run")
if __name__ == "__main__":
    print(study(sys.argv[1]).rows)
"""


@pytest.mark.parametrize("engine", ["local", "slurm-local"])
def test_a_trial_of_a_program_may_begin_processes_on_any_engine(engine: str) -> None:
    """They find by its name what the trial gives them, as in the program."""
    pytest.importorskip("submitit")
    Path("program.py").write_text(POOL)
    _ends_with_ok("program.py", engine)


@pytest.mark.slow
def test_a_trial_of_a_program_may_begin_processes_on_dask() -> None:
    pytest.importorskip("distributed")
    Path("program.py").write_text(POOL)
    with scheduler() as (address, _):
        _ends_with_ok("program.py", f"dask://{address}")


def _ends_with_ok(*words: str) -> None:
    done = subprocess.run(
        [sys.executable, *words], capture_output=True, text=True, timeout=120, check=False
    )
    assert (done.returncode, done.stdout.count("'ok'")) == (0, 2), done.stdout + done.stderr


def test_a_program_without_its_guard_is_run_once_by_its_jobs() -> None:
    pytest.importorskip("submitit")
    program = POOL.replace('["fork", "spawn"]', '["fork"]').replace("half, seed", "abs, seed")
    program = program.replace('if __name__ == "__main__":', "if True:")
    program = program.replace(
        "sys.argv[1]", "'local' if __name__ == '__mp_main__' else sys.argv[1]"
    )
    program = program.replace("workers=2", "workers=1")
    Path("program.py").write_text(program.replace('out="run"', 'out=f"run-{__name__}"'))
    done = subprocess.run(
        [sys.executable, "program.py", "slurm-local"],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert (done.returncode, done.stdout.count("'ok'")) == (0, 1), done.stderr
    assert not [path.name for path in Path().glob("run-__mp_main__*")]


@pytest.mark.parametrize(
    ("asked", "found"),
    [
        ("timeout_min=0", "timeout_min: expected a number above 0, found 0"),
        ("timeout_min=-5", "timeout_min: expected a number above 0, found -5"),
        ("timeout_min=true", "timeout_min: expected a number above 0, found true"),
        ("mem_gb=NaN", "mem_gb: expected a number above 0, found NaN"),
        ("slurm_time=0", "slurm_time: expected a number above 0, found 0"),
        ("cpus_per_task=many", "cpus_per_task: expected a number above 0, found many"),
        ("nodes=2", "nodes: expected 1, as jobs have one task, found 2"),
        ("timeout_min=0.5", "expected names of submitit, such as timeout_min"),
        ("timeout=5", "expected names of submitit, such as timeout_min"),
    ],
)
def test_limits_that_no_job_can_meet_are_refused_before_the_first(
    asked: str, found: str, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("submitit")
    Path("plan.toml").write_text('experiment = "antenna"\n[vary]\ncoil_mm = [3.5, 4.0]\n')
    words = ["--engine", "slurm-local", "--slurm", asked, "--out", "run"]
    assert main(["study", "plan.toml", *words]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    assert f"error: --slurm: {found}" in said[0]
    assert not Path("run").exists()


def test_a_folder_in_which_jobs_alone_left_something_can_be_overwritten() -> None:
    Path("run/slurm").mkdir(parents=True)
    Path("run/slurm/1_0_log.err").write_text("")
    Path("plan.toml").write_text('experiment = "antenna"\n[vary]\ncoil_mm = [3.5, 4.0]\n')
    assert main(["study", "plan.toml", "--out", "run", "--overwrite"]) == 0
    assert Path("run.old/slurm/1_0_log.err").exists()


@contextlib.contextmanager
def scheduler(
    count: int = 2, folder: str = "."
) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A scheduler of Dask and its workers in a folder; its address, and all processes."""
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    words = [sys.executable, "-m", "distributed.cli.dask_scheduler"]
    words += ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", "s.json"]
    running = [subprocess.Popen(words, **quiet)]
    try:
        end = time.monotonic() + 60.0
        address = None
        while address is None:
            assert time.monotonic() < end
            time.sleep(0.1)
            text = Path("s.json").read_text() if Path("s.json").exists() else ""
            address = re.search(r'tcp://([0-9.:]+)"', text)
        words = [sys.executable, "-m", "distributed.cli.dask_worker", f"tcp://{address[1]}"]
        words += ["--nthreads", "1", "--no-dashboard", "--no-nanny"]
        running += [subprocess.Popen(words, cwd=folder, **quiet) for _ in range(count)]
        yield address[1], running
    finally:
        for process in reversed(running):
            process.kill()
            process.wait()


def test_dask_leaves_the_same_table_when_a_worker_is_killed(
    tmp_path: Path, alone: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("distributed")
    with monkeypatch.context() as patch:
        notes = tmp_path / "notes.txt"
        patch.setenv("STUDY_NOTES", str(notes))
        with scheduler() as (address, (_, worker, _)):

            def kill() -> None:
                """Once four of the sixteen trials have ended; each worker is at one then."""
                while not notes.exists() or notes.read_text().count("\n") < 4:
                    time.sleep(0.01)
                worker.send_signal(signal.SIGKILL)
                killed.append(notes.read_text().count("\n"))

            killed: list[int] = []
            thread = threading.Thread(target=kill, daemon=True)
            thread.start()
            found = table("dask", sleep=0.2, workers=2, engine=f"dask://{address}")
            thread.join()
            assert worker.wait() == -signal.SIGKILL
    assert killed[0] < 12
    assert found == alone


def test_workers_of_dask_in_another_folder_find_the_file_that_a_study_names(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Also where packages have other versions, of which one line tells."""
    distributed = pytest.importorskip("distributed")
    parts = distributed.versions.get_versions()
    parts["packages"] |= {"msgpack": "0.1", "toolz": "0.2"}
    monkeypatch.setattr("distributed.versions.get_versions", lambda *_: parts)
    Path("own.py").write_text(
        "def trial(config, seed):\n    return {'value': config['x'] + seed}\n"
    )
    Path("plan.toml").write_text('experiment = "own.py:trial"\n[vary]\nx = [1.0, 2.0]\n')
    Path("away").mkdir()
    Path("away/own.py").write_text("def trial(config, seed):\n    return {'value': -1.0}\n")
    words = ["study", "plan.toml", "--experiment", "own.py:trial"]
    assert main([*words, "--out", "here", "--workers", "1"]) == 0
    with scheduler(1, "away") as (address, _):
        assert main([*words, "--out", "there", "--engine", f"dask://{address}"]) == 0
    assert Path("there/trials.csv").read_bytes() == Path("here/trials.csv").read_bytes()
    assert "dask: driver, scheduler or workers have other msgpack, toolz" in caplog.messages


def test_a_worker_with_another_copy_of_a_named_file_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "own.py"
    file.write_text("def trial(config, seed):\n    return {'value': 1}\n")
    theirs = environment("study", StudyConfig(experiment=f"{file}:trial"))
    part = Work(trial, {}, timeout=60.0)
    assert job_of(tmp_path / "job.jsonl", part, theirs).carry_out() == 0
    for edit, told in ((lambda: file.write_text("x = 1\n"), "changed"), (file.unlink, "is gone")):
        edit()
        with pytest.raises(WorkerError, match=rf"own\.py {told}"):
            job_of(tmp_path / "job.jsonl", part, theirs).carry_out()


def test_a_worker_in_another_folder_is_refused_or_has_the_same_file() -> None:
    """A worker of Dask that does not see the driver's folder, and a process of an executor."""
    pytest.importorskip("distributed")
    from antennate.studies.dask import carry_out_apart

    file = Path("own.py")
    file.write_text("def trial(config, seed):\n    return {'value': 1.0}\n")
    theirs = environment("study", StudyConfig(experiment="own.py:trial"))
    part = Work(trial, {0: ({"x": 1.0}, 0)}, timeout=60.0)
    unseen = {**theirs, "folder": "/nowhere"}
    assert dict(carry_out_apart(part, unseen, {}, "one"))[0]["outcome"] == "timeout"
    Path("away").mkdir()
    (Path("away") / "own.py").write_text("def trial(config, seed):\n    return {'value': 2.0}\n")
    settings = {"experiment": "own.py:trial", "vary": {"x": [1.0]}}
    pool = ProcessPoolExecutor(1, get_context("spawn"), os.chdir, (Path("away"),))
    with pytest.raises(WorkerError, match=r"the file own\.py changed"):
        antennate.run("study", engine=pool, workers=1, **settings)
    pool.shutdown()


def test_another_program_at_the_port_of_a_scheduler_is_one_line(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that answers, and one that says nothing."""
    pytest.importorskip("distributed")
    monkeypatch.setattr("antennate.studies.dask.CONNECT", 0.5)
    Path("plan.toml").write_text('experiment = "antenna"\n[vary]\ncoil_mm = [3.5, 4.0]\n')
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"127.0.0.1:{server.getsockname()[1]}"

        def answer() -> None:
            with server.accept()[0] as connection:
                connection.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")

        words = ["study", "plan.toml", "--engine", f"dask://{address}", "--out", "run"]
        for found in ("another program", "a program that says nothing for 0.5 s"):
            if found == "another program":
                threading.Thread(target=answer, daemon=True).start()
            assert main(words) == 2
            said = capsys.readouterr().err.strip().splitlines()
            assert said == [
                f"antennate study: error: dask: expected a scheduler at tcp://{address}, "
                f"found {found}"
            ]


def test_dask_says_what_it_waits_for_and_what_became_of_its_scheduler(
    capfd: pytest.CaptureFixture[str],
    caplog: pytest.LogCaptureFixture,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr("antennate.studies.dask.CONNECT", 5.0)
    Path("plan.toml").write_text('experiment = "antenna"\n[vary]\ncoil_mm = [3.5, 4.0]\n')
    with scheduler(0) as (address, (process,)):

        def kill() -> None:
            while "waits for workers" not in caplog.text:
                time.sleep(0.05)
            process.kill()

        thread = threading.Thread(target=kill, daemon=True)
        thread.start()
        assert main(["study", "plan.toml", "--engine", f"dask://{address}", "--out", "run"]) == 2
        thread.join()
    assert [record.getMessage() for record in caplog.records] == [
        f"dask: waits for workers at tcp://{address}"
    ]
    note, said = capfd.readouterr().err.strip().splitlines()
    assert note == caplog.messages[0]
    assert "found it gone; what has ended is kept, and the same command goes on" in said


def test_the_commands_of_the_snakefile_leave_the_same_table() -> None:
    """Its commands in the order of its rules; `snakemake --cores 2` runs the same ones."""
    Path("plan.toml").write_text('experiment = "antenna"\n[vary]\ncoil_mm = [3.5, 4.0]\n')
    text = (ROOT / "examples" / "snakemake" / "Snakefile").read_text()
    shard, merge = re.findall(r'shell:\s*f?"(.*)"', text)
    outputs = dict(re.findall(r'rule (\w+):(?:\n    .*?)*?\n    output: "(.*)"', text))
    assert outputs == {"shard": "shards/{i}/shard.json", "merge": "run/trials.csv"}
    for number in "12":
        words = shard.replace("{{input:q}}", "plan.toml").replace("{SHARDS}", "2")
        assert main(shlex.split(words.replace("{{wildcards.i}}", number))[1:]) == 0
        assert Path(outputs["shard"].replace("{i}", number)).is_file()
    words = merge.replace("{params.folders}", "shards/1 shards/2")
    assert main(shlex.split(words)[1:]) == 0
    assert main(["study", "plan.toml", "--out", "whole", "--workers", "1"]) == 0
    assert Path("run/trials.csv").read_bytes() == Path("whole/trials.csv").read_bytes()


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("tunnel", ["--trials", "3", "--time-limit", "0.5", "--controllers", "open", "closed"]),
        ("wall", ["--trials", "2", "--profiles", "stiff", *NEAR]),
        pytest.param(
            "gait",
            ["--cycles", "2", "--settling-cycles", "0", "--sweep-points", "2", *QUICK],
            marks=pytest.mark.slow,
        ),
        ("calibrate", ["--rig.pushes", "2", "--rig.speeds", "0.3"]),
        ("climb", CLIMB),
    ],
)
def test_every_command_goes_on_with_the_same_numbers(name: str, words: list[str]) -> None:
    """Half of the trials were there before, and two workers run the others; all is the same."""
    words = [*command_words(name).split(), *words]
    assert main([*words, "--workers", "1", "--out", "whole"]) == 0
    assert main([*words, "--workers", "1", "--out", "run", "--shard", "1/2"]) == 0
    assert main([*words, "--workers", "2", "--out", "run", "--resume"]) == 0
    for path in sorted(Path("whole").rglob("*.*")):
        again = Path("run") / path.relative_to("whole")
        if path.name == "files.txt":
            names = set(path.read_text().splitlines())
            assert set(again.read_text().splitlines()) == names
        elif path.name not in ("command.txt", "report.html", "trials.jsonl"):
            assert again.read_bytes() == path.read_bytes(), path
    assert Path("run/trials.jsonl").exists()


def test_snakemake_runs_the_snakefile_and_leaves_the_same_table() -> None:
    if shutil.which("snakemake") is None:
        pytest.skip("snakemake is not installed; `uv run --with snakemake pytest` brings it")
    Path("plan.toml").write_text('experiment = "antenna"\n[vary]\ncoil_mm = [3.5, 4.0]\n')
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    words = ["snakemake", "--cores", "2", "--config", "study=plan.toml", "--snakefile"]
    words.append(str(ROOT / "examples" / "snakemake" / "Snakefile"))
    done = subprocess.run(words, env={**os.environ, "PATH": path}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert main(["study", "plan.toml", "--out", "whole", "--workers", "1"]) == 0
    assert Path("run/trials.csv").read_bytes() == Path("whole/trials.csv").read_bytes()
