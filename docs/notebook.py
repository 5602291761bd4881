"""Run the notebooks in examples anew and keep what their cells show.

It needs packages of its own: `uv run --with nbclient --with ipykernel python docs/notebook.py`,
and names of notebooks if not all are meant. What tells of the machine or the time is left out.
"""

import sys
from importlib import import_module
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parents[1] / "examples"
NAMES = ("first_look", "geometry")
METADATA = {
    "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
    "language_info": {"name": "python"},
}


def run(path: Path) -> None:
    """Run a notebook in an empty place, and write it back."""
    nbformat: Any = import_module("nbformat")
    nbclient: Any = import_module("nbclient")
    notebook: Any = nbformat.read(path, as_version=4)
    nbclient.NotebookClient(notebook, timeout=600, record_timing=False).execute()
    notebook.metadata = METADATA
    for number, cell in enumerate(notebook.cells):
        cell.metadata, cell.id = {}, f"cell-{number}"
    path.write_text(nbformat.writes(notebook) + "\n", encoding="utf-8")


if __name__ == "__main__":
    for name in sys.argv[1:] or NAMES:
        run(FOLDER / f"{name}.ipynb")
