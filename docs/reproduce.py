"""Write the verdicts of a whole run of `antennate reproduce` into docs.

Reads docs/science/reproduce.json, the result.json of that run, and writes docs/reproduce.md and the
counts on docs/index.md. With --check only say whether both are true. Run directories that are named
are judged first, in place of a whole run: one of each command that stands beside a claim, whatever
machine it was run on; their claims are written to docs/science/reproduce.json.
"""

import json
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from generated import finish, heads, row

from antennate import experiments
from antennate.experiments.reproduce.experiment import (
    CLAIMS,
    FULL,
    ReproduceConfig,
    ReproduceOutcome,
    command,
    settings,
)
from antennate.experiments.reproduce.verdict import MEANINGS, VERDICTS
from antennate.studies.formats import to_json
from antennate.studies.run_directory import RunDirectory

ROOT = Path(__file__).parent
RESULT = ROOT / "science" / "reproduce.json"
BEGIN, END = "<!-- verdicts: python docs/reproduce.py -->", "<!-- end of verdicts -->"
"""Around what is written on docs/index.md."""
HEAD = """\
# The paper, claim by claim

Every claim of the paper ([arXiv:2603.07795](https://arxiv.org/abs/2603.07795)) in our words, the
criterion it has to meet, what the simulation finds, and a verdict. The criterion, the rival that a
claim is held against and the best that it can be are written down with the claim, in the program,
and stand before the result here, in the table of the command and in `result.json`.

| verdict | meaning |
|---|---|
MEANINGS
A rival is the simplest thing that would meet the claim without its being true: robots that feel
nothing but escape by a clock, a sensor that always says contact, springs that are all equal. Where
the paper gives two numbers, the criterion asks for half of its lead: then one run can say no as
well as yes. A part of a criterion that surely fails decides, whatever the other parts.

We wrote the criteria when we knew most results, so judge them too. Where a number of ours was
chosen so that the claim holds, as the corner of the tunnel, the base angle of the boulder wall or
the coil of the springs, the best is *fitted*; where it was chosen for other reasons, *conditional*.
Where all robots shall cross, a share of at least 95 % is enough if its interval is at most 10
points wide, though it may reach below: 10 of 10 are *undecided*, 97 of 100 are not.

"""
BEST = (
    "*Conditional* means that a claim holds under a condition that the paper does not state, "
    "*fitted* that a number of ours was chosen so that it holds."
)
FOOT = """\
## Run it yourself

```sh
uv run antennate reproduce --quick
```

runs springs, bench, walls, sweeps, gait and tunnel with few trials, in some minutes on two cores;
without `--quick` every experiment runs with its own defaults, the tunnel with 100 trials a
controller, in about half an hour. The run directory holds `report.html`: this page with a figure
for each claim, which needs no network and no program but a browser. `result.json` holds the same
([keys](results.md#antennate-reproduce-schema-1)), for a program that compares two versions. Seeds
are the same for all experiments (`--seed`); two runs with one seed give the same numbers.

What stands behind the verdicts is told in full in [Antenna](science/antenna.md) and
[Tunnel](science/tunnel.md).
"""
NO_RUN = """\
## Verdicts

The table of verdicts is made by the script from a whole run; none is kept here yet. Until then
run it yourself.

"""


def result() -> dict[str, Any] | None:
    """The run behind the page; None if none is kept.

    Raises:
        SystemExit: It is no whole run of today's claims.
    """
    if not RESULT.exists():
        return None
    found = json.loads(RESULT.read_text(encoding="utf-8"))
    names = [claim["claim"] for claim in found["claims"]]
    if found["quick"] or found["interrupted"] or names != [claim.claim for claim in CLAIMS]:
        sys.exit(
            f"{RESULT.name}: expected a whole run of {len(CLAIMS)} claims, found "
            f"{len(names)} claims{' with --quick' * found['quick']}; run `antennate reproduce` and "
            "copy its result.json"
        )
    return found


def judge(folders: Sequence[str]) -> None:
    """Judge runs of all experiments, and keep their claims as those of a whole run.

    Raises:
        SystemExit: One is missing, or was told something else.
    """
    config, runs = ReproduceConfig(), dict[str, Mapping[str, Any]]()
    for folder in folders:
        run = RunDirectory.open(folder)
        name = run.result()["command"]
        told = experiments.load(name).config
        if run.config(told) != told.model_validate(settings(name, config)):
            sys.exit(f"{folder}: expected a run of `{command(name, config)}`, found another")
        runs[name] = run.result()
    if missing := [command(name, config) for name in FULL if name not in runs]:
        sys.exit(f"expected runs of all parts, missing: {'; '.join(missing)}")
    judged = tuple((claim, claim.judge(runs[claim.experiment])) for claim in CLAIMS)
    outcome = ReproduceOutcome(config, judged, interrupted=False)
    RESULT.write_text(to_json(outcome.result()), encoding="utf-8")


def counts(found: Mapping[str, Any]) -> str:
    """How many claims have each verdict, in words; verdicts that none has are left out."""
    number = Counter(claim["verdict"] for claim in found["claims"])
    return ", ".join(f"{number[name]} {text}" for name, text in VERDICTS.items() if number[name])


def verdicts(found: Mapping[str, Any]) -> str:
    """The table of all claims with our numbers, then rival and reason of each, by command."""
    lines = [
        "## Verdicts",
        "",
        f"Of {len(CLAIMS)} claims: **{counts(found)}** (seed {found['seed']}; intervals are 95 %).",
        "",
        heads("claim", "criterion", "paper", "ours", "verdict"),
    ]
    for claim in found["claims"]:
        words = VERDICTS[claim["verdict"]]
        cells = (claim[name] for name in ("claim", "criterion", "paper", "ours"))
        lines.append(row(*cells, f"**{words}**"))
    lines += ["", "## Rivals and reasons"]
    last = ""
    for claim, rule in zip(found["claims"], CLAIMS, strict=True):
        if claim["command"] != last:
            last = claim["command"]
            lines += ["", f"By `{last}`:", ""]
        rival = rule.rule.removeprefix(f"{rule.criterion}. ")
        lines += [f"- **{claim['claim']}.** {rival} *{VERDICTS[claim['verdict']].capitalize()}*: "]
        lines[-1] += f"{claim['reason']}"
    lines += [""]
    return "\n".join(lines) + "\n"


def on_index(index: str, found: Mapping[str, Any] | None) -> str:
    """The home page with today's counts between its two marks."""
    before, rest = index.split(BEGIN + "\n")
    _, after = rest.split(END)
    line = ""
    if found is not None:
        line = f"Of its {len(CLAIMS)} claims: {counts(found)}. {BEST}\n"
    return f"{before}{BEGIN}\n{line}{END}{after}"


def main() -> None:
    """Write both pages, or compare them."""
    if folders := [word for word in sys.argv[1:] if word != "--check"]:
        judge(folders)
    found = result()
    meanings = "".join(f"| {VERDICTS[name]} | {text} |\n" for name, text in MEANINGS.items())
    page = (
        HEAD.replace("MEANINGS", meanings) + (NO_RUN if found is None else verdicts(found)) + FOOT
    )
    finish(__file__, page, source="`docs/science/reproduce.json`")
    index = (ROOT / "index.md").read_text(encoding="utf-8")
    finish(__file__, on_index(index, found), "index.md")


if __name__ == "__main__":
    main()
