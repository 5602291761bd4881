"""What docs/science/corridors.md reports of the hard set: `python docs/science/hard.py FOLDER...`.

The folders are runs of `antennate tunnel` in scenes of the hard set with one seed. A controller
that walks by a clock of another length is another rival, and so is one that knows the side.
`closed` is compared, scene by scene, with the blind rival that was best there. It writes the table
of the page and docs/science/hard.json.
"""

from __future__ import annotations

import json
import sys
import tomllib
from pathlib import Path
from typing import Any

from corridors import HERE, OURS, Rows, against, alone, row, rows_of, shares, written

from antennate.sim.scenes.tunnel import HARD
from antennate.studies.statistics import difference95, holm

SIDE = "timed, knows side"
RIVALS = ("schedule", "timed 12 s", "timed 5 s")
"""Blind ones."""
PLAIN = "timed 5 s"
"""As it is without options: what knowledge of the side is compared with."""


def labelled(folder: Path) -> tuple[str, Rows]:
    """The scene of a run, and its rows by names that tell rivals apart."""
    config = tomllib.loads((folder / "config.toml").read_text())
    walk = config["control"]["timed"]["walk_time"]
    timed = SIDE if config["knows"] == ["side"] else f"timed {walk:.0f} s"
    rows = rows_of([folder])
    return config["scene"], {timed if name == "timed" else name: rows[name] for name in rows}


def judged(scenes: dict[str, Rows]) -> dict[str, Any]:
    """Each scene, and Holm's step-down over all of them."""
    result: dict[str, Any] = {}
    for scene, rows in scenes.items():
        alones = {name: alone(cell) for name, cell in rows.items()}
        best = min((name for name in RIVALS if name in rows), key=lambda n: alones[n]["share"])
        both = sorted(rows[OURS].keys() & rows[best].keys())
        pair = against(*(shares(rows[name], both) for name in (OURS, best)))
        result[scene] = {"controllers": alones, "best": best, "pair": pair}
        if SIDE in rows:
            result[scene]["saved"] = saved(rows)
    raised = holm([cell["pair"]["wilcoxon_p"] for cell in result.values()])
    for cell, p in zip(result.values(), raised, strict=True):
        cell["pair"]["holm_p"] = p
    return result


def saved(rows: Rows) -> dict[str, Any]:
    """Time that `closed`, and knowing the side, save against `timed` as it is [s]."""
    found = {}
    for name in (OURS, SIDE):
        both = sorted(rows[name].keys() & rows[PLAIN].keys())
        limit = float(rows[PLAIN][both[0]]["limit_s"])
        plain, ours = (limit * shares(rows[each], both) for each in (PLAIN, name))
        mean, ends = difference95(plain, ours, limit)
        found[name] = {"seconds": mean, "seconds_95": ends}
    return found


def table(result: dict[str, Any]) -> list[str]:
    """A line for each scene."""
    names = [
        name for name in (OURS, *RIVALS) if any(name in r["controllers"] for r in result.values())
    ]
    head = [row("scene", *(f"`{n}`" for n in names), "best blind", "`closed` against it [%]", "p")]
    lines = [*head, row(*["---"] * (len(names) + 4))]
    for scene in HARD:
        if scene not in result:
            continue
        cells, pair = result[scene]["controllers"], result[scene]["pair"]
        told = [
            f"{c['successes']} of {c['trials']}, {100 * c['share']:.0f} %" if c else ""
            for c in map(cells.get, names)
        ]
        low, high = (100 * end for end in pair["ratio_95"])
        ratio = f"{100 * pair['ratio']:+.0f} ({low:+.0f} to {high:+.0f})"
        lines += [row(f"`{scene}`", *told, result[scene]["best"], ratio, f"{pair['holm_p']:.2g}")]
    for scene in HARD:
        if "saved" in result.get(scene, {}):
            lines += ["", sentence(scene, result[scene])]
    return lines


def sentence(scene: str, result: dict[str, Any]) -> str:
    """What touch saves in a scene, and what the side would."""
    ours, side = (spoken(result["saved"][name]) for name in (OURS, SIDE))
    cell = result["controllers"][SIDE]
    return (
        f"`{scene}`: against `timed 5 s` `closed` {ours}; knowing the side {side} and crosses "
        f"{cell['successes']} of {cell['trials']}."
    )


def spoken(saved: dict[str, Any]) -> str:
    """Time that is saved or lost, with its interval [s]."""
    mean, (low, high) = saved["seconds"], saved["seconds_95"]
    if mean >= 0.0:
        return f"saves {mean:.1f} s ({low:.1f} to {high:.1f} s)"
    return f"loses {-mean:.1f} s ({-high:.1f} to {-low:.1f} s)"


def main(folders: list[Path]) -> None:
    """Write the table and the numbers."""
    scenes: dict[str, Rows] = {}
    for folder in folders:
        scene, rows = labelled(folder)
        scenes.setdefault(scene, {}).update(rows)
    result = judged(scenes)
    (HERE / "hard.json").write_text(json.dumps(result, indent=1) + "\n")
    written("hard", table(result))


if __name__ == "__main__":
    main([Path(word) for word in sys.argv[1:]])
