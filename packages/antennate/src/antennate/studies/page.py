"""Parts of HTML pages that need nothing else: no network, no script; for screens and for paper."""

from __future__ import annotations

import base64
import re
import struct
from collections.abc import Iterable, Iterator, Mapping, Sequence
from html import escape
from typing import Any

from antennate.studies.tables import Table

_DPI, _CSS_DPI = 200, 96
"""Pixels an inch of our pictures, and of a page."""
_LEAST = 0.75
"""Letters of 9 points become no smaller than this share; a narrow screen scrolls instead."""
_BROAD, _TIGHT = 440, 350
"""Pictures of a greater least width do not fit on a phone, or on most phones [px]."""
_BESIDE, _GAP = 84, 3
"""Letters of a line for which there is room beside a figure, and those of a gap between columns."""
_LARGEST = 1.6
"""Most that a picture is enlarged, so that its letters are not larger than those of a title."""
_VAST = 1200
"""Drawn broader than that [px], they take the whole window and are never made smaller."""
_TAKES_ALL = 'class="scroll vast"'
_CODE = re.compile(r"`([^`]+)`")
_STYLE = """
:root { color-scheme: light dark; --ink: #222; --muted: #666; --line: #ddd; --page: #fff;
  --shade: #0004; --good: #00704d; --fair: #8a5a00; --bad: #a33a00; }
@media (prefers-color-scheme: dark) { :root { --ink: #e8e8e8; --muted: #a8a8a8; --line: #444;
  --page: #161616; --shade: #fff5; --good: #4fc79b; --fair: #e5ae4a; --bad: #ff9460; }
  img { background: #fff; border-radius: .3rem; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--page);
  max-width: 84rem; margin: 0 auto; padding: 1rem 1.5rem; }
.headline { font-size: 1.15rem; }
h1 { font-size: 1.6rem; margin-bottom: .3rem; } h2 { font-size: 1.1rem; margin: 1.6rem 0 .3rem; }
h1, h2, p, figcaption, li { overflow-wrap: anywhere; }
p { margin: .3rem 0; } .muted, dt, caption, figcaption { color: var(--muted); }
.scroll { overflow-x: auto; background:
  linear-gradient(to left, var(--page) 1.5rem, transparent) right / 3rem 100% no-repeat local,
  linear-gradient(to left, var(--shade), transparent) right / 1rem 100% no-repeat; }
table { border-collapse: separate; border-spacing: 0; font-size: .9rem; margin: .3rem 0; }
td, th { text-align: left; vertical-align: top; padding: .2rem 1.2rem .2rem 0;
  border-bottom: 1px solid var(--line); }
td:first-child { white-space: pre-wrap; }
th { font-weight: 600; } table.numbers td + td, table.numbers th + th { text-align: right; }
table.numbers { font-variant-numeric: tabular-nums; white-space: nowrap; }
table.numbers td:first-child { white-space: pre; position: sticky; left: 0;
  background: var(--page); }
section { border-top: 1px solid var(--line); padding: 1rem 0; display: grid; gap: 0 1.5rem;
  grid-template-columns: minmax(0, 1fr) minmax(0, 40rem); break-inside: avoid; }
section > h2, section > .verdict { grid-column: 1 / -1; margin-top: 0; }
figure { margin: .8rem 0; break-inside: avoid; }
.beside { display: grid; gap: 0 2rem; grid-template-rows: min-content 1fr;
  grid-template-columns: minmax(0, 1fr) minmax(0, 1fr); }
.beside th { white-space: normal; } .beside > .words { grid-column: 2; grid-row: 1 / span 2; }
.pair { display: grid; gap: 0 1.5rem; grid-template-columns: repeat(2, minmax(0, 1fr)); }
img, video { max-width: 100%; height: auto; display: block; }
.scroll > img { max-width: none; width: 100%; }
pre { font-size: .8rem; overflow-x: auto; border: 1px solid var(--line); padding: .6rem; }
pre.wrap { white-space: pre-wrap; overflow-wrap: anywhere; }
code { font-size: .85rem; overflow-wrap: anywhere; } a { color: inherit; }
summary { cursor: pointer; } dl { margin: .4rem 0; } dd { margin: 0 0 .4rem; }
.good { color: var(--good); } .fair { color: var(--fair); } .bad { color: var(--bad); }
.good, .fair, .bad { font-weight: 600; }
@media (max-width: 70rem) { .beside { display: block; } }
@media (max-width: 44rem) { body { padding: 1rem; }
  .pair, section { grid-template-columns: minmax(0, 1fr); }
  .wide { display: none; } }
.vast { width: min(calc(100vw - 3rem), var(--drawn)); position: relative; left: 50%;
  transform: translateX(-50%); }
@media (max-width: 95rem) { .vast + figcaption::after { content: " (scroll it: it is wider)"; } }
@media (max-width: 30rem) { .broad + figcaption::after { content: " (swipe: it is wider)"; }
  table.numbers { font-size: .75rem; white-space: normal; }
  table.numbers :is(td, th) { padding-right: .5rem; }
  table.numbers td:first-child { white-space: pre-wrap; } }
@media (max-width: 26rem) { .tight + figcaption::after { content: " (swipe: it is wider)"; } }
@media print { body { max-width: none; padding: 0; font-size: 10pt; } pre { white-space: pre-wrap; }
  details::details-content { content-visibility: visible; display: block; block-size: auto; }
  .scroll { overflow: visible; background: none; } .scroll > img { min-width: 0 !important; }
  table.numbers { white-space: normal; } tr { break-inside: avoid; } h2 { break-after: avoid; }
  details pre { font-size: 6pt; columns: 2; } video { display: none; } }
"""


