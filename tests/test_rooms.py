"""Each distribution alone: what it imports, one version; each builds, installs and runs."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

import antennate
import antennate_build
import antennate_lab
import dynamixel_bus
import geometric_locomotion
from antennate.experiments import ELSEWHERE, GROUP

ROOT = Path(__file__).parents[1]
ROOMS = {
    "dynamixel-bus": {"numpy"},
    "geometric-locomotion": {"numpy", "scipy"},
}
"""Distributions that need none of ours, and all that is in an environment with one of them."""
UPPER = {
    "antennate": {*ROOMS},
    "antennate-build": {"antennate"},
    "antennate-lab": {*ROOMS, "antennate"},
}
"""Distributions that need others of ours, and those."""
EXAMPLE = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FOLDERS = (
    ".ci",
    "benchmarks",
    "docs",
    "entries",
    "examples",
    "packages",
    "studies",
    "tests",
)
SUFFIXES = {"", ".ipynb", ".md", ".py", ".sh", ".toml"}
"""Where something may tell how to install."""
PIP = re.compile(r"(?<!uv )pip install ([^\n`#]*)")
OWN_FOLDER = re.compile(r"(^|\s)['\"]?\.(/antennate)?(/packages/antennate\S*)?(['\"\s\[]|$)")
"""A word for the repository or the folder of a distribution in UPPER, perhaps with extras."""
SDK = """
import json, subprocess, sys
from dynamixel_sdk import COMM_SUCCESS, PacketHandler, PortHandler, port_handler

port_handler.LATENCY_TIMER = 500  # a busy computer
words = [f"{i}:xc430-w240" if i < 18 else f"{i}:xl330-m288" for i in range(1, 20)]
with subprocess.Popen([sys.argv[1], *words, "--duration", "60"], stdout=subprocess.PIPE) as bus:
    port = PortHandler(json.loads(bus.stdout.readline())["bus"])
    assert port.openPort() and port.setBaudRate(57_600)
    found, result = PacketHandler(2.0).broadcastPing(port)
    assert result == COMM_SUCCESS, result
    print(sorted((i, model) for i, (model, _) in found.items()))
    port.closePort()
    bus.kill()
