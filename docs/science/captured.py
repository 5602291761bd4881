"""What motion capture adds to a fit: `python docs/science/captured.py FOLDER`.

One robot is hidden, of which only the friction of the legs differs from the default robot with an
inertial sensor. It goes through the steps of `identify` on the floor as in `identified.py`, seen by
motion capture. `antennate fit` gets its log without the poses, then with them. FOLDER/captured.csv
has each number by both.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas as pd
from identified import CONTROL, KNOWN, hidden, record

from antennate.control.protocol import Protocol
from antennate.params.base import put_over
from antennate.robots.spec import RobotSpec
from antennate_lab.fit.config import FitConfig
from antennate_lab.fit.parameters import parameters
from antennate_lab.fit.run import run

SEED = 82
"""Seed of the hidden robot."""


def main() -> None:
    """Fit one robot twice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--robots", type=int, default=120)
    parser.add_argument("--workers", type=int, default=1)
    options = parser.parse_args()
    folder: Path = options.folder
    folder.mkdir(parents=True, exist_ok=True)
    drawn = hidden(options.seed, 0)
    legs = {"leg_friction": drawn.leg_friction, "legs": {"friction_factors": drawn.factors}}
    robot = RobotSpec.model_validate(put_over(KNOWN.model_dump(), legs))
    whole = Protocol.named("identify")
    steps = tuple(step for step in whole.steps if step.place == "floor")
    protocol = whole.model_copy(update={"steps": steps}).made_for(KNOWN, CONTROL)
    log, table, known = (folder / name for name in ("drive.mcap", "poses.csv", "known.toml"))
    log.unlink(missing_ok=True)
    record(robot, protocol, log, 0, table)
    known.write_text('[imu]\nkind = "head"\n', encoding="utf-8")
    told = []
    for poses in ((), (str(table),)):
        config = FitConfig(log=(str(log),), robot=str(known), poses=poses, robots=options.robots)
        outcome = run(config, options.workers)
        for row in outcome.rows:
            path, _, place = row.name.partition("[")
            at = int(place[:-1]) if place else None
            truth = parameters(robot, [(path, at)])[0].start
            ends = {"low": row.low, "value": row.value, "high": row.high, "told": row.told}
            told.append({"poses": bool(poses), "name": row.name, "truth": truth} | ends)
        if poses:
            held = [step for step in outcome.result().steps if not step.fitted]
            names = ["step", "speed_mm", "speed_before_mm", "speed_after_mm"]
            rows = pd.DataFrame([{name: getattr(step, name) for name in names} for step in held])
            print(rows.round(0).to_string(index=False))
    found = pd.DataFrame(told)
    found.to_csv(folder / "captured.csv", index=False, lineterminator="\n")
    print(found.round(3).to_string(index=False))


if __name__ == "__main__":
    main()
