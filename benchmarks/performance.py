"""Measure what the page docs/performance.md tells, and write docs/performance.json.

All ratios of a part are taken in one run, in turn, on one machine: medians over repetitions with
the smallest and the largest. A part that is not asked for keeps its earlier figures. Nothing else
should run meanwhile; how busy other programs kept the machine is written beside each part.
`python docs/performance.py` then writes the page.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cores
import engines
import growth
import peers
import starting
import trial
from measuring import watched

RESULT = Path(__file__).parents[1] / "docs" / "performance.json"


def gpu(quick: bool) -> dict[str, Any]:
    """A batch on a GPU; it needs packages that are installed apart, see docs/gpu.md."""
    import gpu as batch

    return batch.measure([16, 64, 256, 1024, 4096][: 3 if quick else None], 5.0, None)


PARTS: dict[str, Callable[[bool], dict[str, Any]]] = {
    "trial": trial.measure,
    "tick": trial.measure_ticks,
    "engines": engines.measure,
    "agreement": engines.measure_agreement,
    "growth": growth.measure,
    "cores": cores.measure,
    "whole": starting.measure_whole,
    "dask": starting.measure_dask,
    "start": starting.measure_start,
    "peers": peers.measure,
    "gpu": gpu,
}
USUAL = tuple(name for name in PARTS if name not in ("agreement", "gpu"))


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small sizes, to see that it works")
    parser.add_argument(
        "--parts",
        nargs="+",
        choices=PARTS,
        default=USUAL,
        help="all but agreement, an hour, and gpu by default",
    )
    parser.add_argument("--out", type=Path, default=RESULT, help="file to write")
    options = parser.parse_args()
    kept = json.loads(options.out.read_text(encoding="utf-8")) if options.out.exists() else {}
    for name in options.parts:
        with watched(options.quick) as about:
            figures = PARTS[name](options.quick)
        kept[name] = {"about": about, "figures": figures}
        text = json.dumps({part: kept[part] for part in PARTS if part in kept}, indent=1)
        options.out.write_text(text + "\n", encoding="utf-8")
        sys.stderr.write(f"{name}: {about['seconds']} s, other programs {about['others']} cores\n")


if __name__ == "__main__":
    main()
