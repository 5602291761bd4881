"""The result as tables, as one sentence, and as the README of a run directory."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

from antennate.control.loop import void_sentence
from antennate.control.registry import about
from antennate.studies.columns import columns, shown
from antennate.studies.tables import Table
from antennate_lab.compete.comparison import ENOUGH, Check, Differing, refusal
from antennate_lab.compete.config import DEVELOPMENT, plain
from antennate_lab.compete.episodes import EpisodeRow
from antennate_lab.compete.result import CompeteResult, Pair, Standing, none_valid
from antennate_lab.compete.scenes import label, labels
from antennate_lab.compete.standings import ALPHA

_NOTE = (
    "A failure counts as its time limit, and so does INVALID: an angle that is not finite, an "
    "exception,\na decision that took too long. (A learned policy's answer that is not finite is "
    "HOLD.) {given}Ranks:\nof those that live on their readings alone."
)


def ordered(result: Standing) -> list[str]:
    """Controllers by rank, then by time; those outside the ranking last."""
    rows = result.controllers
    return sorted(
        rows,
        key=lambda name: (
            rows[name].rank is None,
            rows[name].rank or 0,
            rows[name].restricted_mean_share or 0.0,
        ),
    )


def tables(result: Standing) -> Sequence[Table]:
    """Controllers, scenes, pairs; and what differs from a table that was checked.

    Where no episode is valid there is none of the first three.
    """
    names = ordered(result)
    short = labels(names)
    rows = {short[name]: result.controllers[name] for name in names}
    privileged = [name for name, row in rows.items() if row.given]
    words = f"{', '.join(privileged)}: given what only a simulation knows. " if privileged else ""
    note = _NOTE.format(given=words)
    parts = [
        Table.of("Controllers", rows, note=note, preface=about(map(plain, names))),
        Table("Successes by scene", [short[n] for n in names], _scene_lines(result, names)),
    ]
    if len(none_valid(result)) == len(names):
        parts.clear()
    elif result.paired:
        parts.append(_pair_table(result.paired.values(), short))
    if result.check is not None and result.check.differ:
        parts.insert(0, _check_table(result.check))
    return parts


def _scene_lines(result: Standing, names: Sequence[str]) -> list[tuple[str, list[str]]]:
    return [
        (
            label(scene),
            [
                f"{cells[n].successes}/{cells[n].episodes}" if cells[n].episodes else "-"
                for n in names
            ],
        )
        for scene, cells in result.scenes.items()
    ]


def _pair_table(pairs: Iterable[Pair], short: Mapping[str, str]) -> Table:
    rows = {
        " and ".join(short[name] for name in pair.names) + " (tie)" * pair.tie: pair
        for pair in pairs
    }
    measures = [
        each
        for measure in columns(Pair)
        for each in (measure, replace(measure.ends, label="95 %" * bool(measure.interval), unit=""))
    ]
    note = (
        "A draw counts once, also over several scenes. McNemar's test is exact, Wilcoxon's takes\n"
        "Pratt's ranks; Holm's correction over all pairs. A tie is a difference that two kinds of\n"
        "processor make, too."
    )
    return Table.lines("Pairs, draw by draw", rows, measures, note)


def _check_table(check: Check) -> Table:
    heads = ("outcome", "here", "time [s]", "here", "way [m]", "here", "on its back", "here")
    lines = [
        (
            f"{row.controller} in {label(row.scene)}, {row.seed}, {row.trial}",
            [
                row.outcome,
                row.outcome_here,
                shown(row.time_s),
                shown(row.time_here_s),
                shown(row.progress_m),
                shown(row.progress_here_m),
                "yes" if row.overturned else "no",
                "yes" if row.overturned_here else "no",
            ],
        )
        for row in check.differ
    ]
    note = (
        f"By controller, scene, seed and trial. {check.same} of {check.rows} rows are the "
        f"same.\nThey were run by antennate "
        f"{', '.join(check.versions)} on {', '.join(check.processors)}."
    )
    return Table("Rows that differ", heads, lines, note)


def _differing(rows: Iterable[Differing]) -> str:
    """Rows that differ from a table, and in what, as a list in Markdown."""
    return "\n".join(
        f"- `{row.controller}` in `{row.scene}`, seed {row.seed}, trial {row.trial}: "
        + ", ".join(f"{name} {theirs}, here {ours}" for name, theirs, ours in row.differences)
        for row in rows
    )


def sentence(result: Standing) -> str:
    """Who stands first and how sure that is; or how many rows of a table repeat."""
    if result.check is not None:
        return _repeats(result.check)
    rows, names = result.controllers, ordered(result)
    short = labels(names)
    ranked = [name for name in names if rows[name].rank is not None]
    scenes = len(result.scenes)
    entries = [
        f"{short[name]} {rows[name].rank} ({shown(rows[name].rank_95, '.0f')}; "
        f"{rows[name].successes} of {rows[name].episodes})"
        for name in ranked
    ]
    seeds = result.seeds
    known = "public" if set(seeds) <= set(DEVELOPMENT) else "chosen"
    kind = f"{'hidden' if result.hidden else known} seed{'s' * (len(seeds) > 1)}"
    ranks = ", ".join(entries) or "none, as none lives on its readings"
    lost = (f" No episode of {short[n]} is valid: {why}." for n, why in none_valid(result).items())
    void = void_sentence({short[name]: rows[name].void_decisions for name in names})
    return (
        f"Ranks in {scenes} scene{'s' * (scenes > 1)} (95 % interval; successes), {kind} "
        f"{', '.join(map(str, seeds))}: {ranks}.{''.join(lost)}{f' {void}' * bool(void)}"
    )


def _repeats(check: Check) -> str:
    """How many rows of a table repeat."""
    text = (
        f"{check.same} of {check.rows} rows repeat; {len(check.differ)} differ, "
        f"{check.other_outcome} of them in how they end."
    )
    few = " They are too few to tell." if check.draws < ENOUGH else ""
    sums = (
        f"{check.elsewhere} are of another version, engine or processor, where chance ends "
        f"rows in another way: they are judged together.{few}"
    )
    return " ".join(filter(None, [text, sums if check.elsewhere else "", refusal(check)]))


def apart(result: Standing) -> str:
    """Which controllers the tests of success and of time tell apart, in a sentence each."""
    crossed = _before(
        result,
        lambda pair: pair.mcnemar_holm_p,
        lambda pair: 0 if pair.tie else pair.success_difference,
    )
    faster = _before(result, lambda pair: pair.wilcoxon_holm_p, lambda pair: -pair.share_difference)
    return (
        f"Told apart by McNemar's test, Holm's correction, 5 %: {crossed}.\n\n"
        "Told apart by time, a failure as the limit, by Wilcoxon's test of the mean of each draw, "
        f"Holm's correction, 5 %: {faster}."
    )


def _before(result: Standing, p: Callable[[Pair], float], ahead: Callable[[Pair], float]) -> str:
    """Which controllers are ahead of which, by the p and the lead of each pair."""
    short = labels(ordered(result))
    behind: dict[str, list[str]] = {}
    for pair in result.paired.values():
        if p(pair) < ALPHA and (lead := ahead(pair)):
            first, second = pair.names if lead > 0 else pair.names[::-1]
            behind.setdefault(first, []).append(second)
    leads = [
        f"`{short[name]}` before {', '.join(f'`{short[n]}`' for n in behind[name])}"
        for name in ordered(result)
        if name in behind
    ]
    return "; ".join(leads) or "nobody from nobody"


def markdown(result: Standing) -> str:
    """The standing and the scenes as tables in Markdown."""
    names = ordered(result)
    short = {key: name.replace("|", r"\|") for key, name in labels(names).items()}
    lines = [
        "| controller | rank (95 %) | successes | Wilson 95 % by draws [%] | restricted mean time "
        "[% of limit] (95 %) | speed over successes [m/s] | fell | on its back | INVALID |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for name in names:
        row = result.controllers[name]
        rank = f"{row.rank} ({shown(row.rank_95, '.0f')})" if row.rank else "not ranked"
        time = shown(row.restricted_mean_share, ".0f", 100.0)
        ends = shown(row.restricted_mean_share_95, ".0f", 100.0)
        lines.append(
            f"| `{short[name]}` | {rank} | {row.successes} of {row.episodes} | "
            f"{shown(row.wilson95, '.0f', 100.0)} | {time} ({ends}) | "
            f"{shown(row.speed_m_s, '.3f')} | {row.fell} | {row.overturned} | {row.invalid} |"
        )
    lines += ["", f"| scene | {' | '.join(f'`{short[n]}`' for n in names)} |"]
    lines += ["|---" * (len(names) + 1) + "|"]
    for scene, cells in _scene_lines(result, names):
        lines.append(f"| `{scene}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def readme(result: CompeteResult, rows: Sequence[EpisodeRow]) -> str:
    """What stands in the run directory for who finds it."""
    reasons = [
        f"- `{row.controller}` in `{row.scene}`, trial {row.trial}: {row.reason}"
        for row in rows
        if row.outcome == "invalid"
    ]
    parts = [
        "# A competition of controllers",
        sentence(result),
        apart(result),
        markdown(result),
        f"antennate {', '.join(sorted({row.version for row in rows}))}, MuJoCo "
        f"{', '.join(sorted({row.engine for row in rows}))}, "
        f"{', '.join(sorted({row.processor for row in rows}))}. "
        f"A decision may take {1e3 * result.decision_limit_s:g} ms of processor time.",
        "Every row is in `trials.csv`; `antennate compete --check` with that file runs them again, "
        "in the folder from which this was run where a controller is a file.",
    ]
    if result.check is not None and (differ := result.check.differ):
        parts += ["Rows that differ, as the table says and as they ended here:", _differing(differ)]
    if reasons:
        parts += ["INVALID, which counts as a failure:", "\n".join(reasons)]
    return "\n\n".join(parts) + "\n"
