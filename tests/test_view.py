"""A live view in a browser: the scene is there, charts move, and what a person does is done."""

import io
import json
import re
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
import pytest
from browser import CHROMIUM, Tab, browser
from PIL import Image
from stated import STATED
from view_rig import PATIENCE, Shown, share_cores, shown, told

from antennate import simulate
from antennate.params.control import ControlParams, RuleParams
from antennate.telemetry.reader import LogReader
from antennate.telemetry.ticks import Tick
from antennate.telemetry.topics import EVENTS
from antennate.types import Contact, Ints

pytestmark = [
    pytest.mark.ci,
    pytest.mark.skipif(
        CHROMIUM is None, reason="no chromium here; `apt-get install chromium` brings it"
    ),
]

IMAGES = Path(__file__).parent.parent / "docs" / "images"
KNOWN = ("(in promise) EvalError", "'unsafe-eval' is not an allowed", "at wasm://wasm/")
"""A part of viser that is not used here, in WebAssembly, wants to make code of text."""

WIDTHS = "[...document.querySelectorAll('.uplot canvas')].map(e => e.clientWidth)"
TIME = "parseFloat(document.body.innerText.match(/time\\s+([0-9.]+) s/)[1])"
"""The time that the page shows, in JavaScript."""

NOTICE = ".mantine-Notification-root"
"""What the page says of a computer that draws slowly."""

Keep = Callable[..., None]


@pytest.fixture
def keep(request: pytest.FixtureRequest) -> Keep:
    """Keeps a picture of a page for the docs, if that is wanted, once something is true."""

    def picture(tab: Tab, name: str, when: str = "true") -> None:
        if request.config.getoption("--pictures"):
            tab.run(f"document.querySelectorAll('{NOTICE} button').forEach(e => e.click())")
            tab.until(f"!document.querySelector('{NOTICE}')")
            tab.until(when)
            data = tab.picture("webp", quality=60)
            (IMAGES / f"view-{name}.webp").write_bytes(data)

    return picture


@pytest.fixture
def tab(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Tab]:
    """A tab of a browser."""
    with browser(tmp_path / "browser") as found:
        if not request.config.getoption("--pictures"):
            found.draw_little()
        yield found


def opened(tab: Tab, view: Shown) -> None:
    """Open the page; return when its scene and its status are there."""
    tab.open(view.link)
    tab.until("!!document.querySelector('canvas')")
    tab.until("/time\\s+[0-9.]+ s/.test(document.body.innerText)")


def status(tab: Tab, name: str) -> str:
    """A line of the status on the page."""
    text = str(tab.run("document.getElementById('status').innerText"))
    found = re.search(rf"^{name}\s+(.*)$", text, re.M)
    assert found is not None, text
    return found[1]


def seconds(tab: Tab) -> float:
    """The time that the page shows [s]."""
    return float(status(tab, "time").split()[0])


def charts(tab: Tab) -> str:
    """What the charts have drawn, as one text."""
    return str(
        tab.run("[...document.querySelectorAll('.uplot canvas')].map(c => c.toDataURL()).join()")
    )


def coloured(tab: Tab) -> None:
    """Return once the scene is drawn: a slow page draws it late."""
    end = time.monotonic() + PATIENCE
    while (found := colours(tab)) <= 50:
        assert time.monotonic() < end, found
        time.sleep(0.2)


def charts_move(tab: Tab, before: str) -> None:
    """Return once the charts have drawn something else: a slow page draws them late."""
    end = time.monotonic() + PATIENCE
    while charts(tab) == before:
        assert time.monotonic() < end, before[:200]
        time.sleep(0.1)


