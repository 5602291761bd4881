"""The report of a run: one page that needs nothing else, from the run directory alone."""

from __future__ import annotations

import base64
import json
import math
import os
import re
import shutil
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pytest

import antennate
from antennate import experiments
from antennate.cli import main
from antennate.studies.columns import shown
from antennate.studies.trial_file import line


class Page(HTMLParser):
    """What a page refers to, its tags and its visible text."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.references: list[str] = []
        self.tags: list[str] = []
        self.text = ""
        self.source = file.read_text(encoding="utf-8")
        self.feed(self.source)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.references += [value or "" for name, value in attrs if name in ("src", "href")]

    def handle_data(self, data: str) -> None:
        self.text += data

    @property
    def alone(self) -> bool:
        """Whether it needs no other file and runs no code."""
        inside = all(ref.startswith(("data:image/", "data:video/", "#")) for ref in self.references)
        return inside and not {"script", "link", "iframe", "object"} & set(self.tags)


class Rows(HTMLParser):
    """The rows of all tables of a page."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.found: list[list[str]] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag == "tr":
            self.found.append([])
        elif tag in ("td", "th"):
            self.found[-1].append("")

    def handle_data(self, data: str) -> None:
        if self.found and self.found[-1]:
            self.found[-1][-1] += data


pytestmark = pytest.mark.usefixtures("there")


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A finished run of `antenna` with `--coil-mm 4`, which nobody changes."""
    folder = tmp_path_factory.mktemp("finished")
    with pytest.MonkeyPatch.context() as at:
        at.chdir(folder)
        assert main(["antenna", "--coil-mm", "4", "--out", "run"]) == 0
    return folder / "run"


@pytest.fixture
def run(finished: Path, there: Path) -> Path:
    """A copy of it as `run`, in the empty folder where a test runs."""
    return Path(shutil.copytree(finished, "run"))


@pytest.mark.usefixtures("run")
def test_a_run_leaves_a_page_with_everything() -> None:
    data = json.loads(Path("run/result.json").read_text())
    sentence = experiments.load("antenna").view.sentence(data)
    page = Page(Path("run/report.html"))
    assert page.alone
    assert sentence.replace("`", "") in page.text  # as code
    assert "antennate antenna --coil-mm 4 --out run" in page.text
    assert antennate.__version__ in page.text
    assert page.tags.count("img") == len(list(Path("run/figures").glob("*.svg"))) == 6
    assert "prefers-color-scheme: dark" in page.source
    assert "@media print" in page.source
    assert "></pre>" not in page.source, "an empty box"
    changed = page.text.split("Parameters")[1]
    assert "coil_mm4.03.77" in changed.replace("\n", ""), "this run, then the default"


def test_a_page_says_when_it_was_run_and_how_to_read_it() -> None:
    """Its seed too; figures have sentences, and what is code in a note looks so."""
    words = ["tunnel", "--trials", "2", "--scene", "flat", "--time-limit", "0.2", "--seed", "7"]
    assert main([*words, "--controllers", "open", "closed", "--workers", "1", "--out", "run"]) == 0
    page = Page(Path("run/report.html"))
    assert re.search(
        r"Run on 20\d\d-\d\d-\d\d at \d\d:\d\d UTC; it took (less than )?\d+ (s|min)\. Seed 7\.",
        page.text,
    )
    assert "# begun" not in page.text
    told = Path("run/command.txt").read_text()
    Path("run/command.txt").write_text(told.replace("# begun", "# resumed"))
    assert main(["report", "run"]) == 0
    assert "UTC; the rest took " in Page(Path("run/report.html")).text
    _, _, reading = page.text.partition("How to read this")
    for term in (
        *("Wilson 95 %", "Restricted mean time", "McNemar", "Wilcoxon"),
        *("Progress over time", "Stuck episodes", "Hold"),
    ):
        assert f"{term}: " in reading
    assert "Trials from above, the first five at most: the panels of a trial" in page.text
    assert "<code>invalid</code>" in page.source
    assert "`" not in page.text.partition("Parameters")[0]


def test_every_figure_has_a_sentence() -> None:
    """As far as an experiment shows its figures; the page of claims has texts of its own."""
    for name in experiments.names():
        view = experiments.load(name).view
        assert view.body is not None or view.captions, name
        for figure, caption in view.captions.items():
            assert view.caption(figure) == caption
            assert caption.endswith(".")
    assert view.caption("speed_over_time") == "Speed over time"


@pytest.mark.usefixtures("run")
def test_it_is_written_again_and_elsewhere(refused: Callable[..., str]) -> None:
    first = Path("run/report.html").read_bytes()
    Path("run/report.html").unlink()
    assert main(["report", "run"]) == 0
    assert Path("run/report.html").read_bytes() == first
    assert main(["report", "run", "--out", "page.html"]) == 0
    assert Path("page.html").read_bytes() == first
    assert "expected no such file" in refused("report", "run", "--out", "page.html")
    assert main(["report", "run", "--out", "page.html", "--overwrite"]) == 0


@pytest.mark.usefixtures("run")
def test_a_page_takes_the_place_of_no_file_of_its_run(refused: Callable[..., str]) -> None:
    before = Path("run/result.json").read_bytes()
    for words in (["run"], ["--compare", "run", "run"]):
        said = refused("report", *words, "--out", "run/result.json", "--overwrite")
        assert "--out: expected no file that the page is made of, found run/result.json" in said
    assert Path("run/result.json").read_bytes() == before


@pytest.mark.usefixtures("run")
def test_a_pipe_or_a_device_is_never_replaced(refused: Callable[..., str]) -> None:
    os.mkfifo("pipe")
    Path("null").symlink_to("/dev/null")
    for name in ("pipe", "null"):
        said = refused("report", "run", "--out", name, "--overwrite")
        assert f"{name}: expected a file or a new name, found a folder, a pipe or a device" in said
    assert Path("pipe").is_fifo()
    assert Path("null").is_char_device()
    Path("run/report.html").unlink()
    os.mkfifo("run/report.html")
    assert "expected a file or a new name" in refused("report", "run")


@pytest.mark.usefixtures("run")
def test_a_link_is_written_through() -> None:
    Path("page.html").write_text("old")
    Path("link.html").symlink_to("page.html")
    assert main(["report", "run", "--out", "link.html", "--overwrite"]) == 0
    assert Path("link.html").is_symlink()
    assert Path("page.html").read_bytes() == Path("run/report.html").read_bytes()


@pytest.mark.ci
def test_python_and_commands_of_the_robot_leave_one() -> None:
    antennate.run("antenna", out="antenna")
    page = Page(Path("antenna/report.html"))
    assert page.alone
    assert "antennate.run('antenna', ...)" in page.text
    assert main(["robot", "--out", "robot", "--json"]) == 0
    page = Page(Path("robot/report.html"))
    assert page.alone
    assert "19 servos draw" in page.text
    assert main(["report", "robot"]) == 0


def test_the_claims_of_the_paper_stand_in_theirs(capsys: pytest.CaptureFixture[str]) -> None:
    claims = [
        {
            "claim": "A stiff antenna jams at a wall of boulders",
            "criterion": "over half",
            "rival": "a soft one",
            "paper": "<b>",
            "ours": "2 < 3",
            "verdict": "conditional",
            "reason": "why",
            "command": "antennate bench wall",
        }
    ]
    counts = {"reproduced": 0, "conditional": 1, "not_reproduced": 0}
    result = {"command": "reproduce", "quick": True, "setting": "default", "seed": 7}
    result |= {"interrupted": False, "verdicts": counts}
    Path("run").mkdir()
    Path("run/result.json").write_text(json.dumps(result | {"claims": claims}))
    assert main(["report", "run"]) == 0
    page = Page(Path("run/report.html"))
    assert page.alone
    assert "#stiff_jams" in page.references
    assert "b" not in page.tags
    assert "2 < 3" in page.text
    assert "Over half of the trials jam" in page.text


@pytest.mark.ci
def test_two_runs_stand_side_by_side(run: Path, refused: Callable[..., str]) -> None:
    run.rename("coil-4")
    assert main(["antenna", "--coil-mm", "3.6", "--out", "coil-3.6"]) == 0
    assert main(["report", "--compare", "coil-3.6", "coil-4"]) == 0
    page = Page(Path("comparison.html"))
    assert page.alone
    assert "coil_mm3.64.0" in page.text.replace("\n", "")
    assert page.tags.count("img") == 12
    stiffness = [
        json.loads(Path(f"coil-{coil}/result.json").read_text())["springs"]["springs"][0]
        for coil in ("3.6", "4")
    ]
    for row in stiffness:
        assert f"{row['stiffness_n_mm_per_deg']:.4f}"[:5] in page.text
    assert "expected no such file" in refused("report", "--compare", "coil-3.6", "coil-4")
    main(["calibrate", "--no-figures", "--out", "other"])
    told = refused("report", "--compare", "coil-4", "other")
    assert (
        "expected two runs of one command, found antenna in coil-4 and calibrate in other" in told
    )


def test_points_of_two_studies_stand_together_by_what_varies() -> None:
    """Of two grids that share one value, which is the second of one and the first of the other."""
    column = "springs.springs.0.stiffness_n_mm_per_deg"
    values = {"coarse": (3.5, 4.0), "fine": (4.0, 4.5)}
    for name, coils in values.items():
        settings = {"experiment": "antenna", "response": column, "vary": {"coil_mm": list(coils)}}
        antennate.run("study", out=name, **settings)
    assert main(["report", "--compare", "coarse", "fine"]) == 0
    rows = Rows(Path("comparison.html")).found
    assert ["", "run", "coil [mm]", "stiffness (springs.springs.0) [N·mm/deg]"] in rows
    lines = [row for row in rows if len(row) == 4 and row[1:2] in (["coarse"], ["fine"])]
    assert [line[:3] for line in lines] == [
        ["3.5", "coarse", "3.5"],
        ["", "fine", "-"],
        ["4", "coarse", "4"],
        ["", "fine", "4"],
        ["4.5", "coarse", "-"],
        ["", "fine", "4.5"],
    ]
    assert [line[3] == "-" for line in lines] == [False, True, False, False, True, False]
    assert lines[2][3] == lines[3][3]


def test_a_run_that_was_stopped_has_a_page() -> None:
    Path("run").mkdir()
    Path("run/command.txt").write_text("antennate bench wall --trials 9\n")
    lines = [line({"key": f"row.{i}", "rows": [{"trial": i}]}) for i in range(3)]
    lines[1] = lines[1].replace(b'"trial":1', b'"trial":2')
    Path("run/trials.jsonl").write_bytes(b"".join(lines) + lines[2][:20])
    assert main(["report", "run"]) == 0
    page = Page(Path("run/report.html"))
    assert "was stopped: 2 trials were kept" in page.text


def test_films_stand_in_the_order_of_the_run() -> None:
    Path("run/films").mkdir(parents=True)
    Path("run/command.txt").write_text("antennate tunnel\n")
    Path("run/config.toml").write_text('controllers = ["paper", "open", "closed"]\n')
    for name in ("closed", "open", "other", "paper"):
        Path(f"run/films/{name}.mp4").write_bytes(name.encode())
    assert main(["report", "run"]) == 0
    page = Page(Path("run/report.html"))
    films = [base64.b64decode(ref.split(",")[1]).decode() for ref in page.references]
    assert films == ["paper", "open", "closed", "other"]


def test_invalid_trials_and_their_reasons_are_shown() -> None:
    words = ["--wall.travel", "0.03", "--wall.start", "0.002", "--wall.speed", "0.05"]
    words += ["--trials", "1", "--profiles", "stiff", "--workers", "1", "--no-figures"]
    assert main(["bench", "wall", *words, "--out", "run"]) == 0
    table = Path("run/trials.csv")
    head, cells = (line.split(",") for line in table.read_text().splitlines())
    row = dict(zip(head, cells, strict=True))
    row |= {"outcome": "invalid", "reason": "time stood <still>"}
    table.write_text(f"{','.join(head)}\n{','.join(row.values())}\n")
    assert main(["report", "run"]) == 0
    page = Page(Path("run/report.html"))
    assert "time stood <still>" in page.text
    assert "still" not in page.tags


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("result.json", "{", "expected a whole file of this kind"),
        ("result.json", "[]", "expected a run that names its command"),
        ("result.json", '{"command": "dance"}', "a command that is known, found dance"),
        ("result.json", '{"command": "tunnel"}', "expected a result of this version's tunnel"),
        ("result.json", '{"command": ["tunnel"]}', "expected a run that names its command"),
        ("config.toml", "a = ", "expected a run that names its command"),
        ("other.txt", "", "expected the folder of a run, found no result.json"),
    ],
)
def test_what_cannot_be_shown_is_one_line(
    refused: Callable[..., str], name: str, text: str, why: str
) -> None:
    Path("run").mkdir()
    Path("run", name).write_text(text)
    assert why in refused("report", "run")
    assert not Path("run/report.html").exists()


@pytest.mark.parametrize("cut", [0, 10, -1, -2, -30])
def test_a_table_that_was_cut_is_one_line(refused: Callable[..., str], cut: int) -> None:
    """Its last cell is empty: without its end the last row may still have all cells."""
    Path("run").mkdir()
    Path("run/command.txt").write_text("antennate bench wall --trials 2\n")
    Path("run/trials.jsonl").touch()
    table = "seed,trial,reason\n0,0,\n0,1,it is a long reason that is quoted\n0,2,\n"
    Path("run/trials.csv").write_text(table[:cut])
    assert "run/trials.csv: expected a whole file of this kind" in refused("report", "run")
    Path("run/trials.csv").write_text(table)
    assert main(["report", "run"]) == 0
    assert "3 trials were kept" in Page(Path("run/report.html")).text


def test_a_run_that_has_ended_without_its_result_is_one_line(
    refused: Callable[..., str],
) -> None:
    """What says that it goes on is gone, so it has written a result."""
    Path("run").mkdir()
    Path("run/command.txt").write_text("antennate bench wall --trials 2\n")
    Path("run/config.toml").touch()
    Path("run/trials.csv").write_text("seed,trial\n0,0\n")
    assert "run/result.json: expected a readable file" in refused("report", "run")


@pytest.mark.parametrize("ends", [(None, None), (1.0, math.nan), (-math.inf, 1.0)])
def test_an_interval_that_is_not_known_is_a_dash(ends: tuple[float | None, float | None]) -> None:
    assert shown(ends) == "-"
    assert shown((1.0, 2.0)) == "1.00 to 2.00"
