"""What who runs this for the first time sees: what was compared, with whom, and how sure it is."""

from __future__ import annotations

import math
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from antennate import experiments
from antennate.cli import main
from antennate.control.registry import BUILT_IN, RIVAL, compared
from antennate.experiments.study.config import StudyConfig
from antennate.experiments.study.effects import Elementary
from antennate.experiments.study.result import Cell, StudyResult
from antennate.experiments.study.result import summarise as studied
from antennate.experiments.tunnel.physics import TrialResult, TunnelConfig
from antennate.experiments.tunnel.result import TunnelResult
from antennate.experiments.tunnel.result import summarise as crossed
from antennate.experiments.wall.experiment import summarise
from antennate.experiments.wall.physics import WallConfig, invalid
from antennate.studies.pooling import frame

TUNNEL, WALL = experiments.load("tunnel"), experiments.load("wall")
FEW = "Fewer than 5 trials decide nothing; their means have no interval."
T_4 = 2.776  # Student's 97.5 % quantile of four degrees of freedom, as printed
UNMET_5 = 0.4345  # Wilson's largest share of failures where none of five failed


def row(controller: str, trial: int, time: float | None, outcome: str = "success") -> TrialResult:
    ended = outcome if time is not None else "timeout"
    how: Any = {"outcome": ended, "time_s": time or 100.0, "progress_m": 1.0}
    return TrialResult(seed=0, trial=trial, controller=controller, **how)


def result(**times: list[float | None]) -> TunnelResult:
    """The result of a run in which controllers took so long; None is out of time at 100 s."""
    rows = [row(name, k, t) for name, every in times.items() for k, t in enumerate(every)]
    most = max(map(len, times.values()))
    config = TunnelConfig(controllers=tuple(times), trials=max(1, most))
    return crossed(config, frame(rows))


def headline(found: TunnelResult) -> str:
    """The sentence of five trials, without its last: how little they decide."""
    told, mark, _ = TUNNEL.sentence(found).partition(" 5 trials decide little")
    assert mark
    return told


def test_the_headline_compares_with_the_rival_alone() -> None:
    """Five pairs that differ by 30, 40, 50, 60, 70 s: 50 s, and the interval of their mean."""
    found = result(
        open=[40.0, 50.0, 60.0, 70.0, 80.0], paper=[30.0] * 5, closed=[10.0, 10.0, 10.0, 10.0, 10.0]
    )
    half = T_4 * math.sqrt(250 / 5)
    text = headline(found)
    # a failure of open alone would differ by 100 - 10 s, one of closed alone by 60 - 100 s
    low, high = (
        50 - math.hypot(half, UNMET_5 * (50 + 40)),
        50 + math.hypot(half, UNMET_5 * (90 - 50)),
    )
    ends = f"{low:.1f} to {high:.1f} s"
    told = "50.0 s {0} (95 % interval: {1} {0}; a failure counts as the limit), McNemar p 1."
    assert text.endswith(f"; closed against open: {told.format('faster', ends)}")
    assert text.count("against") == 1
    turned = headline(result(closed=[10.0] * 5, open=[40.0, 50.0, 60.0, 70.0, 80.0]))
    assert turned.endswith(told.format("faster", ends))
    slower = headline(result(open=[10.0] * 5, closed=[40.0, 50.0, 60.0, 70.0, 80.0]))
    assert slower.endswith(told.format("slower", ends))
    mixed = headline(result(open=[30.0] * 5, closed=[1.0, 10.0, 20.0, 30.0, 80.0]))
    half = T_4 * math.sqrt(956.2 / 5)  # of differences of 29, 20, 10, 0, -50 s
    ends = re.search(
        r"open: 1\.8 s faster \(95 % interval: (\S+) s faster to (\S+) s slower", mixed
    )
    assert ends is not None
    low, high = math.hypot(half, UNMET_5 * (1.8 + 70)), math.hypot(half, UNMET_5 * (71.8 - 1.8))
    found = sorted(float(end) for end in ends.groups())
    assert found == pytest.approx(sorted([1.8 + high, low - 1.8]), abs=0.1)


