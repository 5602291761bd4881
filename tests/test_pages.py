"""Reports and the docs site in a browser: wide and as on a phone, light and dark."""

import functools
import http.server
import shutil
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import pytest
from browser import CHROMIUM, Tab, browser

import antennate
from antennate.cli import main

pytestmark = [
    pytest.mark.ci,
    pytest.mark.skipif(
        CHROMIUM is None, reason="no chromium here; `apt-get install chromium` brings it"
    ),
]
ROOT = Path(__file__).parent.parent
LOOKS = [(width, scheme) for width in (1280, 390) for scheme in ("light", "dark")]
PAGES = (*("", "log/", "commands/", "performance/", "reliability/", "hardware/", "controllers/"),)
"""Pages of the docs that are looked at."""
READABLE = 4.5
"""Least contrast of text (WCAG 2.2, level AA)."""
LEAST = 0.75
"""Letters of figures have 9 points; so much smaller they still are as those of a footnote."""
CONTRAST = """((selector) => {
  const light = text => {
    const draw = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
    draw.fillStyle = text; draw.fillRect(0, 0, 1, 1);
    const [r, g, b] = [...draw.getImageData(0, 0, 1, 1).data].slice(0, 3).map(v => {
      v /= 255; return v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4; });
    return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05; };
  const clear = colour => colour == 'transparent' || /, 0\\)$/.test(colour);
  return Math.min(...[...document.querySelectorAll(selector)].map(e => {
    let below = e;
    while (below && clear(getComputedStyle(below).backgroundColor)) below = below.parentElement;
    const page = getComputedStyle(document.documentElement).backgroundColor;
    const under = below ? getComputedStyle(below).backgroundColor : clear(page) ? 'white' : page;
    const [a, b] = [light(getComputedStyle(e).color), light(under)];
    return Math.max(a, b) / Math.min(a, b); })); })"""
"""The least contrast between the text of some elements and what is behind it."""
ENLARGED, FILLED = 1.2, 0.85
"""On a screen a figure is so much larger than drawn, and the page takes so much of the width."""
SPREAD = """(boxes => [Math.min(...boxes.map(b => b.left)), Math.max(...boxes.map(b => b.right))])(
  [...document.querySelectorAll('img, table, p')].map(e => e.getBoundingClientRect()))"""
"""From the left end of figures, tables and texts to the right end."""
FIGURES = """[...document.images].map(e => [e.clientWidth / parseFloat(e.getAttribute('width')),
  getComputedStyle(e).backgroundColor, getComputedStyle(e).filter])"""
"""Of each figure: its width as part of the drawn one, what is behind it, what changes it."""

CUT_OFF = """(() => {
  const width = document.documentElement.clientWidth;
  const diagrams = [...document.querySelectorAll('article .language-text code')].filter(
    e => /[▲▼►→]/.test(e.textContent));
  return [...document.querySelectorAll('article :is(h1, h2, h3, p, li, td, th, img, td code)'),
    ...diagrams.flatMap(e => [...e.querySelectorAll('span')])].filter(e => {
      const box = e.getBoundingClientRect();
      return box.width && (box.left < 0 || box.right > width); }).map(e => e.textContent); })()"""
"""What is beyond the borders of the page, also in a box that scrolls. Lines of code may be."""


@contextmanager
def looked_at(tab: Tab, address: str, width: int, scheme: str) -> Iterator[None]:
    """A page at a width, light or dark; that it keeps to its width and asks for nothing else."""
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
    tab.call("Emulation.setDeviceMetricsOverride", **size)
    tab.call(
        "Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}]
    )
    tab.requests.clear()
    tab.open("about:blank")
    tab.open(address)
    tab.until("location.href != 'about:blank' && document.readyState == 'complete'")
    assert tab.run("document.documentElement.scrollWidth") <= width
    yield
    ours = ("/".join(address.split("/", 3)[:3]), "data:", "about:")
    assert [each for each in tab.requests if not each.startswith(ours)] == []
    assert tab.troubles == []


def test_a_report_is_read_on_a_screen_and_on_a_phone(tmp_path: Path) -> None:
    settings = {"trials": 2, "time_limit": 1.0, "controllers": ("open", "closed")}
    antennate.run("tunnel", out=tmp_path / "run", workers=1, **settings)
    address = (tmp_path / "run" / "report.html").as_uri()
    with browser(tmp_path / "browser") as tab:
        for width, scheme in LOOKS:
            with looked_at(tab, address, width, scheme):
                first, last = tab.run(SPREAD)
                assert (last - first) / width >= FILLED, (width, scheme)
                text = tab.run(f"{CONTRAST}('p, td, th, h1, h2, figcaption, dt, code')")
                assert text >= READABLE, (width, scheme)
                figures = tab.run(FIGURES)
                assert len(figures) == len([*(tmp_path / "run" / "figures").glob("*.svg")]) > 1
                assert width < 1000 or max(share for share, *_ in figures) > ENLARGED
                for share, behind, change in figures:
                    assert share >= LEAST
                    assert change == "none"
                    assert scheme == "light" or behind == "rgb(255, 255, 255)"


