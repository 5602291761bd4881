"""`antennate reproduce`: verdicts follow their stated rules."""

from __future__ import annotations

import dataclasses
import json
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from antennate import experiments
from antennate.cli.arguments import parse
from antennate.cli.experiment import Options
from antennate.experiments.reproduce import run as reproduce
from antennate.experiments.reproduce.experiment import EXPERIMENT
from antennate.experiments.reproduce.figure import draw
from antennate.experiments.reproduce.run import CLAIMS, ReproduceConfig
from antennate.experiments.reproduce.verdict import VERDICTS

JUDGES = {claim.name: claim.judge for claim in CLAIMS}


def springs(*stiffness: float) -> dict[str, Any]:
    paper = (0.274, 0.137, 0.091)
    return {
        "springs": [
            {"active_coils": c, "stiffness_n_mm_per_deg": ours, "paper_n_mm_per_deg": theirs}
            for c, ours, theirs in zip((3, 6, 9), stiffness, paper, strict=True)
        ]
    }


def profile(**counts: int) -> dict[str, Any]:
    usual = {"trials": 20, "invalid": 0, "successes": 0, "jams": 0, "slips": 0}
    return usual | counts


def passing(descending: int, controls: int = 0, both: int | None = None) -> dict[str, Any]:
    """The descending antenna against both controls; `both` walls were passed by either."""
    both = min(descending, controls) if both is None else both
    names = ("matched_uniform", "ascending")
    pair = {"trials": 20, "only_first": descending - both, "only_second": controls - both}
    return {
        "profiles": {
            "descending": profile(successes=descending),
            **{name: profile(successes=controls) for name in names},
        },
        "paired": {f"descending-{name}": pair for name in names},
    }


def bent(descending: float | None, stiff: float) -> dict[str, Any]:
    rows = {"descending": descending, "stiff": stiff}
    return {"profiles": {name: {"hinge_max_deg": angle} for name, angle in rows.items()}}


def times(low: float, high: float) -> dict[str, Any]:
    """Seconds that feedback saves, as an interval."""
    row = {"restricted_mean_time_s": 40.0, "restricted_mean_time_95": [30.0, 50.0]}
    rows = {"open": row | {"speed_m_s": 0.13}, "closed": row | {"speed_m_s": None}}
    return {"controllers": rows, "paired": {"open-closed": {"time_difference_95": [low, high]}}}


def tunnel(
    name: str, successes: int, blind: int, p: float, trials: int = 100, invalid: int = 0
) -> dict[str, Any]:
    row = {"trials": trials, "invalid": invalid, "speed_m_s": 0.12}
    pair = {"only_first": 1, "only_second": 1 + successes - blind, "mcnemar_p": p}
    controllers = {"open": row | {"successes": blind}, name: row | {"successes": successes}}
    return {"controllers": controllers, "paired": {f"open-{name}": pair}}


def walk(speed: float, yaw: float = 0.0) -> dict[str, float]:
    return {"speed_m_s": speed, "yaw_deg_per_cycle": yaw}


def gait(forward: float, left: float) -> dict[str, Any]:
    turns = {"turn_l": walk(0.1, left), "turn_r": walk(0.1, -left)}
    return {
        "maneuvers": {"forward": walk(forward), **turns},
        "wave_off": {"speed_m_s": 0.1},
        "cost_of_phase": {"worst_over_best": -0.03},
    }


def blind(successes: int, trials: int) -> dict[str, Any]:
    return {"controllers": {"open": {"trials": trials, "invalid": 0, "successes": successes}}}


def sigmoid(slope: float, half: float | None, midpoint: float) -> dict[str, Any]:
    ends = {"slope_95": None, "midpoint_95": None}
    if half is not None:
        ends = {"slope_95": [slope - half, slope + half], "midpoint_95": [midpoint, midpoint]}
    return {"calibration": {"slope": slope, "midpoint": midpoint, **ends}}


def swept(rarest: list[float | None]) -> dict[str, Any]:
    share: dict[str, Any] = {n: [0.3, 0.2, 0.4] for n in ("forward", "straight", "transition")}
    return {"shapes": {"descending": {"fixed": {"share": share | {"backward": rarest}}}}}


def sensed(f1: float | None, interval: list[float] | None) -> dict[str, Any]:
    """Half of the time is contact, so F1 of a sensor that always says so is 2/3."""
    row = {"contact_share": 0.5, "precision": f1 and 0.9, "recall": 0.5}
    return {"profiles": {"descending": row | {"f1": f1, "f1_95": interval}}}