"""


def first_example(room: str) -> str:
    text = (ROOT / "packages" / room / "README.md").read_text(encoding="utf-8")
    return EXAMPLE.findall(text)[0]


def installed_by_pip() -> Iterator[tuple[Path, str]]:
    """Files of the repository and what they tell pip to install."""
    files = [*ROOT.glob("*"), *(path for folder in FOLDERS for path in (ROOT / folder).rglob("*"))]
    for path in files:
        if path.suffix in SUFFIXES and path.is_file():
            for words in PIP.findall(path.read_text(encoding="utf-8", errors="ignore")):
                yield path.relative_to(ROOT), words


def done(*words: object, folder: Path | None = None) -> str:
    """What a program prints."""
    ran = subprocess.run(
        [str(word) for word in words], capture_output=True, text=True, cwd=folder, timeout=600
    )
    assert ran.returncode == 0, f"{words}: {ran.stdout[-1000:]}{ran.stderr[-2000:]}"
    return ran.stdout


@pytest.fixture(scope="module")
def uv() -> str:
    found = os.environ.get("UV") or shutil.which("uv")
    if not found:
        pytest.skip("uv builds and installs here")
    return found


def environment(uv: str, folder: Path, *installed: object) -> Path:
    """The folder of programs of a new environment with these."""
    done(uv, "venv", "--python", sys.executable, folder)
    done(uv, "pip", "install", "--python", folder / "bin" / "python", *installed, folder=folder)
    return folder / "bin"


def packages_of(uv: str, programs: Path) -> set[str]:
    listed = done(uv, "pip", "freeze", "--python", programs / "python", folder=programs)
    return {re.split(r"==| @ ", line)[0] for line in listed.splitlines()}


def imported(file: Path) -> Iterator[str]:
    """Modules that a file imports when it runs; types alone are no import."""
    nodes: list[ast.AST] = [ast.parse(file.read_text(encoding="utf-8"))]
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif not (isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"):
            nodes += ast.iter_child_nodes(node)


@pytest.mark.ci
def test_imports_go_down_in_the_drawing_of_the_rooms() -> None:
    """That of CONTRIBUTING.md, from top to bottom; the two lowest import none of ours."""
    drawn = re.findall(r"^packages/([\w-]+)/", (ROOT / "CONTRIBUTING.md").read_text(), re.MULTILINE)
    assert set(drawn) == {*ROOMS, *UPPER}
    names = {room.replace("-", "_"): room for room in drawn}
    for i, room in enumerate(drawn):
        files = (ROOT / "packages" / room / "src").rglob("*.py")
        tops = {name.partition(".")[0] for file in files for name in imported(file)}
        others = {names[top] for top in tops & names.keys()} - {room}
        assert others <= (set() if room in ROOMS else {*drawn[i + 1 :]}), room


def test_imports_go_down_in_the_table_of_layers() -> None:
    text = (ROOT / "CONTRIBUTING.md").read_text().partition("| package | what it holds |")[2]
    rows = [
        re.findall(r"`(\w+)`", row) for row in re.findall(r"^\| (`[^|]*) \|", text, re.MULTILINE)
    ]
    rank = {name: i for i, row in enumerate(rows) for name in row}
    root = ROOT / "packages" / "antennate" / "src" / "antennate"
    assert {path.name for path in root.iterdir() if (path / "__init__.py").is_file()} <= {*rank}
    for file in root.rglob("*.py"):
        layer = file.relative_to(root).parts[0].removesuffix(".py")
        for name in imported(file) if layer in rank else ():
            other = name.removeprefix("antennate.").partition(".")[0]
            if name.startswith("antennate.") and other in rank:
                assert rank[layer] <= rank[other], f"{file}: {name}"


def test_all_have_one_version() -> None:
    """The version of `antennate` is that of the others, which it asks for."""
    version = antennate.__version__
    assert antennate_lab.__version__ == antennate_build.__version__ == version
    assert dynamixel_bus.__version__ == geometric_locomotion.__version__ == version
    assert {path.name for path in (ROOT / "packages").iterdir()} == {*ROOMS, *UPPER}


@pytest.mark.parametrize("room", UPPER)
def test_one_asks_for_the_others_that_it_needs_in_that_version(room: str) -> None:
    project = tomllib.loads((ROOT / "packages" / room / "pyproject.toml").read_text())["project"]
    needed = {need for need in project["dependencies"] if "==" in need}
    assert needed == {f"{other}=={antennate.__version__}" for other in UPPER[room]}


def test_experiments_of_other_distributions_are_named_where_these_are_missed() -> None:
    found = {}
    for room in ("antennate-lab", "antennate-build"):
        text = (ROOT / "packages" / room / "pyproject.toml").read_text()
        entries = tomllib.loads(text)["project"]["entry-points"][GROUP]
        found |= dict.fromkeys(entries, room)
    assert found == ELSEWHERE


@pytest.mark.parametrize("room", [*ROOMS, *UPPER])
def test_a_readme_says_in_ten_lines_what_it_is(room: str) -> None:
    text = (ROOT / "packages" / room / "README.md").read_text(encoding="utf-8")
    assert text.startswith(f"# {room}\n")
    head = text.partition("```python")[0].strip().splitlines()
    assert len([line for line in head[1:] if line]) <= 10


@pytest.mark.parametrize("room", [*ROOMS, *UPPER])
def test_a_readme_has_no_link_into_the_repository(room: str) -> None:
    """A package index shows the page without the repository around it."""
    text = (ROOT / "packages" / room / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"\]\((?!https?://|#)[^)]*\)", text) == []


def test_all_that_tells_pip_to_install_antennate_names_the_others() -> None:
    """They are on no index, so pip finds them in the folder alone; uv knows where they are."""
    told = [(path, words) for path, words in installed_by_pip() if OWN_FOLDER.search(words)]
    assert Path("docs", "install.md") in dict(told)
    lower = [f"./packages/{room}" for room in ROOMS]
    all_named = [
        "/packages/*" in words or all(room in words.split() for room in lower) for _, words in told
    ]
    assert [pair for pair, named in zip(told, all_named, strict=True) if not named] == []


def test_purcells_swimmer_takes_eight_lines() -> None:
    lines = [line for line in first_example("geometric-locomotion").splitlines() if line]
    assert len(lines) == 8


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["whl", "tar.gz"])
@pytest.mark.parametrize("room", ROOMS)
def test_one_alone_runs_its_first_example(room: str, kind: str, uv: str, tmp_path: Path) -> None:
    """From the sdist, too, a wheel is made, and nothing of the others is there."""
    built = tmp_path / "built"
    form = "--wheel" if kind == "whl" else "--sdist"
    done(uv, "build", form, ROOT / "packages" / room, "--out-dir", built)
    (file,) = built.glob(f"*.{kind}")
    programs = environment(uv, tmp_path / "alone", file)
    assert packages_of(uv, programs) == {room, *ROOMS[room]}
    script = tmp_path / "example.py"
    script.write_text(first_example(room), encoding="utf-8")
    said = done(programs / "python", "-W", "error", script, folder=tmp_path)
    expected = {"dynamixel-bus": "{1: 2500, 2: 2048}\n", "geometric-locomotion": "farthest: 0.1035"}
    assert expected[room] in said
    if room == "dynamixel-bus":
        assert done(programs / room, "--version") == f"{antennate.__version__}\n"


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["whl", "tar.gz"])
@pytest.mark.parametrize(
    ("room", "expected"),
    [
        ("antennate", "success"),
        ("antennate-lab", "m/s"),
        ("antennate-build", "3 turns of 0.50 mm: -0.8 %"),
    ],
)
def test_one_runs_its_first_example_beside_those_that_it_needs(
    room: str, expected: str, kind: str, uv: str, tmp_path: Path
) -> None:
    built, folder = tmp_path / "built", ROOT / "packages" / room
    done(uv, "build", "--wheel" if kind == "whl" else "--sdist", folder, "--out-dir", built)
    (file,) = built.glob(f"{room.replace('-', '_')}-*.{kind}")
    needed = UPPER[room] | set(ROOMS)
    others = [ROOT / "packages" / other for other in needed]
    programs = environment(uv, tmp_path / "alone", file, *others)
    script = tmp_path / "example.py"
    script.write_text(first_example(room))
    assert expected in done(programs / "python", script, folder=tmp_path)
    if room == "antennate":
        words = [programs / "antennate", "compete", "--help"]
        refused = subprocess.run(words, capture_output=True, text=True, check=False)
        assert (refused.returncode, refused.stdout) == (2, "")
        assert "expected the package antennate-lab, which has compete" in refused.stderr


@pytest.mark.slow
def test_the_official_sdk_finds_nineteen_servos_of_the_bus_alone(uv: str, tmp_path: Path) -> None:
    """Model numbers are those of the manual: 1080 of the XC430-W240, 1200 of the XL330-M288."""
    programs = environment(
        uv, tmp_path / "alone", ROOT / "packages" / "dynamixel-bus", "dynamixel-sdk"
    )
    assert packages_of(uv, programs) == {"dynamixel-bus", "dynamixel-sdk", "numpy", "pyserial"}
    said = done(programs / "python", "-c", SDK, programs / "dynamixel-bus", folder=tmp_path)
    models = [(i, 1080 if i <= 17 else 1200) for i in range(1, 20)]
    assert said == f"{models}\n"


@pytest.mark.slow
def test_pip_installs_all_of_them(tmp_path: Path) -> None:
    """As docs/install.md says it, without uv."""
    done(sys.executable, "-m", "venv", tmp_path / "all")
    programs = tmp_path / "all" / "bin"
    rooms = sorted((ROOT / "packages").iterdir())
    done(programs / "pip", "install", "--quiet", *rooms, folder=tmp_path)
    said = done(programs / "antennate", "tunnel", "--help", folder=tmp_path)
    assert said.startswith("usage: antennate tunnel")
    for word in ("dynamixel_bus", "geometric_locomotion", "antennate"):
        place = f"import {word}; print({word}.__file__)"
        assert str(tmp_path) in done(programs / "python", "-c", place, folder=tmp_path)