def middle(tab: Tab) -> Ints:
    """The middle of the picture, shape (n, 3), 0 to 255."""
    picture = Image.open(io.BytesIO(tab.picture())).convert("RGB")
    width, height = picture.size
    part = picture.crop((width // 3, height // 4, 2 * width // 3, 3 * height // 4))
    return np.asarray(part, np.int64).reshape(-1, 3)


def colours(tab: Tab) -> int:
    """Different colours in the middle of the picture: one of an empty scene has few."""
    return len(np.unique(middle(tab), axis=0))


def stays_here(tab: Tab, view: Shown) -> None:
    """Nothing was asked for from elsewhere, and nothing else went wrong."""
    for address in tab.requests:
        parts = urlsplit(address)
        ours = parts.netloc == f"127.0.0.1:{view.port}" and parts.scheme in ("http", "ws")
        assert ours or parts.scheme in ("data", "blob"), address
    assert any(urlsplit(address).scheme == "ws" for address in tab.requests)
    gone = f"'ws://127.0.0.1:{view.port}/' failed"  # a page looks for a command that has ended
    ended = view.process.poll() is not None

    def known(trouble: str) -> bool:
        return all(part in trouble for part in KNOWN) or (ended and gone in trouble)

    assert [each for each in tab.troubles if not known(each)] == []


def test_a_person_changes_what_a_simulation_decides(tab: Tab, keep: Keep, tmp_path: Path) -> None:
    """θ goes from 0.98 to 0.3: until then all is as without a page, then contact begins at 0.3."""
    words = "tunnel --controllers paper --trials 1 --control.rule.threshold 0.98 --time-limit 12"
    more = ("--log", "--view", "--view-port", "0", "--view-speed", "0.25", "--out", "run")
    with shown(*words.split(), *more, "--view-paused", folder=tmp_path) as view:
        opened(tab, view)
        before = charts(tab)
        tab.click("label", "pause")  # it begins
        tab.until(f"{TIME} > 2")
        charts_move(tab, before)
        tab.click("label", "pause")
        tab.until("!!document.querySelector('svg polyline')")
        coloured(tab)
        red, _, blue = middle(tab).T  # sand-coloured obstacles differ by 56, washed out ones by 8
        assert (red - blue > 24).mean() > 0.05
        tab.fill("θ: level that is contact", "0.3")
        tab.until("document.body.innerText.includes('by hand: control.rule.threshold = 0.3')")
        tab.click("label", "pause")
        tab.until(f"{TIME} > 4")
        keep(tab, "tunnel")
        tab.choose("speed", "max")
        assert view.process.wait(PATIENCE) == 0
        stays_here(tab, view)
    run = tmp_path / "run"
    assert "control.rule.threshold = 0.3" in (run / "by-hand.txt").read_text()
    assert "not follow from its configuration" in (run / "report.html").read_text()
    ticks, changed = read_log(run / "logs" / "paper-0.mcap")
    assert 0 < changed < len(ticks)
    control = ControlParams(rule=RuleParams(threshold=0.98))
    alone = simulate("paper", control=control, time_limit=12.0)
    assert [tick.maneuver for tick in ticks[:changed]] == alone.maneuver[:changed].tolist()
    held = control.rule.hysteresis
    for number, tick in enumerate(ticks):
        for level, contact in zip(tick.level, tick.contact, strict=True):
            if number < changed and level < 0.98 - held:
                assert contact == Contact.FREE
            if number > changed and level >= 0.3:
                assert contact == Contact.CONTACT
    later = [max(tick.level) for tick in ticks[changed + 1 :]]
    assert any(0.3 <= level < 0.98 - held for level in later)


def read_log(path: Path) -> tuple[list[Tick], int]:
    """The ticks of a log, and how many of them there were before something was done by hand."""
    ticks, changed = list[Tick](), 0
    with LogReader(path) as log:
        for records, tick in log.groups():
            for record in records:
                if record.topic is EVENTS and "by hand" in EVENTS.type.decode(record.data)["msg"]:
                    changed = changed or record.number
            if tick is not None:
                ticks.append(tick)
    return ticks, changed


def test_a_phone_shows_the_scene_above_the_panel_and_dark_where_it_is_dark(
    tab: Tab, tmp_path: Path
) -> None:
    """In a window of 390 by 844 pixels nothing lies over the scene, and nothing is cut off."""
    size: dict[str, Any] = {"width": 390, "height": 844, "deviceScaleFactor": 1, "mobile": True}
    tab.call("Emulation.setDeviceMetricsOverride", **size)
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    tab.call("Emulation.setEmulatedMedia", features=dark)
    words = "tunnel --controllers open --trials 1 --view --view-paused --view-port 0"
    with shown(*words.split(), folder=tmp_path) as view:
        opened(tab, view)
        assert tab.run("document.documentElement.dataset.mantineColorScheme") == "dark"
        place = "JSON.stringify(document.querySelector('%s').getBoundingClientRect())"
        scene = json.loads(tab.run(place % "canvas"))
        status_ = json.loads(tab.run(place % "#status"))
        assert (scene["left"], scene["right"], scene["top"]) == (0, 390, 0)
        assert 300 < scene["bottom"] <= status_["top"] < status_["bottom"] <= 844
        assert tab.run("document.documentElement.scrollWidth") <= 390
        stays_here(tab, view)


def test_a_person_stops_steps_and_begins_anew(tab: Tab, tmp_path: Path) -> None:
    """A pause stops time, a step is one control period, a restart has the seed that is wanted."""
    words = "tunnel --controllers open --trials 1 --time-limit 20 --view --view-port 0 --out run"
    with shown(*words.split(), "--view-paused", folder=tmp_path) as view:
        opened(tab, view)
        stood = settled(tab)
        tab.click("button", "one step")
        tab.until(f"!document.body.innerText.includes('{stood:.2f} s')")
        assert settled(tab) == pytest.approx(stood + 0.01)
        drag_a_cylinder(tab)
        tab.fill("seed", "7")
        tab.click("button", "restart with this seed")
        tab.until("!document.body.innerText.includes('by hand: obstacle')")  # another scene
        tab.until("/time\\s+0\\.0[0-9] s/.test(document.body.innerText)")
        go_on(tab)
        tab.choose("speed", "max")
        assert view.process.wait(PATIENCE) == 0
    run = tmp_path / "run"
    lines = (run / "by-hand.txt").read_text()
    assert "begun anew with seed 7" in lines
    assert re.search(r"obstacle \d+ moved to x = -?[0-9.]+ m, y = -?[0-9.]+ m", lines)
    rows = (run / "trials.csv").read_text().splitlines()
    assert dict(zip(rows[0].split(","), rows[1].split(","), strict=True))["seed"] == "7"
    assert json.loads((run / "result.json").read_text())["seed"] == 0  # that of the configuration


def drag_a_cylinder(tab: Tab) -> None:
    """Drag from one place of the picture after the other until one of them was on a cylinder."""
    for y in range(150, 700, 60):
        for x in range(360, 860, 70):
            tab.drag((x, y), (x + 10, y), (x + 25, y + 5), (x + 40, y + 10))
            time.sleep(0.3)
            if tab.run("document.body.innerText.includes('by hand: obstacle')"):
                return
    raise AssertionError("no cylinder was moved")


def go_on(tab: Tab) -> None:
    """End a pause. The controls are made anew with a scene, and a click on the old ones is lost."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        stood = settled(tab)
        tab.click("label", "pause")
        for _ in range(50):
            time.sleep(0.1)
            if seconds(tab) != stood:
                return
    raise AssertionError("the pause does not end")


def settled(tab: Tab) -> float:
    """The time that the page shows once it stands [s]."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        before = seconds(tab)
        time.sleep(0.5)
        if seconds(tab) == before:
            return before
    raise AssertionError("time does not stand")


def looked_at(tab: Tab, view: Shown) -> None:
    """The page of a robot: read only, with a scene, and nothing from elsewhere."""
    coloured(tab)
    assert not tab.run("/pause|one step|restart|θ: level/.test(document.body.innerText)")
    stays_here(tab, view)
    tab.requests.clear()


def driven_shown(tab: Tab, keep: Keep, driven: Shown) -> None:
    """Its charts move, and it says what the supervisor does and what was missed."""
    opened(tab, driven)
    tab.until(f"(w => w.length >= 5 && w.every(e => e > 200))({WIDTHS})")
    before, begin = charts(tab), seconds(tab)
    assert status(tab, "supervisor")
    assert "frames" in status(tab, "counters")
    text = str(tab.run("document.body.innerText"))
    assert "missed answers" in status(tab, "counters")
    assert "missed answers" in text.partition("counted in these seconds")[2]
    tab.until(f"{TIME} > {begin + 1}")
    charts_move(tab, before)
    tab.until(f"{TIME} > 12")  # the touch has changed the limits of the readings by then
    tab.until(f"(w => w.length >= 5 && w.every(e => e === w[0] && e > 200))({WIDTHS})")
    keep(tab, "drive", "/maneuver\\s+(forward|turn|reverse)/.test(document.body.innerText)")
    looked_at(tab, driven)


def test_X23_a_drive_and_its_twin_are_shown(
    tab: Tab, keep: Keep, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    """It walks for pictures alone: beside a browser, two cores are too few for real time."""
    twin = ("twin", "--view", "--view-port", "0", "--duration", "600", "--touch", "left@8s")
    with shown(*twin, folder=tmp_path) as served:
        paths = json.loads(served.answer())
        share_cores(served)
        walks = request.config.getoption("--pictures")
        words = ["drive", "--no-touch-check", "--out", "run", "--view", "--view-port", "0"]
        words += ["--arm", "--duration", "600"] if walks else ["--dry-run", "600"]
        words += STATED
        words += ["--esp32", paths["esp32"], "--bus", paths["bus"]]
        with shown(*words, folder=tmp_path) as driven:
            told(driven, "missed_ticks=")  # it is shown, and its page serves
            share_cores(driven)
            driven_shown(tab, keep, driven)
            opened(tab, served)
            looked_at(tab, served)
            driven.process.send_signal(signal.SIGINT)
            driven.process.wait(PATIENCE)
    assert json.loads((tmp_path / "run" / "result.json").read_text())["ended"] == "a signal"
    assert (tmp_path / "run" / "drive.mcap").exists()
