"""Write the verdicts of a whole run of `antennate reproduce` into docs.

Reads docs/science/reproduce.json, the result.json of that run, and reproduce_fitted.json, that of
one with `--setting fitted`, and writes docs/reproduce.md and the counts on docs/index.md. With
--check only say whether both are true. Run directories that are named are judged first, in place of
a whole run: one of each command that stands beside a claim, or of each with `--config fitted`, or
of both, whatever machine it was run on; their claims are written to those files.
"""

import csv
import json
import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from generated import finish, heads, row

from antennate.experiments import load
from antennate.messages import command_words
from antennate.studies.columns import content
from antennate.studies.formats import to_json
from antennate.studies.run_directory import RunDirectory
from antennate_lab.reproduce.experiment import (
    CLAIMS,
    FULL,
    ReproduceConfig,
    ReproduceOutcome,
    claims,
    command,
    configured,
    is_fitted,
)
from antennate_lab.reproduce.experiment import judge as found_of
from antennate_lab.reproduce.verdict import MEANINGS, VERDICTS

ROOT = Path(__file__).parent
SETTINGS = (ReproduceConfig(), ReproduceConfig(setting="fitted"))
FILES = {
    "default": ROOT / "science" / "reproduce.json",
    "fitted": ROOT / "science" / "reproduce_fitted.json",
}
"""The run of each setting."""
JUDGED = ROOT / "science" / "published_judged.csv"
Rows = Mapping[str, Mapping[str, Any]]
"""Rows of a result by their claim."""
BEGIN, END = "<!-- verdicts: python docs/reproduce.py -->", "<!-- end of verdicts -->"
"""Around what is written on docs/index.md."""
HEAD = """\
# The paper, claim by claim

Every claim of the paper ([arXiv:2603.07795](https://arxiv.org/abs/2603.07795)) in our words, the
criterion it has to meet, what the simulation finds, and a verdict. Each claim lists its criterion,
its rival and its best possible verdict. They are written in the program with the claim, and stand
before the result here, in the table of the command and in `result.json`.

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

Numbers that the paper does not give are also fitted to all that it says of a part at once
([What must be true](science/published.md)). At that setting a claim is *fitted* at best, and fewer
may hold than with our defaults, some of which were chosen for one claim. A dash stands for a part
that has none; the counts then take our defaults. The angle of the tunnel's turn at that setting,
87.5 degrees, was chosen with the help of the seed of this table, 7. With seed 572001, which was not
used to choose, OTHERS cross. The antenna of
the wall was chosen after another had fallen short with seed 7, too; a seed that decided nothing
stands in [The wall](science/published.md#the-wall).

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
controller, in about half an hour. With `--setting fitted` parts that have fitted numbers run with
them, wall and tunnel with 200 trials, all others as before, which takes one to two hours. The run
directory holds `report.html`:
this page with a figure for each claim, which needs no network and no program but a browser.
`result.json` holds the same ([keys](results.md#antennate-reproduce-schema-1)), for a program that
compares two versions. Seeds are the same for all experiments (`--seed`); two runs with one seed
give the same numbers.

What stands behind the verdicts is told in full in [Antenna](science/antenna.md) and
[Tunnel](science/tunnel.md).
"""
NO_RUN = """\
## Verdicts

The table of verdicts is made by the script from a whole run; none is kept here yet. Until then
run it yourself.

"""


def result(config: ReproduceConfig) -> dict[str, Any] | None:
    """The run behind the page at a setting; None if none is kept.

    Raises:
        SystemExit: It is no whole run of today's claims; with fitted numbers parts are enough.
    """
    path = FILES[config.setting]
    if not path.exists():
        return None
    found = json.loads(path.read_text(encoding="utf-8"))
    names, every = [row["claim"] for row in found["claims"]], [claim.claim for claim in CLAIMS]
    known = set(names) <= set(every) if config.setting == "fitted" else names == every
    if found["quick"] or found["interrupted"] or found["setting"] != config.setting or not known:
        more = " --setting fitted" * (config.setting == "fitted")
        sys.exit(
            f"{path.name}: expected a whole run of {len(CLAIMS)} claims, found {len(names)} claims"
            f"{' with --quick' * found['quick']}; run `antennate reproduce{more}` and copy its "
            "result.json"
        )
    return found


