"""A page whose process dies while a run goes on, and one whose run has ended."""

import json
import os
import signal
import time
from pathlib import Path

import pytest
from browser import CHROMIUM, browser
from view_rig import PATIENCE, child_of, shown

pytestmark = pytest.mark.ci

SCALES = """JSON.stringify(Object.values(window.__viserTestpoints?.uplots ?? {}).map(
    each => [...['min', 'max'].map(end => Math.round(1e3 * each.chart.scales.x[end]) / 1e3),
             each.chart.axes[0]._values?.join()]))"""
"""The ends and the numbers [s] of the axis of time of each chart, in JavaScript."""
SECOND = "/open, trial 1[^]*time\\s+[2-9][0-9.]* s/.test(document.body.innerText)"
"""Whether the second trial has lasted for some seconds, in JavaScript."""


@pytest.mark.parametrize("what", ["view", "foxglove"])
def test_a_run_goes_on_without_a_page_whose_process_dies(what: str, tmp_path: Path) -> None:
    """It says so in one line, and its results are whole."""
    if what == "foxglove":
        pytest.importorskip("foxglove")
    words = f"tunnel --trials 1 --controllers open --scene flat --time-limit 3 --{what}"
    more = (f"--{what}-port", "0", "--out", "run")
    with shown(*words.split(), *more, folder=tmp_path) as view:
        view.said(f"{what}: ")
        while not (tmp_path / "run").exists():  # it begins once the page serves
            assert view.process.poll() is None, view.lines
            time.sleep(0.02)
        os.kill(child_of(view.process.pid), signal.SIGKILL)
        assert view.process.wait(PATIENCE) == 0
        said = view.said(f"{what}: expected its process to serve until the end")
        assert said.endswith("found that it ended with code -9; the run goes on without it\n")
        assert "".join(view.lines).count("expected") == 1
    assert len((tmp_path / "run" / "trials.csv").read_text().splitlines()) == 2


@pytest.mark.skipif(CHROMIUM is None, reason="no chromium here")
def test_a_page_of_two_trials_shows_ten_seconds_of_each_and_stays_when_they_have_ended(
    tmp_path: Path,
) -> None:
    """The last picture stays too."""
    words = "tunnel --trials 2 --controllers open --time-limit 5 --view --view-port 0 --out run"
    with (
        browser(tmp_path / "browser") as tab,
        shown(*words.split(), folder=tmp_path) as view,
    ):
        tab.draw_little()
        tab.open(view.link)
        tab.until(SECOND)
        wanted = json.dumps([[0, 1, "-10,-5,0"]] * 4, separators=(",", ":"))
        tab.until_is(SCALES, wanted)
        assert view.process.wait(PATIENCE) == 0
        tab.until("document.body.innerText.includes('The run has ended')")
        tab.until("document.body.innerText.includes('Results: run')")
        tab.until("/time\\s+(4[.]9|5[.]0)[0-9] s/.test(document.body.innerText)")
        assert tab.run("!!document.querySelector('svg polyline')")
        assert len(tab.picture()) > 50_000  # an empty scene has a tenth of it
