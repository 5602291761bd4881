"""What is kept of a drive: every tick in one file, and its replay as a third world."""

from typing import Literal

FilmView = Literal["above", "side"]
"""From where a walk is filmed: from above and behind, or from the right of its way."""