@pytest.mark.parametrize(
    ("name", "result", "verdict"),
    [
        ("springs", springs(0.2744, 0.1372, 0.0914), "conditional"),  # half of the last digit
        ("springs", springs(0.2744, 0.1372, 0.0916), "not_reproduced"),
        ("stiff_jams", {"profiles": {"stiff": profile(jams=19)}}, "conditional"),
        ("stiff_jams", {"profiles": {"stiff": profile(successes=20)}}, "not_reproduced"),
        ("stiff_jams", {"profiles": {"stiff": profile(trials=6, jams=4)}}, "undecided"),
        ("soft_slips", {"profiles": {"compliant": profile(slips=15)}}, "conditional"),
        ("soft_slips", {"profiles": {"compliant": profile(slips=11)}}, "undecided"),  # 34 to 74 %
        ("soft_slips", {"profiles": {"compliant": profile(jams=20)}}, "not_reproduced"),
        ("descending_passes", passing(12), "not_reproduced"),  # Wilson: 39 to 78 %
        ("descending_passes", passing(17), "undecided"),  # 64 to 95 %
        ("descending_passes", passing(20), "conditional"),  # 84 to 100 %
        ("taper_decides", passing(20, 3), "conditional"),  # Bonett and Price: 56 to 99 points
        ("taper_decides", passing(20, 6), "undecided"),  # 40 to 87 points
        ("taper_decides", passing(10, 8), "not_reproduced"),  # -8 to 26 points
        ("taper_decides", passing(18, 2), "conditional"),  # 50.3 to 95 points
        ("taper_decides", passing(18, 2, both=0), "undecided"),  # the same lead: 44 to 101 points
        ("taper_decides", {**passing(20, 3), "paired": {}}, "undecided"),  # no pair is valid
        ("bend", bent(29.9, 60.0), "conditional"),
        ("bend", bent(30.0, 60.0), "not_reproduced"),
        ("bend", bent(None, 60.0), "undecided"),  # no trial is valid
        ("published_rule", tunnel("paper", 95, 50, 1e-9), "conditional"),
        ("published_rule", tunnel("paper", 94, 50, 1e-9), "undecided"),  # Wilson: 88 to 97 %
        ("published_rule", tunnel("paper", 90, 50, 1e-9), "not_reproduced"),  # 83 to 94 %
        ("feedback", tunnel("closed", 95, 50, 1e-9), "conditional"),  # Wilson: 89 to 98 %
        ("feedback", tunnel("closed", 1, 0, 1.0, 1), "undecided"),  # 21 to 100 %
        ("feedback", tunnel("closed", 10, 6, 0.1, 10), "undecided"),  # 72 to 100 %
        ("feedback", tunnel("closed", 30, 20, 0.01, 30), "undecided"),  # 89 to 100 %
        ("feedback", tunnel("closed", 40, 20, 1e-6, 40), "conditional"),  # 91 to 100 %
        ("feedback", tunnel("closed", 0, 0, 1.0, 1, invalid=1), "undecided"),
        ("published_rule", tunnel("paper", 5, 5, 1.0, 10), "not_reproduced"),  # 24 to 76 %
        ("speed", tunnel("closed", 95, 50, 1e-9), "conditional"),
        ("blind_speed", tunnel("closed", 95, 50, 1e-9), "not_reproduced"),
        ("faster", times(26.0, 31.0), "conditional"),
        ("faster", times(-1.0, 31.0), "undecided"),
        ("faster", times(-31.0, -1.0), "not_reproduced"),
        ("forward", gait(0.2, 30.0), "conditional"),
        ("forward", gait(0.05, 30.0), "not_reproduced"),
        ("turns", gait(0.2, 30.0), "conditional"),
        ("turns", gait(0.2, 3.0), "not_reproduced"),
        ("blind", blind(6, 10), "undecided"),  # Wilson: 31 to 83 %
        ("blind", blind(0, 10), "not_reproduced"),  # 0 to 28 %, clear of 45 to 75 %
        ("blind", blind(150, 200), "conditional"),
        ("blind", blind(152, 200), "not_reproduced"),
        ("blind", blind(3000, 4000), "conditional"),  # more trials make it no harder
        ("slope", sigmoid(18.0, 2.0, 0.3), "conditional"),
        ("slope", sigmoid(18.0, 2.0, 0.4), "not_reproduced"),
        ("slope", sigmoid(4.5, 0.1, 0.3), "not_reproduced"),
        ("slope", sigmoid(18.0, 9.0, 0.3), "undecided"),
        ("slope", sigmoid(18.0, None, 0.3), "undecided"),
        ("contact", sensed(0.7, [0.68, 0.72]), "conditional"),
        ("contact", sensed(0.7, [0.66, 0.74]), "not_reproduced"),
        ("contact", sensed(0.7, None), "undecided"),  # one trial
        ("contact", sensed(None, None), "undecided"),  # no traverse is valid
        ("shapes", swept([0.01, 0.002, 0.02]), "conditional"),
        ("shapes", swept([1e-6, 0.0, 1e-5]), "conditional"),  # chosen cells are no sample
        ("shapes", swept([0.0, 0.0, 0.0]), "not_reproduced"),
        ("shapes", swept([None, None, None]), "not_reproduced"),  # no cell is valid
    ],
)
def test_a_verdict_follows_its_rule(name: str, result: dict[str, Any], verdict: str) -> None:
    assert JUDGES[name](result).verdict == verdict


