"""Make the pages of the site that are not in git: `python docs/pages.py`, or into a FOLDER."""

import runpy
import sys
from pathlib import Path

import generated

SCRIPTS = ("commands", "names", "parameters", "performance", "reliability", "topics")


def main(folder: Path = generated.folder) -> None:
    """Run the script of each page."""
    generated.folder = folder
    for name in SCRIPTS:
        runpy.run_path(str(Path(__file__).with_name(f"{name}.py")), run_name="__main__")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
