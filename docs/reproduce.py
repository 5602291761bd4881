"""Write the verdicts of a whole run of `antennate reproduce` into docs.

Reads docs/science/reproduce.json, the result.json of that run, and writes docs/reproduce.md and the
counts on docs/index.md. With --check only say whether both are true.
"""

import json
import sys
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from generated import finish, heads, row

from antennate.experiments.reproduce.run import CLAIMS
from antennate.experiments.reproduce.verdict import VERDICTS

ROOT = Path(__file__).parent
RESULT = ROOT / "science" / "reproduce.json"
BEGIN, END = "<!-- verdicts: python docs/reproduce.py -->", "<!-- end of verdicts -->"
"""Around what is written on docs/index.md."""
HEAD = """\
# The paper, claim by claim

Every claim of the paper ([arXiv:2603.07795](https://arxiv.org/abs/2603.07795)) in our words, what
the simulation finds, and a verdict by a rule that is stated with it. The numbers are those of one
whole run. `wall`, `sweep` and `touch` were run again with the same seed when their rules or
intervals had changed, and their numbers are those of the second runs. One interval is of the
program as it was: that of the time by which feedback is faster is a percentile bootstrap. The
program now gives one that also reaches for failures not met ([Statistics](science/statistics.md)).

| verdict | meaning |
|---|---|
| reproduced | the rule of the claim holds, and no number that we chose decides it |
| conditional | it holds under a condition that the paper does not state; the condition is named |
| not reproduced | it does not hold here; what we find instead is said |
| undecided | too few trials to say |

We wrote the rules when we knew most results, so judge them too. What they say of intervals came
after a first whole run, and changed no verdict. After the whole run that is told here, three rules
changed:

- Springs are judged one by one, also the one beyond the flex sensor, and no longer by their sum.
  This changed one verdict: *conditional* became *not reproduced*.
- Shapes are judged without an interval, as the cells of the map were chosen. No verdict changed.
- Where all robots shall cross, few trials are *undecided*. No verdict changed.

Where all robots shall cross, a share of at least 95 % is enough if its interval is at most 10
points wide, though it may reach below: 10 of 10 are *undecided*, 97 of 100 are not. By the rule of
the walls, 97 of 100 would be *undecided* too. A number that we chose allows *conditional* at most,
however clear the result: the base angle of the boulder wall, the lead and the offset of the body
wave, the corner of the tunnel, the margins of the published rule. So 19 of the 22 rules cannot end
as *reproduced*: *conditional* is the best that a simulation can say where parts are unpublished. A
claim without a number in the paper is judged by what it says.

"""
BEST = (
    "*Conditional* means that a claim holds under a condition that the paper does not state. For "
    "most claims we had to choose numbers that the paper does not give. Those claims can only be "
    "conditional."
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
([keys](results-bench.md)), for a program that compares two versions. Seeds are the same for all
experiments (`--seed`); two runs with one seed give the same numbers.

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


def counts(found: Mapping[str, Any]) -> str:
    """How many claims have each verdict, in words; verdicts that none has are left out."""
    number = Counter(claim["verdict"] for claim in found["claims"])
    return ", ".join(f"{number[name]} {text}" for name, text in VERDICTS.items() if number[name])


def verdicts(found: Mapping[str, Any]) -> str:
    """The table of all claims, then the rule and the reason of each."""
    lines = [
        "## Verdicts",
        "",
        f"Of {len(CLAIMS)} claims: **{counts(found)}** (seed {found['seed']}; intervals are 95 %).",
        "",
        heads("claim", "paper", "ours", "verdict"),
    ]
    for claim in found["claims"]:
        words = VERDICTS[claim["verdict"]]
        lines.append(row(claim["claim"], claim["paper"], claim["ours"], f"**{words}**"))
    lines += ["", "## Rules and reasons", ""]
    for claim, rule in zip(found["claims"], CLAIMS, strict=True):
        lines += [
            f"**{claim['claim']}**: {VERDICTS[claim['verdict']]}.",
            "",
            f"- Rule: {rule.rule}",
            f"- Why: {claim['reason']}",
            f"- Run: `{claim['command']}`",
            "",
        ]
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
    found = result()
    page = HEAD + (NO_RUN if found is None else verdicts(found)) + FOOT
    finish(__file__, page, source="`docs/science/reproduce.json`")
    index = (ROOT / "index.md").read_text(encoding="utf-8")
    finish(__file__, on_index(index, found), "index.md")


if __name__ == "__main__":
    main()