def page(title: str, body: str) -> str:
    """A whole page."""
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{_STYLE}</style></head>"
        f"<body>{body}</body></html>\n"
    )


def paragraphs(text: str, kind: str = "") -> str:
    """A paragraph for each part of a text that an empty line ends; `words` are code."""
    head = f'<p class="{kind}">' if kind else "<p>"
    parts = (_CODE.sub(r"<code>\1</code>", escape(part)) for part in text.strip().split("\n\n"))
    return "".join(f"{head}{part}</p>" for part in parts if part)


def grid(columns: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> str:
    """A table of texts that scrolls where it is too wide; a row is as long as `columns`."""
    heads = "".join(f"<th>{escape(name)}</th>" for name in columns)
    lines = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return (
        f'<div class="scroll"><table class="{kind}"><thead><tr>{heads}</tr></thead>'
        f"<tbody>{lines}</tbody></table></div>"
    )


def spaced(name: str) -> str:
    """A name with spaces for underscores, unless it is a file of the user."""
    return name if set("/.:") & set(name) else name.replace("_", " ")


def numbers(table: Table) -> str:
    """A table of measures, with its title and its note, behind what its columns are."""
    columns = ["", *map(spaced, table.columns)]
    rows = [[name, *cells] for name, cells in table.rows]
    short = all(len(cell) < 30 for _, cells in table.rows for cell in cells)
    kind = "numbers" if short else ""  # short cells stand in columns, texts are left as they flow
    note = paragraphs(table.note, "muted")
    before = definitions(table.preface)
    return f"{before}<h2>{escape(table.title)}</h2>{grid(columns, rows, kind)}{note}"


def definitions(text: str) -> str:
    """Lines of the form `name: what it is`, a paragraph each."""
    lines = (line.partition(":") for line in text.splitlines())
    return "".join(f"<p><strong>{escape(a)}</strong>{b}{escape(c)}</p>" for a, b, c in lines)


def is_broad(table: Table) -> bool:
    """Whether a table has no room beside a figure."""
    heads = [max(map(len, name.replace("_", " ").split()), default=0) for name in table.columns]
    lines = [[len(name), *map(len, cells)] for name, cells in table.rows]
    widest = [max(sizes) for sizes in zip([0, *heads], *lines, strict=True)]
    return sum(widest) + _GAP * len(widest) > _BESIDE


def beside(figures: Sequence[str], words: str) -> str:
    """Figures at the left of words where there is room; else the first above, others below.

    Those that take the whole window stand above all.
    """
    above = [figure for figure in figures if _TAKES_ALL in figure]
    first, *others = [figure for figure in figures if figure not in above] or [""]
    if not first:
        return "".join(above) + words
    return (
        f'{"".join(above)}<div class="beside"><div class="first">{first}</div>'
        f'<div class="words">{words}</div><div class="others">{"".join(others)}</div></div>'
    )


def picture(png: bytes, svg: bytes, described: str) -> str:
    """A figure as the smaller of both, as wide as there is room and never too small to read."""
    kind, data = ("svg+xml", svg) if len(svg) < len(png) else ("png", png)
    width, height = struct.unpack(">II", png[16:24])
    width, height = (round(size * _CSS_DPI / _DPI) for size in (width, height))
    vast = width > _VAST
    least = width if vast else round(_LEAST * width)
    narrow = " broad" if least > _BROAD else " tight" if least > _TIGHT else ""
    kind_of = _TAKES_ALL if vast else f'class="scroll{narrow}"'
    return (
        f'<div {kind_of} style="--drawn: {width}px">'
        f'<img alt="{escape(described)}" width="{width}" height="{height}" '
        f'style="min-width: {least}px; max-width: {round(_LARGEST * width)}px" '
        f'src="data:image/{kind};base64,{base64.b64encode(data).decode()}"></div>'
    )


def film(mp4: bytes) -> str:
    """A film with its controls; it starts when it is told to."""
    data = base64.b64encode(mp4).decode()
    return (
        '<video controls muted playsinline preload="metadata" '
        f'src="data:video/mp4;base64,{data}"></video>'
    )


def captioned(content: str, caption: str) -> str:
    """A figure or a film with its name below."""
    return f"<figure>{content}<figcaption>{escape(caption)}</figcaption></figure>"


def folded(title: str, content: str) -> str:
    """What a reader opens; on paper it is open."""
    return f"<details><summary>{escape(title)}</summary>{content}</details>"


def block(text: str, wrap: bool = False) -> str:
    """Text as it was typed; nothing of none."""
    text = text.rstrip()
    return f'<pre class="{"wrap" if wrap else ""}">{escape(text)}</pre>' if text else ""


_TERMS = {
    "wilson95": "Wilson 95 %: the true shares of success that could have given this count. Few "
    "trials make it wide; where the intervals of two conditions overlap much, their order is not "
    "known.",
    "restricted_mean_time_s": "Restricted mean time: the mean over all valid trials, where one "
    "that fails counts as the whole time limit. So giving up early does not look fast. Its "
    "interval also reaches for failures that so few trials may not have met.",
    "progress_per_time_m_s": "Progress over time: how far all valid trials came together, over "
    "their time together, so that failures count. Speed over successes: the mean of progress over "
    "time of each trial that succeeded.",
    "stuck": "Stuck episodes: how often the robot, for 5 s, did not gain 0.02 m on its best "
    "progress; it has recovered if it then did.",
    "jams": "Jam: the base moves wall.jam_travel, three spheres, while the tip stays; it may come "
    "free later. Slip: the tip is off the wall for longer than wall.slip_time.",
    "after_start": "After: the same without the first wall.start of the way, over which the "
    "antenna bows.",
    "hold": "Hold: the maneuver in which the robot stands still.",
    "mcnemar_p": "McNemar: two conditions meet the same trials, and only those trials count that "
    "one of them passes and the other does not. p is how often chance alone would split these so "
    "unevenly or more; below 0.05 is usually taken for a difference.",
    "wilcoxon_p": "Wilcoxon: the same question for how long the trials took, by the ranks of the "
    "differences trial by trial, with those of zero among the ranks (Pratt).",
}
"""Sentences by the names of numbers in a result."""


def terms_explained(result: Mapping[str, Any]) -> str:
    """HTML on what of it is in a result; empty if nothing is."""
    there = {name for name, value in _values(result) if value is not None}
    texts = [text for name, text in _TERMS.items() if name in there]
    text = paragraphs("\n\n".join(texts))
    return f"<h2>How to read this</h2>{text}" if texts else ""


def _values(value: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(value, Mapping):
        for name, part in value.items():
            yield str(name), part
            yield from _values(part)
    elif isinstance(value, list):
        for part in value:
            yield from _values(part)
