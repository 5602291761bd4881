"""The claims as they stand in the report: each with its criterion, its numbers and its figure."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from typing import Any

from antennate.experiments.reproduce.run import CLAIMS
from antennate.experiments.reproduce.verdict import MEANINGS, VERDICTS

_LOOK = {
    "reproduced": "good",
    "conditional": "fair",
    "fitted": "muted",
    "not_reproduced": "bad",
    "undecided": "muted",
}


def body(result: Mapping[str, Any], figures: Mapping[str, str]) -> str:
    """HTML of a result, with the figure of each claim by its name."""
    counts = result["verdicts"]
    summary = ", ".join(f"{counts.get(name, 0)} {text}" for name, text in VERDICTS.items())
    how = "few trials (--quick)" if result["quick"] else "all trials"
    names = {claim.claim: claim for claim in CLAIMS}
    words = "".join(f"<dt>{VERDICTS[name]}</dt><dd>{MEANINGS[name]}</dd>" for name in VERDICTS)
    rows = [(row, names.get(row["claim"])) for row in result["claims"]]
    index = "".join(_line(row, claim.name if claim else "") for row, claim in rows)
    sections = "".join(
        _section(row, claim.name, claim.rule, figures.get(claim.name, ""))
        for row, claim in rows
        if claim is not None
    )
    return (
        "<h2>The paper, claim by claim</h2>"
        "<p>A Robust Antenna Provides Tactile Feedback in a Multi-legged Robot, "
        "arXiv:2603.07795, beside what antennate finds in simulation. Claims are in our words.</p>"
        f"<p><strong>{summary}.</strong></p>"
        f'<p class="muted">{how}, seed {result["seed"]}. '
        f"Intervals are 95 %.</p><dl>{words}</dl>"
        "<table><thead><tr><th>claim</th><th class=wide>criterion</th><th class=wide>paper</th>"
        "<th class=wide>ours</th>"
        f"<th>verdict</th></tr></thead><tbody>{index}</tbody></table>{sections}"
    )


def _verdict(row: Mapping[str, Any]) -> str:
    verdict = row["verdict"]
    return f'<span class="{_LOOK[verdict]}">{VERDICTS[verdict]}</span>'


def _line(row: Mapping[str, Any], name: str) -> str:
    return (
        f'<tr><td><a href="#{name}">{escape(row["claim"])}</a></td>'
        f"<td class=wide>{escape(row.get('criterion', ''))}</td>"
        f"<td class=wide>{escape(row['paper'])}</td><td class=wide>{escape(row['ours'])}</td>"
        f"<td>{_verdict(row)}</td></tr>"
    )


def _section(row: Mapping[str, Any], name: str, rule: str, figure: str) -> str:
    facts = {
        "criterion": escape(rule),
        "paper": escape(row["paper"]),
        "ours": escape(row["ours"]),
        "verdict": _verdict(row),
        "why": escape(row["reason"]),
    }
    words = "".join(f"<dt>{name}</dt><dd>{text}</dd>" for name, text in facts.items())
    return (
        f'<section id="{name}"><h2>{escape(row["claim"])}</h2>'
        f"<dl>{words}</dl>"
        f"<div>{figure}<p><code>{escape(row['command'])}</code></p></div></section>"
    )
