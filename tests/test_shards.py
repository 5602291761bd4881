"""Shards: a merge changes none of them, nor any other run, and says which one it lacks."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from antennate.cli import main

pytestmark = pytest.mark.ci

PLAN = 'experiment = "antenna"\nplan = "grid"\n[vary]\ncoil_mm = [3.0, 3.5, 4.0, 4.5]\n'
TRIALS = "trials.jsonl"


@pytest.fixture(scope="module")
def _run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study whole, and three of its shards: I/N in the folder I-N."""
    place = tmp_path_factory.mktemp("shards")
    (place / "plan.toml").write_text(PLAN)
    words = ["study", str(place / "plan.toml"), "--workers", "1", "--no-figures", "--out"]
    assert main([*words, str(place / "whole")]) == 0
    for shard in ("1/2", "2/2", "1/3"):
        assert main([*words, str(place / shard.replace("/", "-")), "--shard", shard]) == 0
    return place


@pytest.fixture(autouse=True)
def _there(_run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same in the working folder."""
    shutil.copytree(_run, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)


def files() -> dict[Path, bytes]:
    """All files of the working folder."""
    return {path: path.read_bytes() for path in Path().rglob("*") if path.is_file()}


def merge(*shards: str, out: str, overwrite: bool = False) -> int:
    words = ["study", "merge", *shards, "--out", out, "--no-figures"]
    return main([*words, "--overwrite"] if overwrite else words)


@pytest.mark.parametrize("out", ["1-2", "2-2", "hard"])
def test_a_merge_removes_none_of_its_shards(out: str, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.copytree("1-2", "hard", copy_function=os.link)
    before, shard = files(), {file.name: file.read_bytes() for file in Path(out).iterdir()}
    assert merge("1-2", "2-2", out=out) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "expected a folder without a run" in line
    assert files() == before
    assert merge("1-2", "2-2", out=out, overwrite=True) == 0
    assert {file.name: file.read_bytes() for file in Path(f"{out}.old").iterdir()} == shard


@pytest.mark.parametrize("shards", [["1-2"], ["1-2", "2-2"]])
@pytest.mark.parametrize("out", ["1-3", "whole"])
def test_a_merge_leaves_a_folder_that_holds_a_run_as_it_is(
    shards: list[str], out: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """A shard that it is not given, or a finished run of the same configuration."""
    before = files()
    assert merge(*shards, out=out) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "a shard is missing: 2/2" in line if len(shards) == 1 else f"found {out}/" in line
    assert "--resume" not in line
    assert files() == before


def test_a_merge_replaces_a_run_that_it_is_told_to(capsys: pytest.CaptureFixture[str]) -> None:
    assert merge("1-2", "2-2", out="merged") == 0
    capsys.readouterr()
    before = files()
    assert merge("1-2", "2-2", out="merged") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith("found merged/result.json; choose another or give --overwrite")
    assert files() == before
    assert merge("2-2", "1-2", out="1-3", overwrite=True) == 0
    assert not Path("1-3/shard.json").exists()
    for name in ("trials.csv", "result.json"):
        whole = Path("whole", name).read_bytes()
        assert Path("merged", name).read_bytes() == Path("1-3", name).read_bytes() == whole


@pytest.mark.parametrize(
    ("shards", "found", "missing"),
    [
        (["2-2"], 2, "1/2"),
        (["1-2", "1-2"], 2, "2/2"),
        (["1-3"], 2, "2/3, 3/3"),
        (["2-2", "1-3"], 3, "1/2"),
        (["1-3", "2-2"], 3, "3/3"),
    ],
)
def test_a_merge_names_the_shard_that_is_missing(
    shards: list[str], found: int, missing: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """1/3 of four trials is the first and the last, 2/2 the second and the last."""
    assert merge(*shards, out="merged") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.endswith(
        f"merge: expected 4 finished trials, found {found}: a shard is missing: {missing}"
    )
    assert not Path("merged").exists()


@pytest.mark.parametrize("damage", ["cut", "removed", "flipped"])
def test_a_damaged_shard_is_no_missing_one_and_can_be_run_again(
    damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    *lines, last = Path("2-2", TRIALS).read_bytes().splitlines(keepends=True)
    left = {"cut": last[:-15], "removed": b"", "flipped": last.replace(b'"crc":"', b'"crc":"0', 1)}
    Path("2-2", TRIALS).write_bytes(b"".join(lines) + left[damage])
    before = files()
    assert merge("1-2", "2-2", out="merged") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"2-2/{TRIALS}: expected 2 finished trials, found 1: the file is damaged; " in line
    remedy = line.rpartition("run this shard again, with ")[2]
    assert remedy == "--shard 2/2 --resume --out 2-2"
    assert files() == before
    words = ["study", "plan.toml", "--workers", "1", "--no-figures", *remedy.split()]
    assert main(words) == 0
    assert merge("1-2", "2-2", out="merged") == 0
    assert Path("merged/trials.csv").read_bytes() == Path("whole/trials.csv").read_bytes()


@pytest.mark.parametrize(
    "text", ["[]", "{}", '{"shard": "3/2", "of": 4}', '{"shard": "1/2", "of": -4}', '{"shard": 1}']
)
def test_a_file_that_says_no_shard_is_refused(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("2-2/shard.json").write_text(text)
    assert merge("1-2", "2-2", out="merged") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "2-2/shard.json: expected a whole file of this kind, found: no shard I/N" in line


def test_a_merge_onto_a_full_disk_leaves_nothing_and_its_shards() -> None:
    """It does not say that trials are kept in the folder that it has removed."""
    limit = Path("1-2", TRIALS).stat().st_size + 10

    def small_disk() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY))

    before = files()
    words = ["study", "merge", "1-2", "2-2", "--out", "merged", "--no-figures"]
    done = subprocess.run(
        [sys.executable, "-m", "antennate", *words],
        env=os.environ | {"PYTHONDONTWRITEBYTECODE": "1"},
        preexec_fn=small_disk,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stderr == (
        f"antennate study merge: error: expected to write merged/{TRIALS}, found: File too large\n"
    )
    assert files() == before
    assert not Path("merged").exists()


@pytest.mark.parametrize("count", [5, pytest.param(6, marks=pytest.mark.slow)])
def test_a_shard_without_trials_is_merged_as_any_other(count: int) -> None:
    """Of more parts than four trials; the order of the shards is anybody's."""
    words = ["study", "plan.toml", "--workers", "1", "--no-figures", "--out"]
    shards = [f"{i}-{count}" for i in range(1, count + 1)]
    for shard in shards:
        assert main([*words, shard, "--shard", shard.replace("-", "/")]) == 0
    assert merge(*reversed(shards), out="merged") == 0
    for name in ("result.json", "trials.csv", "config.toml"):
        assert Path("merged", name).read_bytes() == Path("whole", name).read_bytes()


@pytest.mark.parametrize(
    "words",
    [
        ["1-2", "2-2", "--out", "merged"],
        ["--out", "merged", "1-2", "2-2"],
        ["1-2", "--out", "merged", "2-2"],
        ["--shards", "1-2", "2-2", "--out", "merged"],
        ["1-2", "--out", "merged", "--shards", "2-2"],
    ],
)
def test_shards_are_named_anywhere_with_and_without_their_flag(words: list[str]) -> None:
    assert main(["study", "merge", *words, "--no-figures"]) == 0
    assert Path("merged/trials.csv").read_bytes() == Path("whole/trials.csv").read_bytes()


def test_no_shard_and_an_unknown_flag_are_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    for words, told in (
        (["--out", "merged"], "merge: expected the folders of all shards, found none"),
        (["1-2", "2-2", "-x"], "merge: error: -x: expected a complete shard, found no shard.json"),
    ):
        assert main(["study", "merge", *words]) == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert told in line