def judge(folders: Sequence[str]) -> None:
    """Judge runs of all experiments at a setting, and keep their claims as those of a whole run.

    Raises:
        SystemExit: One is missing, or was told something else.
    """
    runs: dict[str, dict[str, Any]] = {setting: {} for setting in FILES}
    for folder in folders:
        run = RunDirectory.open(folder)
        name, told = run.result()["command"], run.config(load(run.result()["command"]).config)
        fits = [c for c in SETTINGS if name in parts(c) and told == configured(name, c)]
        if not fits:
            those = " or ".join(f"`{command(name, c)}`" for c in SETTINGS if name in parts(c))
            sys.exit(f"{folder}: expected a run of {those}, found another")
        try:
            runs[fits[0].setting][name] = load(name).read(run.result())
        except ValueError as error:
            sys.exit(f"{folder}: expected a result of this version, found {error}; run it again")
    for config in SETTINGS:
        of = runs[config.setting]
        if missing := [command(name, config) for name in parts(config) if of and name not in of]:
            sys.exit(f"expected runs of all parts, missing: {'; '.join(missing)}")
        found = {c: f for name in of for c, f in found_of(name, of[name], config)}
        judged = tuple((c, found[c]) for c in claims(config) if c in found)
        outcome = ReproduceOutcome(config, judged, interrupted=False)
        if of:
            FILES[config.setting].write_text(to_json(content(outcome.result())), encoding="utf-8")


def parts(config: ReproduceConfig) -> list[str]:
    """Experiments that a setting has of its own."""
    return [name for name in FULL if config.setting == "default" or is_fitted(name, config)]


def others() -> str:
    """How many of each controller crossed the fitted tunnel with the seed not used to choose it."""
    crossed: dict[str, list[bool]] = {}
    with JUDGED.open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if (row["setting"], row["seed"]) == ("fitted", "572001"):
                crossed.setdefault(row["controller"], []).append(row["outcome"] == "success")
    return ", ".join(f"`{name}` {sum(of)} of {len(of)}" for name, of in crossed.items())


def fitted_rows(found: Mapping[str, Any] | None) -> Rows:
    """Rows of the parts that ran with fitted numbers, by their claim."""
    rows = found["claims"] if found else ()
    return {row["claim"]: row for row in rows if "--config fitted" in row["command"]}


def counts(found: Mapping[str, Any], fitted: Rows, mark: str = "") -> str:
    """How many claims have each verdict, in words; verdicts that none has are left out."""

    def told(rows: Iterable[Mapping[str, Any]]) -> str:
        number = Counter(row["verdict"] for row in rows)
        words = (f"{number[name]} {text}" for name, text in VERDICTS.items() if number[name])
        return mark + ", ".join(words) + mark

    line = f"{len(CLAIMS)} claims: {told(found['claims'])}."
    if fitted:
        of = dict.fromkeys(command_words(c.experiment) for c in CLAIMS if c.claim in fitted)
        at_best = told(fitted.get(row["claim"], row) for row in found["claims"])
        line += f" At the settings that fit best, of `{'`, `'.join(of)}`: {at_best}."
    return line


def verdicts(found: Mapping[str, Any], fitted: Rows) -> str:
    """The table of all claims with our numbers, then rival and reason of each, by command."""
    more = ["at the fitted setting"] * bool(fitted)
    lines = [
        "## Verdicts",
        "",
        f"Of {counts(found, fitted, '**')} (Seed {found['seed']}; intervals are 95 %.)",
        "",
        heads("claim", "criterion", "paper", "ours", "verdict", *more),
    ]
    for claim in found["claims"]:
        cells = [claim[name] for name in ("claim", "criterion", "paper", "ours")]
        there = fitted.get(claim["claim"])
        best = f"**{VERDICTS[there['verdict']]}**: {there['ours']}" if there else "-"
        lines.append(row(*cells, f"**{VERDICTS[claim['verdict']]}**", *[best] * bool(fitted)))
    lines += ["", "## Rivals and reasons"]
    last = ""
    for claim, rule in zip(found["claims"], CLAIMS, strict=True):
        if claim["command"] != last:
            last = claim["command"]
            there = fitted.get(claim["claim"])
            more = f"; at the fitted setting by `{there['command']}`" if there else ""
            lines += ["", f"By `{last}`{more}:", ""]
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
        line = f"Of its {counts(found, {})} {BEST}\n"
    return f"{before}{BEGIN}\n{line}{END}{after}"


def main() -> None:
    """Write both pages, or compare them."""
    if folders := [word for word in sys.argv[1:] if word != "--check"]:
        judge(folders)
    found, fitted = result(SETTINGS[0]), fitted_rows(result(SETTINGS[1]))
    meanings = "".join(f"| {VERDICTS[name]} | {text} |\n" for name, text in MEANINGS.items())
    middle = NO_RUN if found is None else verdicts(found, fitted)
    page = HEAD.replace("MEANINGS", meanings).replace("OTHERS", others()) + middle + FOOT
    made = " and ".join(f"`docs/science/{path.name}`" for path in FILES.values())
    finish(__file__, page, source=made)
    index = (ROOT / "index.md").read_text(encoding="utf-8")
    finish(__file__, on_index(index, found), "index.md")


if __name__ == "__main__":
    main()