def test_a_number_without_an_interval_is_told_and_drawn_without_it() -> None:
    claim = next(claim for claim in CLAIMS if claim.name == "contact")
    finding = claim.judge(sensed(0.7, None))
    assert finding.ours == "F1 0.70 (-); to say always contact 0.67"
    panel = draw(claim, finding).axes[0]
    assert [text.get_text() for text in panel.texts] == ["0.667", "0.7"]
    assert len(panel.lines) == 2  # dots alone


def test_a_difference_that_may_be_chance_is_said() -> None:
    assert "not told from blind" in JUDGES["feedback"](tunnel("closed", 100, 95, 0.06)).reason
    assert "not told from blind" not in JUDGES["feedback"](tunnel("closed", 100, 90, 0.002)).reason


def test_there_are_as_many_claims_as_asked_for_and_each_is_run() -> None:
    assert len({claim.name for claim in CLAIMS}) == len(CLAIMS) >= 14
    assert {claim.experiment for claim in CLAIMS} == set(reproduce.QUICK) == set(reproduce.FULL)


@pytest.mark.parametrize("quick", [True, False])
@pytest.mark.parametrize("name", list(reproduce.QUICK))
def test_the_command_beside_a_claim_runs_just_that(name: str, quick: bool) -> None:
    config = ReproduceConfig(quick=quick)
    words = shlex.split(reproduce.command(name, config))
    assert words[:2] == ["antennate", name]
    told = experiments.load(name).config
    parsed, _ = parse(name, "", told, words[2:], Options)
    assert parsed == told.model_validate(reproduce.settings(name, config))


def test_claims_of_what_ran_are_kept_and_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reproduce, "QUICK", {"springs": {}, "taper": {}})
    whole = EXPERIMENT.run(ReproduceConfig(quick=True), 1, lambda *_: None, lambda row: None)
    assert [row.verdict for row in whole.rows] == ["conditional", "conditional"]
    assert sum(whole.result()["verdicts"].values()) == 2
    said = EXPERIMENT.sentence(whole.result())
    assert f"Of {len(CLAIMS)} claims: 0 reproduced, 2 conditional" in said
    assert f", {len(CLAIMS) - 2} not judged." in said

    def interrupted(*_: Any) -> Any:
        raise KeyboardInterrupt

    load = experiments.load
    stopped = dataclasses.replace(load("taper"), run=interrupted)
    monkeypatch.setattr(experiments, "load", lambda n: stopped if n == "taper" else load(n))
    half = EXPERIMENT.run(ReproduceConfig(quick=True), 1, lambda *_: None, lambda row: None)
    assert half.interrupted
    assert [row.claim for row in half.rows] == [whole.rows[0].claim]


@pytest.mark.slow
def test_the_quick_run_judges_every_claim(tmp_path: Path) -> None:
    words = ["reproduce", "--quick", "--out", str(tmp_path / "run"), "--json"]
    command = [sys.executable, "-m", "antennate", *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert len(result["claims"]) == len(CLAIMS)
    keys = {"claim", "paper", "ours", "verdict", "reason", "command"}
    assert all(set(row) == keys and row["verdict"] in VERDICTS for row in result["claims"])
    assert len(list((tmp_path / "run" / "figures").glob("*.png"))) == len(CLAIMS)
    assert (tmp_path / "run" / "report.html").stat().st_size < 3e6
