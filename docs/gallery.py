"""Draw the pictures of docs/gallery.md, or see whether they are what the page says.

A heading of the page is a command, and the pictures below it are figures of its run. Without
options each command runs as it stands and its pictures go to docs/images; names of commands choose
some. `--quick FOLDER` runs them with few trials and puts the pictures there, which shows that all
can still be drawn. `--check` runs nothing: each picture is there and shown on a page, and every
experiment has its place in the gallery.
"""

import argparse
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from antennate import experiments
from antennate.cli import main as antennate
from antennate.messages import command_of, command_words

ROOT = Path(__file__).parent
IMAGES = ROOT / "images"
FIGURES = {
    "tunnel.png": "trajectories.png",
    "hexapod.png": "unknown.png",
    "study.png": "map.png",
    "geometry_agreement.png": "agreement.png",
    "geometry_leads.png": "leads.png",
    "geometry_front.png": "front.png",
    "geometry_torus.png": "torus.png",
    "geometry_twists.png": "twists.png",
    "climb_success.png": "success.png",
    "climb_side.png": "side.png",
    "climb_plan.png": "plan.png",
    "climb_felt.png": "felt.png",
}
"""Names in the run where they are not those of the picture."""
SCRIPTS = {
    "tunnel.webp": "film.py",
    "replay.png": "replay.py",
    "corridors.png": "scenes.py",
    "hard.png": "scenes.py",
    "leaderboard-ranks.png": "leaderboard.py",
}
"""What draws the pictures that no single command draws."""
FEW = {
    "bench force": "--profiles descending --speeds 0.15 --place-step 0.1",
    "gait": "--sweep-points 4 --cycles 2",
    "geometry": "--gaits 4 --wave-numbers 1 --leads 5 --front-waves 1 --turns 2 --repeats 2",
    "climb": "--trials 1 --heights 0.05 --grounds gap:0.1 --conditions climb --sensing 1 "
    "--time-limit 10",
    "gait --config examples/hexapod.toml": "--draws 5 --sweep-points 4",
    "study studies/wall_design.toml": "--trials 1",
    "bench sweep": "--profiles descending --estimate.trials 8",
    "dataset --seed 1": "--trials 10",
    "bench touch": "--trials 1 --speeds 0.15",
    "tunnel": "--trials 1 --time-limit 20",
    "bench wall": "--trials 1",
}
"""Options of --quick."""
_HEADING = re.compile(r"^## `antennate (.*?)`$", re.MULTILINE)
_PICTURE = re.compile(r"\]\((?:\.\./)?images/([^)]+)\)")


def gallery() -> dict[str, list[str]]:
    """Pictures of the page by the command that draws them."""
    _, *parts = _HEADING.split((ROOT / "gallery.md").read_text(encoding="utf-8"))
    return {
        words: _PICTURE.findall(text.partition("\n## ")[0])
        for words, text in zip(parts[::2], parts[1::2], strict=True)
    }


def check() -> None:
    """Compare the pictures with the pages, and the gallery with the experiments.

    Raises:
        SystemExit: A picture is missing, one is shown nowhere, the gallery lacks an experiment, or
            options of --quick are those of no command in it.
    """
    text = (ROOT / "gallery.md").read_text(encoding="utf-8")
    names = map(command_words, experiments.names())
    if lacks := [name for name in names if f"`antennate {name}" not in text]:
        raise SystemExit(f"docs/gallery.md: expected every experiment, lacks {', '.join(lacks)}")
    if unused := FEW.keys() - gallery().keys():
        raise SystemExit(f"docs/gallery.py: expected headings, found {', '.join(sorted(unused))}")
    pages = [*ROOT.rglob("*.md"), ROOT.parent / "README.md"]
    shown = {name for page in pages for name in _PICTURE.findall(page.read_text(encoding="utf-8"))}
    there = {path.name for path in IMAGES.iterdir()}
    for what, names in (("expected", shown - there), ("shown nowhere", there - shown)):
        if names:
            raise SystemExit(f"docs/images: {what}: {', '.join(sorted(names))}")


def draw(words: list[str], pictures: list[str], folder: Path) -> None:
    """Run a command and keep its pictures.

    Raises:
        SystemExit: The command failed, or did not draw one of them.
    """
    with tempfile.TemporaryDirectory() as run:
        if antennate([*words, "--out", f"{run}/run"]):
            raise SystemExit(f"antennate {shlex.join(words)}: expected exit code 0")
        for name in pictures:
            figure = Path(run, "run", "figures", FIGURES.get(name, name))
            if not figure.exists():
                raise SystemExit(f"antennate {shlex.join(words)}: expected {figure.name}")
            shutil.copyfile(figure, folder / name)


def main() -> None:
    """Draw, or look."""
    parser = argparse.ArgumentParser(description="Draw the pictures of docs/gallery.md")
    parser.add_argument("commands", nargs="*", metavar="COMMAND", help="those to draw, else all")
    parser.add_argument("--quick", type=Path, metavar="FOLDER", help="few trials, into a folder")
    parser.add_argument("--check", action="store_true", help="run nothing, compare names")
    options = parser.parse_args()
    if options.check:
        check()
        return
    for text, pictures in gallery().items():
        words = shlex.split(text)
        if options.commands and command_of(words) not in options.commands:
            continue
        by_script = [picture for picture in pictures if picture in SCRIPTS]
        figures = [picture for picture in pictures if picture not in SCRIPTS]
        if options.quick and figures:
            options.quick.mkdir(parents=True, exist_ok=True)
            draw([*words, *FEW.get(text, "").split()], figures, options.quick)
        elif not options.quick:
            if figures:
                draw(words, figures, IMAGES)
            for script in dict.fromkeys(SCRIPTS[picture] for picture in by_script):
                subprocess.run([sys.executable, ROOT / script], check=True)


if __name__ == "__main__":
    main()
