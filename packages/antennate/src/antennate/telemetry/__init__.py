"""What is kept of a walk: every tick in one file, its replay, its film, and pages that show it."""

from typing import Literal

FilmView = Literal["above", "side"]
"""From where a walk is filmed: from above and behind, or from the right of its way."""
PAGE_PORT = 8777
"""Usual port of the page (assumed: nothing known uses it)."""
FOXGLOVE_PORT = 8765
"""Usual port of the WebSocket of Foxglove."""
LAST_DOMAIN = 232
"""Largest number of a domain of ROS 2: ports of the next one would be beyond 65535."""


class Restart(Exception):
    """A person wants the trial anew, with a seed; a log from its beginning.

    Attributes:
        seed: The seed.
    """

    def __init__(self, seed: int) -> None:
        super().__init__(f"restart with seed {seed}")
        self.seed = seed
