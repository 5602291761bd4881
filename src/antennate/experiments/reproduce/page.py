"""The claims as one HTML page that needs nothing else: no network, no script."""

from __future__ import annotations

import base64
from html import escape

from antennate import __version__
from antennate.experiments.reproduce.figure import draw
from antennate.experiments.reproduce.run import ReproduceOutcome
from antennate.experiments.reproduce.verdict import VERDICTS, Claim, Finding, Row
from antennate.figures import render

_STYLE = """
:root { color-scheme: light dark; --ink: #222; --muted: #666; --line: #ddd; --page: #fff;
  --reproduced: #00704d; --conditional: #8a5a00; --not_reproduced: #a33a00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e8e8; --muted: #a8a8a8; --line: #444;
  --page: #161616; --reproduced: #4fc79b; --conditional: #e5ae4a; --not_reproduced: #ff9460; }
  img { filter: invert(0.91) hue-rotate(180deg); } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--page);
  max-width: 62rem; margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.6rem; } h2 { font-size: 1.1rem; margin: 0 0 .3rem; }
p { margin: .3rem 0; } .muted, dt { color: var(--muted); }
table { border-collapse: collapse; width: 100%; font-size: .9rem; }
td, th { text-align: left; vertical-align: top; padding: .3rem .6rem .3rem 0;
  border-bottom: 1px solid var(--line); }
section { border-top: 1px solid var(--line); padding: 1rem 0; display: grid; gap: 0 1.5rem;
  grid-template-columns: 1fr minmax(0, 26rem); break-inside: avoid; }
section > h2, section > .verdict { grid-column: 1 / -1; }
dl { margin: .4rem 0; } dd { margin: 0 0 .4rem; } img { width: 100%; height: auto; }
code { font-size: .85rem; overflow-wrap: anywhere; } a { color: inherit; }
.verdict { font-weight: 600; } td:last-child { white-space: nowrap; }
.reproduced { color: var(--reproduced); }
.conditional { color: var(--conditional); } .not_reproduced { color: var(--not_reproduced); }
@media (max-width: 44rem) { section { grid-template-columns: 1fr; } .wide { display: none; } }
"""


def page(outcome: ReproduceOutcome) -> str:
    """The whole page."""
    counts = outcome.result()["verdicts"]
    summary = ", ".join(f"{counts[name]} {text}" for name, text in VERDICTS.items())
    how = "few trials (--quick)" if outcome.config.quick else "all trials"
    pairs = list(zip(outcome.judged, outcome.rows, strict=True))
    index = "".join(_line(claim, row) for (claim, _), row in pairs)
    body = "".join(_section(claim, finding, row) for (claim, finding), row in pairs)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>The paper, claim by claim</title><style>{_STYLE}</style></head><body>"
        "<h1>The paper, claim by claim</h1>"
        "<p>A Robust Antenna Provides Tactile Feedback in a Multi-legged Robot, "
        "arXiv:2603.07795, beside what antennate finds in simulation. Claims are in our words.</p>"
        f"<p><strong>{summary}.</strong></p>"
        f'<p class="muted">antennate {escape(__version__)}, {how}, seed {outcome.config.seed}. '
        "Intervals are 95 %. Conditional: it holds under the condition that is named.</p>"
        "<table><thead><tr><th>claim</th><th class=wide>paper</th><th class=wide>ours</th>"
        f"<th>verdict</th></tr></thead><tbody>{index}</tbody></table>{body}</body></html>\n"
    )


def _verdict(row: Row) -> str:
    return f'<span class="{row.verdict}">{VERDICTS[row.verdict]}</span>'


def _line(claim: Claim, row: Row) -> str:
    return (
        f'<tr><td><a href="#{claim.name}">{escape(row.claim)}</a></td>'
        f"<td class=wide>{escape(row.paper)}</td><td class=wide>{escape(row.ours)}</td>"
        f"<td>{_verdict(row)}</td></tr>"
    )


def _section(claim: Claim, finding: Finding, row: Row) -> str:
    image = base64.b64encode(render(draw(claim, finding))["png"]).decode()
    facts = {
        "paper": row.paper,
        "ours": row.ours,
        "rule": claim.rule,
        "why": row.reason,
    }
    words = "".join(f"<dt>{name}</dt><dd>{escape(text)}</dd>" for name, text in facts.items())
    described = escape(f"{claim.claim}: the numbers of the paper and ours in {claim.unit}")
    return (
        f'<section id="{claim.name}"><h2>{escape(row.claim)}</h2>'
        f'<p class="verdict">{_verdict(row)}</p><dl>{words}</dl>'
        f'<div><img alt="{described}" src="data:image/png;base64,{image}">'
        f"<p><code>{escape(row.command)}</code></p></div></section>"
    )
