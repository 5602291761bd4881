"""The live view: a page of this computer that shows a robot while it walks.

A process of its own serves the page. A loop or a simulation sends it small messages and never
waits for it.
"""

from __future__ import annotations

PAGE_PORT = 8777
"""Usual port of the page (assumed: nothing known uses it)."""
FOXGLOVE_PORT = 8765
"""Usual port of the WebSocket of Foxglove."""


class Restart(Exception):
    """A person wants the trial anew, with a seed; a log from its beginning.

    Attributes:
        seed: The seed.
    """

    def __init__(self, seed: int) -> None:
        super().__init__(f"restart with seed {seed}")
        self.seed = seed