@pytest.mark.parametrize(
    ("names", "columns"),
    [
        (("open", "closed"), ["closed minus open"]),
        (("timed", "closed", "open"), ["closed minus timed", "open minus timed"]),
        (
            ("open", "timed", "paper", "closed"),
            ["open minus timed", "paper minus timed", "closed minus timed"],
        ),
    ],
)
def test_pairs_are_told_in_one_direction(names: tuple[str, ...], columns: list[str]) -> None:
    """The later less the earlier, or less the rival; trial 5 is won by the last one alone."""
    times = {name: 10.0 * (k + 1) for k, name in enumerate(names)}
    found = result(
        **{name: [t] * 5 + [t if name == names[-1] else None] for name, t in times.items()}
    )
    _, pairs = TUNNEL.tables(found)
    assert set(columns) <= set(pairs.columns)
    cells = dict(pairs.rows)
    for k, column in enumerate(pairs.columns):
        first, second = column.split(" minus ")
        assert second == RIVAL or names.index(second) < names.index(first)
        ends = [
            (5 * times[n] + (times[n] if n == names[-1] else 100.0)) / 6 for n in (first, second)
        ]
        assert float(cells["difference [s]"][k]) == pytest.approx(ends[0] - ends[1], abs=0.051)
        low, high = map(float, cells["  95 % [s]"][k].split(" to "))
        assert low < ends[0] - ends[1] < high
        assert cells["  time of each [s]"][k] == f"{times[first]:.1f}, {times[second]:.1f}"
        won = [str(int(n == names[-1])) for n in (first, second)]
        assert [cells["only the first"][k], cells["only the second"][k]] == won


def test_the_rival_is_one_named_controller() -> None:
    assert RIVAL in BUILT_IN
    assert compared(["paper", RIVAL, "closed", "mine.py:Mine"]) == ("mine.py:Mine", RIVAL)
    assert compared(["closed", RIVAL]) == ("closed", RIVAL)
    assert compared(["open", RIVAL, "paper", "closed"]) == ("closed", RIVAL)
    assert compared(["closed", "open"]) == ("closed", "open")
    assert compared(["paper", "closed"]) == ("closed", "paper")
    assert compared(["closed"]) is None
    assert compared([RIVAL, "closed", "closed@yoked"]) == ("closed", RIVAL)
    assert compared(["closed", "closed@none", "closed@yoked"]) == ("closed", "closed@yoked")
    assert compared(["closed@none", "closed@yoked"]) == ("closed@yoked", "closed@none")


@pytest.mark.parametrize("trials", [1, 2, 3, 4])
def test_few_trials_have_no_interval_of_a_mean_and_one_sentence(trials: int) -> None:
    """Student's of two trials of 28 and 60 s would reach from -159 to 247 s."""
    times: list[float | None] = [28.0, 60.0, 35.0, None]
    found = result(open=times[:trials], closed=times[:trials][::-1])
    assert found.controllers["open"].restricted_mean_time_95 is None
    assert found.paired["open-closed"].time_difference_95 is None
    text = TUNNEL.sentence(found)
    assert text.endswith(f". {FEW}")
    assert text.count("decide nothing") == 1
    assert "McNemar" not in text
    table = TUNNEL.tables(found)[0]
    assert "decide nothing" not in table.note
    cells = dict(table.rows)
    assert cells["  95 % [s]"] == ["-", "-"]


def test_intervals_keep_to_the_time_that_there_is() -> None:
    found = result(open=[None, None, None, None, 5.0], closed=[1.0, 1.0, 1.0, 1.0, 90.0])
    low, high = found.controllers["open"].restricted_mean_time_95
    assert 0.0 < low < 81.0 < high < 100.0
    low, high = found.controllers["closed"].restricted_mean_time_95
    assert (low, 18.8 < high <= 100.0) == (0.0, True)
    low, high = found.paired["open-closed"].time_difference_95
    assert -100.0 <= low < 62.2 < high <= 100.0


def test_a_study_knows_the_bounds_of_what_it_compares() -> None:
    """Four of five are the limit, a failure: Wilson's share of them, 0.3755 to 0.9638, decides."""
    for config, point in (
        (StudyConfig(settings={"time_limit": 100.0}), {"tunnel.strewn": 0}),
        (StudyConfig(), {"time_limit": 100.0}),
    ):
        config = config.model_copy(update={"response": "time_s"})
        rows = [
            {"point": 0, "controller": "open", "trial": k, "status": "ok", "time_s": time}
            for k, time in enumerate([100.0, 100.0, 100.0, 100.0, 5.0])
        ]
        found = studied(config, [point], {}, "controller", rows, 5, 5)
        low, high = found.points[0].response95 or (0.0, 0.0)
        assert pytest.approx((low, high), abs=0.02) == (5.0 + 95.0 * 0.3755, 5.0 + 95.0 * 0.9638)
        few = studied(config, [point], {}, "controller", rows[:4], 4, 4)
        assert few.points[0].response95 is None


def test_a_study_calls_controllers_as_tunnel_does_and_counts_few_trials_by_point() -> None:
    rows = [
        {"point": point, "controller": name, "trial": 0, "status": "ok", "outcome": "success"}
        for point in range(8)
        for name in ("open", "mine/left.py:left")
    ]
    points = [{"tunnel.strewn": point} for point in range(8)]
    found = studied(StudyConfig(plan="list"), points, {}, "controller", rows, 16, 16)
    study = experiments.load("study")
    (table,) = study.tables(found)
    assert [head.partition(":")[0] for head in table.columns] == ["open", "left"]
    assert "open 8 of 8" in study.sentence(found)
    assert "left 8 of 8" in study.sentence(found)
    assert "left.py" not in study.sentence(found)
    assert "Fewer than 5 trials per point decide nothing" in study.sentence(found)