def test_on_a_phone_every_column_of_a_comparison_is_seen_and_what_is_wider_says_so(
    tmp_path: Path,
) -> None:
    three = ("open", "paper", "closed")  # beside one another, wider than a phone
    settings = {"trials": 2, "time_limit": 4.0, "seed": 5, "controllers": three}
    antennate.run("tunnel", out=tmp_path / "one", **settings)
    words = ["report", "--compare", str(tmp_path / "one"), str(tmp_path / "one")]
    assert main([*words, "--out", str(tmp_path / "both.html")]) == 0
    hidden = """[...document.querySelectorAll('table.numbers :is(td, th)')].filter(
        e => e.getBoundingClientRect().right > innerWidth).length"""
    hinted = """[...document.querySelectorAll('figure')].map(e => [
        e.querySelector('.scroll').scrollWidth > e.clientWidth,
        getComputedStyle(e.querySelector('figcaption'), '::after').content != 'none'])"""
    with browser(tmp_path / "browser") as tab:
        for page in ("one/report.html", "both.html"):
            with looked_at(tab, (tmp_path / page).as_uri(), 390, "light"):
                assert tab.run(hidden) == 0, page
                assert {tuple(each) for each in tab.run(hinted)} == {(True, True), (False, False)}


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The docs as they are published, on a port of this computer: the address."""
    if find_spec("zensical") is None:
        pytest.skip("zensical is not installed; `--group docs` brings it")
    folder = tmp_path_factory.mktemp("site")
    shutil.copytree(ROOT / "docs", folder / "docs")
    shutil.copy(ROOT / "zensical.toml", folder)
    for name in ("CHANGELOG.md", "README.md"):
        shutil.copy(ROOT / name, folder)
    words = [str(Path(sys.executable).with_name("zensical")), "build", "--clean", "--strict"]
    subprocess.run(words, cwd=folder, check=True, capture_output=True)
    handler = functools.partial(Quiet, directory=str(folder / "site"))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class Quiet(http.server.SimpleHTTPRequestHandler):
    """Serves files and says nothing."""

    def log_message(self, *_: object) -> None:
        """Nothing."""


def test_the_docs_are_read_on_a_screen_and_on_a_phone(site: str, tmp_path: Path) -> None:
    with browser(tmp_path / "browser") as tab:
        for page in PAGES:
            for width, scheme in LOOKS:
                with looked_at(tab, f"{site}/{page}", width, scheme):
                    text = tab.run(f"{CONTRAST}('article p, article li, article td, article h1')")
                    assert text >= READABLE, (page, width, scheme)
                    assert tab.run(CUT_OFF) == [], (page, width, scheme)


def test_a_table_too_wide_for_a_phone_shows_each_cell_with_its_head(
    site: str, tmp_path: Path
) -> None:
    """The first row of the aims: what, aim, measured, and whether it is met; turned to a screen,
    it is a table again."""
    first = "document.querySelector('article table')"
    cells = f"[...{first}.querySelectorAll('tbody tr:first-child td')]"
    tops = f"new Set({cells}.map(e => e.getBoundingClientRect().top)).size"
    heads = f"{cells}.map(e => getComputedStyle(e, '::before').content)"
    with browser(tmp_path / "browser") as tab:
        with looked_at(tab, f"{site}/performance/", 390, "light"):
            assert tab.run(tops) == 4
            assert tab.run(heads) == ["none", '"aim: "', '"measured: "', "none"]
        size = {"width": 1280, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        tab.call("Emulation.setDeviceMetricsOverride", **size)
        assert tab.until(f"{tops} == 1")
        assert tab.run(heads) == ["none"] * 4


def test_a_stacked_table_says_what_its_rows_are(site: str, tmp_path: Path) -> None:
    """Two tables of one page differ in nothing but their first head."""
    tables = "[...document.querySelectorAll('article table[data-stacked]')]"
    seen = "[...e.querySelectorAll('th')].filter(h => h.offsetHeight).map(h => h.textContent)"
    with (
        browser(tmp_path / "browser") as tab,
        looked_at(tab, f"{site}/science/active/", 390, "light"),
    ):
        found = tab.run(f"{tables}.map(e => {seen})")
    assert found == [[], ["distance to the wall"], ["width of the gap"]]


def test_a_table_a_little_too_wide_for_a_screen_stays_a_table(site: str, tmp_path: Path) -> None:
    """The board has nine columns and its scenes eleven; on a phone their rows are stacked."""
    count = "document.querySelectorAll('article table[data-{}]').length".format
    with browser(tmp_path / "browser") as tab:
        with looked_at(tab, f"{site}/leaderboard/", 1280, "light"):
            assert (tab.run(count("stacked")), tab.run(count("close"))) == (0, 3)
            assert tab.run(CUT_OFF) == []
        with looked_at(tab, f"{site}/leaderboard/", 390, "light"):
            assert tab.run(count("stacked")) >= 3
            assert tab.run(count("close")) == 0
