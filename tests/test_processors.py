"""What says where a run was made: processors of one name."""

from __future__ import annotations

import json
import os
import platform
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from test_replaced_runs import SLOW, killed_once, program

from antennate.studies import work
from antennate.studies.trial_file import TRIALS, line, read_trials

WORDS = ["study", "plan.toml", "--trust-code", "--out", "run", "--workers", "1", "--no-figures"]
KILLED = """
import os, signal, sys
from antennate.cli import main
done = False
def watch(name, arguments):
    global done
    if done and name != "os.kill":
        os.kill(os.getpid(), signal.SIGKILL)
    done = name == "os.rename" and str(arguments[1]).endswith("run/result.json")
if __name__ == "__main__":
    sys.addaudithook(watch)
    sys.exit(main(sys.argv[1:]))
"""


def named() -> str:
    return json.loads(Path("run/versions.json").read_text())["processor"]


@pytest.mark.slow
def test_a_run_killed_beside_its_result_names_all_processors_with_trials(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("code.py").write_text(SLOW)
    Path("killed.py").write_text(KILLED)
    Path("plan.toml").write_text(
        'experiment = "code.py:trial"\nplan = "grid"\ntrials = 3\n[vary]\nx = [0.5]\n'
    )
    killed_once(Path("begun"), program(*WORDS, FREE="2"))
    here, path = named(), Path("run", TRIALS)
    known = read_trials(path)
    assert (len(known.records), known.processors) == (2, [here])
    lines = [{"identity": known.identity}, {"processor": f"Not {here}"}, *known.records.values()]
    path.write_bytes(b"".join([line({k: v for k, v in a.items() if k != "crc"}) for a in lines]))

    Path("begun").unlink()
    killed_once(Path("begun"), program(*WORDS, FREE="2"))
    assert read_trials(path).processors == [f"Not {here}"]

    done = subprocess.run(
        [sys.executable, "killed.py", *WORDS], env={**os.environ, "FREE": "9"}, capture_output=True
    )
    assert done.returncode == -signal.SIGKILL, done.stderr
    assert Path("run/result.json").exists()
    assert named() == f"Not {here} and {here}"
    assert program(*WORDS, FREE="9").wait(120) == 0
    assert named() == f"Not {here} and {here}"


@pytest.mark.parametrize(
    ("text", "name"),
    [
        (
            "processor\t: 0\nvendor_id\t: GenuineIntel\ncpu family\t: 6\nmodel\t\t: 207\n"
            "model name\t: Intel(R) Xeon(R) Processor\nstepping\t: 2\n\nprocessor\t: 1\n",
            "Intel(R) Xeon(R) Processor (family 6 model 207 stepping 2)",
        ),
        (
            "processor\t: 0\nBogoMIPS\t: 108.00\nCPU implementer\t: 0x41\nCPU variant\t: 0x0\n"
            "CPU part\t: 0xd08\nCPU revision\t: 3\n\nModel\t\t: Raspberry Pi 4 Model B Rev 1.1\n",
            "aarch64 (CPU implementer 0x41 CPU part 0xd08 CPU variant 0x0)",
        ),
        ("", "aarch64"),
    ],
)
def test_processors_of_one_name_are_told_apart(
    text: str, name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Virtual machines name all of a family alike; a Raspberry Pi names none."""
    (tmp_path / "cpuinfo").write_text(text)
    monkeypatch.setattr(work, "CPUINFO", tmp_path / "cpuinfo")
    monkeypatch.setattr(platform, "processor", lambda: "")
    monkeypatch.setattr(platform, "machine", lambda: "aarch64")
    work.processor.cache_clear()
    try:
        assert work.processor() == name
    finally:
        work.processor.cache_clear()
