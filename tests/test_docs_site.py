"""The docs: tutorials that run as they stand, pages that can be found, lines that fit a page."""

from __future__ import annotations

import os
import re
import subprocess
import time
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from first_hour import Command
from pages import DOCS, Script, blocks, made_pages

import antennate
from antennate.cli import commands

TUTORIALS = ("controllers.md", "first-tunnel.md", "log.md", "robots.md", "studies.md")
"""Pages whose commands run as they stand, but for those in real time before a twin."""
SCENES = "scenes.md"
_LINK = re.compile(r"\]\(([^)\s#]+)")
WIDEST = 96
"""Letters of code in a line on a screen of 1280 pixels."""


@pytest.mark.slow
@pytest.mark.parametrize("page", TUTORIALS)
def test_a_tutorial_runs(page: str, tmp_path: Path) -> None:
    with Script(page, tmp_path, {}) as script:
        assert len(script.blocks) >= 5
        script.run()


def hold_marks(record: Command, script: Script) -> None:
    """Hold the antenna at each mark that is asked for."""
    assert script.twin is not None
    for _ in range(6 * 5):
        mark = record.until(r"hold at (\d+) mm")[1]
        script.twin.order(f"touch left:{mark}mm")
        time.sleep(0.3)  # the bend has to arrive before it is confirmed
        record.type()
    script.twin.order("touch left:0mm")


@pytest.mark.slow
def test_an_antenna_of_the_twin_is_calibrated(tmp_path: Path) -> None:
    with Script("calibrate.md", tmp_path, {"record": hold_marks}) as script:
        script.run()


@pytest.mark.slow
def test_the_twin_is_driven(tmp_path: Path) -> None:
    with Script("drive.md", tmp_path, {}) as script:
        script.run()


@pytest.mark.slow
def test_a_twin_is_recorded_fitted_simulated_and_compared(tmp_path: Path) -> None:
    """The hour of docs/fit.md, from a twin to its fitted robot, as its commands stand there."""
    with Script("fit.md", tmp_path, {}, patience=3600.0) as script:
        script.run()
    fitted = tomllib.loads((tmp_path / "fit-1" / "robot.toml").read_text())
    servo = fitted["servos"]["xc430_w240"]
    built = tomllib.loads((tmp_path / "built.toml").read_text())["servos"]["xc430_w240"]
    assert servo["gain_divisor"] == pytest.approx(built["gain_divisor"], rel=0.05)
    # Not its delay: that of the bus counts as the servo's, and nothing else tells how long it is.


@pytest.mark.ci
def test_the_robot_has_room_at_the_start_of_the_scene_of_the_page(tmp_path: Path) -> None:
    (text,) = (block.text for block in blocks(SCENES) if block.kind == "xml")
    (tmp_path / "room.xml").write_text(text)
    result = antennate.run(
        "tunnel",
        scene=str(tmp_path / "room.xml"),
        controllers=("open",),
        time_limit=0.1,
        trials=2,
        workers=1,
    )
    assert [row.outcome for row in result.rows] == ["timeout"] * 2


@pytest.mark.slow
def test_the_scene_of_the_page_is_crossed_as_it_says(tmp_path: Path) -> None:
    with Script(SCENES, tmp_path, {}) as script:
        script.blocks = [block for block in script.blocks if block.kind != "python"]
        script.run()


@pytest.mark.parametrize("page", sorted(str(p.relative_to(DOCS)) for p in DOCS.rglob("*.md")))
def test_no_line_of_code_is_wider_than_a_page(page: str) -> None:
    wide = [
        line for block in blocks(page) for line in block.text.splitlines() if len(line) > WIDEST
    ]
    assert wide == []


@pytest.mark.ci
def test_no_line_of_code_is_wider_than_a_page_that_is_made() -> None:
    for path in made_pages().values():
        test_no_line_of_code_is_wider_than_a_page(str(path))


@pytest.mark.ci
def test_every_page_has_its_own_name_in_the_navigation_or_is_linked_from_the_reference() -> None:
    site = tomllib.loads((DOCS.parent / "zensical.toml").read_text())

    def entries(level: list[dict[str, Any]]) -> Iterator[tuple[str, str]]:
        for entry in level:
            for name, content in entry.items():
                if isinstance(content, str):
                    yield content, name
                else:
                    yield from entries(content)

    found = {str(path.relative_to(DOCS)): path for path in DOCS.rglob("*.md")} | made_pages()
    titles = {
        name: re.findall("^# (.*)$", path.read_text(), re.MULTILINE)[0]
        for name, path in found.items()
    }
    menu = [*entries(site["project"]["nav"])]
    assert len(menu) == len(dict(menu))
    reference = re.findall(r"\]\((\S+\.md)\)", (DOCS / "reference.md").read_text())
    assert {*dict(menu), *reference} == {*titles}
    assert dict(menu) == {page: titles[page] for page in dict(menu)}


@pytest.mark.ci
def test_a_page_in_git_links_only_to_files_in_git() -> None:
    """Pages that docs/pages.py makes are missing where the repository is read."""
    listed = subprocess.run(
        ["git", "ls-files"], cwd=DOCS.parent, check=True, capture_output=True, text=True
    )
    files = listed.stdout.splitlines()
    known = {*files, *(str(folder) for file in files for folder in Path(file).parents)}
    links = [
        (page, link)
        for page in files
        if page.endswith(".md")
        for link in _LINK.findall((DOCS.parent / page).read_text(encoding="utf-8"))
        if not re.match(r"\w+:", link)
    ]
    assert len(links) > 100
    dead = [
        (page, link)
        for page, link in links
        if os.path.normpath(Path(page).parent / link) not in known
    ]
    assert dead == []


@pytest.mark.ci
def test_every_command_is_linked_where_the_list_of_commands_begins() -> None:
    begin, *sections = made_pages()["options.md"].read_text().split("\n## ")
    linked = re.findall(r"\[`([\w ]+)`\]\(#antennate-([\w-]+)\)", begin)
    assert [name.replace(" ", "-") for name, _ in linked] == [anchor for _, anchor in linked]
    assert {name for name, _ in linked} == set(commands())
    assert [f"`antennate {name}`" for name, _ in linked] == [s.splitlines()[0] for s in sections]
    assert "(commands.md)" in (DOCS / "index.md").read_text()


def test_the_glossary_is_in_order() -> None:
    words = re.findall(r"^\| (.+?) \|", (DOCS / "glossary.md").read_text(), re.MULTILINE)[1:]
    assert words == sorted(words, key=lambda word: word.casefold().replace("θ", "theta"))