def test_nothing_of_nothing_is_never_said() -> None:
    rows = [row("closed", 0, 20.0)]
    config = TunnelConfig(controllers=("open", "closed"), trials=3)
    found = crossed(config, frame(rows))
    texts = [TUNNEL.sentence(found), repr(TUNNEL.tables(found))]
    lost = [row("open", k, 1.0, "invalid") for k in range(3)]
    found = crossed(config, frame([*lost, *rows]))
    texts += [TUNNEL.sentence(found), repr(TUNNEL.tables(found))]
    one = WallConfig(profiles=("stiff",), trials=1)
    walls = summarise(one, frame([invalid(one, "stiff", 0, "time stood still")]))
    texts += [WALL.sentence(walls), repr(WALL.tables(walls))]
    for text in texts:
        assert "0 of 0" not in text
        assert "0 to 100" not in text
    assert "open without a valid trial" in texts[0]
    found = crossed(TunnelConfig(controllers=("open",), trials=3), frame(lost))
    assert "No trial of open is valid: " in TUNNEL.sentence(found)
    assert not TUNNEL.tables(found)


ABOUT = [
    "open: walks forward whatever its antennae feel",
    "timed: backs off and turns by the clock",
    "paper: turns away from the side that touches",
    "closed: walks on until its readings repeat",
]


class Order(HTMLParser):
    """The order of pictures, tables and texts of a page."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.seen: list[str] = []
        self.text = ""
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("img", "table", "h2"):
            self.seen.append(tag)
            self.text += f"<{tag}>"

    def handle_data(self, data: str) -> None:
        self.text += data


@pytest.mark.ci
def test_a_line_each_says_what_the_controllers_are_and_the_report_begins_with_a_picture(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In the terminal above the table, in the report below the sentence, above the picture."""
    monkeypatch.chdir(tmp_path)
    words = ["--trials", "1", "--time-limit", "0.5", "--scene", "flat", "--workers", "1"]
    assert main(["tunnel", *words, "--out", "one"]) == 0
    printed = capsys.readouterr().out
    page = Order(Path("one/report.html"))
    assert page.seen[0] == "img"
    assert "has to beat" not in page.text
    for text in (printed, page.text):
        places = [text.index(line) for line in ABOUT]
        assert places == sorted(places)
        assert places[-1] < text.index("Controllers")
        assert text.count(FEW) == 1
    places = [page.text.index(text) for text in ("Trials that succeeded", *ABOUT, "<img>")]
    assert places == sorted(places)
    alts = re.findall('<img alt="([^"]*)"', Path("one/report.html").read_text())
    assert alts == list(TUNNEL.captions.values())
    assert main(["report", "--compare", "one", "one"]) == 0
    both = Order(Path("comparison.html")).text
    assert all(both.count(line) == 1 for line in [*ABOUT, FEW])
    assert main(["report", "--compare", "one", "one"]) == 2
    refused = capsys.readouterr().err
    assert "choose another with --out, or give --overwrite" in refused
    assert "overwrite=True" not in refused
    assert both.index(ABOUT[-1]) < both.index("Controllers")


def test_a_study_of_controllers_tells_what_moves_the_last_against_the_rival() -> None:
    """Of three controllers the effects on `closed minus open` are the headline, not the last."""
    study = experiments.load("study")
    names = ["open", "paper", "closed", "paper minus open", "closed minus open"]
    effects = [
        Elementary(
            of=of,
            parameter=name,
            mu_star=size,
            mu_star95=None,
            noise=0.1,
            above_noise=size > 0.1,
            mu=size,
            sigma=None,
        )
        for of in [*names, "closed minus paper"]
        for name, size in (
            ("width", 0.9 if of == "closed minus open" else 0.0),
            ("length", 0.5 if of == "closed minus paper" else 0.0),
        )
    ]
    point = Cell(
        point=0,
        values={},
        condition="open",
        trials=9,
        invalid=0,
        response=0.5,
        response95=None,
    )
    found = StudyResult(
        experiment="tunnel",
        plan="morris",
        response="success_share",
        axes=["width", "length"],
        points=[point],
        trials=9,
        ended=9,
        interrupted=False,
        statuses={"ok": 9},
        conditions={},
        effects=[*effects],
    )
    assert "closed minus open depends on width" in study.sentence(found)
    assert [line for line, _ in study.tables(found)[0].rows][1:] == ["width", "length"]
