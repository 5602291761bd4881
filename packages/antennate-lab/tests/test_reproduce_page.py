"""docs/reproduce.py: the verdicts of a run stand on the page and on the home page."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from antennate.experiments.wall.experiment import Border, Pair, Passed, ProfileSummary, WallResult
from antennate.studies.columns import content
from antennate.studies.run_directory import RunDirectory
from antennate.studies.statistics import Discordance
from antennate_lab.reproduce.experiment import CLAIMS, ReproduceConfig, configured

pytestmark = pytest.mark.ci

DOCS = Path(__file__).parents[3] / "docs"


def run(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", str(folder / "reproduce.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


WALL_ALONE = """\
import runpy, sys
from antennate_lab.reproduce import experiment
every = experiment.fitted()
experiment.fitted = lambda: {"wall": every["wall"]}
sys.path.insert(0, sys.argv[1].removesuffix("reproduce.py"))
del sys.argv[0]
runpy.run_path(sys.argv[0], run_name="__main__")
"""


def run_with_the_wall_alone(folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """As `run` where only the wall has numbers that were fitted."""
    command = [sys.executable, "-c", WALL_ALONE, str(folder / "reproduce.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture
def pages(tmp_path: Path) -> Path:
    """The script beside a home page, with a whole run: one claim is met, all others are not."""
    for name in ("reproduce.py", "generated.py", "index.md"):
        shutil.copy(DOCS / name, tmp_path / name)
    rows = [
        {
            "claim": claim.claim,
            "criterion": claim.criterion,
            "paper": claim.paper,
            "ours": "1 | 2",
            "verdict": "not_reproduced" if i else "conditional",
            "reason": "Because.",
            "command": f"antennate {claim.experiment}",
        }
        for i, claim in enumerate(CLAIMS)
    ]
    told = {"quick": False, "setting": "default", "interrupted": False, "seed": 7}
    result = told | {"claims": rows}
    (tmp_path / "science").mkdir()
    (tmp_path / "science" / "reproduce.json").write_text(json.dumps(result))
    crossed = "fitted,572001,0,open,success\nfitted,572001,1,open,left\nfitted,7,0,open,success\n"
    text = f"setting,seed,trial,controller,outcome\n{crossed}"
    (tmp_path / "science" / "published_judged.csv").write_text(text)
    return tmp_path


def test_both_pages_tell_what_the_run_found(pages: Path) -> None:
    assert "out of date" in run(pages, "--check").stderr
    done = run(pages)
    assert done.returncode == 0, done.stderr
    counts = f"1 conditional, {len(CLAIMS) - 1} not reproduced"
    page, index = ((pages / name).read_text() for name in ("reproduce.md", "index.md"))
    assert counts in page
    assert counts in index
    assert "used to choose, `open` 1 of 2 cross." in page.replace("\n", " ")
    table = [line for line in page.splitlines() if line.endswith("reproduced** |")]
    assert len(table) == len(CLAIMS) - 1
    assert {line.count(" | ") for line in table} == {4}  # a bar in a cell ends no cell
    assert all(claim.criterion in page for claim in CLAIMS)
    assert run(pages, "--check").returncode == 0


def test_runs_with_fitted_numbers_stand_beside(pages: Path, tmp_path: Path) -> None:
    """Of the wall soft slips, no spring reaches 30° and all else fails: 19 of 20 is over a half."""
    counts: Any = {"trials": 20, "invalid": 0, "successes": 0, "jams": 0, "slips": 19}
    ended = Passed(**counts, wilson95=None)
    row = ProfileSummary(**vars(ended), hinge_max_deg=9.0, after_start=ended)
    none: Any = {"only_first": 0, "only_second": 0, "mcnemar_p": 1.0}
    pair = Pair(**none, trials=20, after_start=Discordance(**none))
    names = ("stiff", "compliant", "descending", "matched_uniform", "ascending")
    found = WallResult(
        seed=7,
        gravity="down",
        start_m=0.04,
        profiles=dict.fromkeys(names, row),
        border=Border(at_mm=19.0, below_mm=None, above_mm=None),
        paired={f"descending-{name}": pair for name in names[3:]},
    )
    for setting in ("fitted", "default"):
        config = configured("wall", ReproduceConfig(setting=setting))
        with RunDirectory.create("wall", tmp_path / setting) as folder:
            folder.describe(config)
            folder.finish(content(found))
    (tmp_path / "other").mkdir()
    for name in ("config.toml", "result.json"):
        text = (tmp_path / "fitted" / name).read_text().replace("trials = 200", "trials = 199")
        (tmp_path / "other" / name).write_text(text)
    (tmp_path / "older").mkdir()
    shutil.copy(tmp_path / "fitted" / "config.toml", tmp_path / "older")
    (tmp_path / "older" / "result.json").write_text('{"command": "wall"}')
    done = run(pages, str(tmp_path / "older"))
    assert "expected a result of this version, found seed: field required" in done.stderr
    assert "Traceback" not in done.stderr
    done = run(pages, str(tmp_path / "other"))
    assert "expected a run of `antennate bench wall --seed 7` or `antennate bench " in done.stderr
    assert "missing: antennate antenna --seed 7;" in run(pages, str(tmp_path / "default")).stderr
    done = run_with_the_wall_alone(pages, str(tmp_path / "fitted"))
    assert done.returncode == 0, done.stderr
    page, index = ((pages / name).read_text() for name in ("reproduce.md", "index.md"))
    counts = (f"1 conditional, {len(CLAIMS) - 1}", f"1 conditional, 2 fitted, {len(CLAIMS) - 3}")
    mine, best = (f"{text} not reproduced" for text in counts)
    assert f"{mine}. *Conditional*" in index
    assert f"**{mine}**. At the settings that fit best, of `bench wall`: **{best}**" in page
    cells = [line.rpartition(" | ")[2] for line in page.splitlines() if "1 &#124; 2" in line]
    assert cells.count("- |") == len(CLAIMS) - 5
    assert "**fitted**: 19 of 20 slip (76 to 99 %), 0 of 20 jam (0 to 16 %) |" in cells
    assert "by `antennate bench wall --config fitted --trials 200 --seed 7`" in page
    assert run(pages, "--check").returncode == 0
    kept = pages / "science" / "reproduce_fitted.json"
    kept.write_text(kept.read_text().replace('"quick": false', '"quick": true'))
    assert "run `antennate reproduce --setting fitted` and" in run(pages, "--check").stderr


@pytest.mark.parametrize("change", [{"quick": True}, {"interrupted": True}, {"claims": []}])
def test_only_a_whole_run_is_written(pages: Path, change: dict[str, object]) -> None:
    result = pages / "science" / "reproduce.json"
    result.write_text(json.dumps(json.loads(result.read_text()) | change))
    done = run(pages)
    assert done.returncode == 1
    assert "expected a whole run" in done.stderr
    assert not (pages / "reproduce.md").exists()
