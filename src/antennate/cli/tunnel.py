"""`antennate tunnel`: run the arms, keep every trial, say what came out."""

from __future__ import annotations

import itertools
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from antennate.cli import INTERRUPTED, OK
from antennate.cli.arguments import Options, parse
from antennate.cli.folder import RunFolder, to_json
from antennate.cli.progress import progress, terminate_as_interrupt
from antennate.cli.tables import Cell, number, show, span
from antennate.experiments.tunnel import run as tunnel
from antennate.experiments.tunnel.monitor import TrialPath, TrialResult
from antennate.sim.trial import check_start

DESCRIPTION = """\
Walk robots through a corridor of loose cylinders. The arms differ in one decision: `open` walks
forward whatever it feels, `paper` follows the published table, `closed` escapes when its readings
repeat. All arms meet the same tunnels, starts and disturbances. A trial succeeds when the head
passes the exit."""
SHOWN_TRIALS = 5
"""Trials drawn in the figure of trajectories."""


def command(argv: Sequence[str]) -> int:
    """Run the command and return its exit code.

    Raises:
        BadInputError: Something given cannot be used.
        WorkerError: A worker died.
    """
    config, options = parse("tunnel", DESCRIPTION, tunnel.TunnelConfig, argv)
    check_start(config)  # a bad scene is found before anything is written
    with RunFolder.open("tunnel", options.out, options.overwrite) as folder:
        folder.describe("tunnel", argv, config)
        outcome = _run(config, options, folder)
        if outcome.interrupted and not outcome.rows:
            sys.stderr.write("antennate tunnel: interrupted before the first trial ended\n")
            return INTERRUPTED
        result = outcome.result()
        folder.finish(result, outcome.rows)
        if options.json:
            sys.stdout.write(to_json(result))
        else:
            show_result(result)
        if not options.no_figures:
            _draw(outcome, folder)
        if outcome.interrupted:
            kept = f"{len(outcome.rows)} of {config.trials * len(config.arms)} trials"
            sys.stderr.write(f"antennate tunnel: interrupted: kept {kept}, all that had ended\n")
        sys.stderr.write(f"written to {folder.path}\n")
    return INTERRUPTED if outcome.interrupted else OK


def _run(config: tunnel.TunnelConfig, options: Options, folder: RunFolder) -> tunnel.TunnelOutcome:
    total = config.trials * len(config.arms)
    done = itertools.count(1)
    with progress("trials") as step, terminate_as_interrupt():

        def keep(row: TrialResult, path: TrialPath) -> None:
            folder.append(row)
            step(next(done), total)

        return tunnel.run(config, options.worker_count, keep)


def _draw(outcome: tunnel.TunnelOutcome, folder: RunFolder) -> None:
    from antennate import figures as style
    from antennate.experiments.tunnel.figure import summary, trajectories

    config = outcome.config
    trials = range(min(SHOWN_TRIALS, config.trials))
    figures = {
        "trajectories": trajectories(outcome.paths, config.arms, outcome.rows, trials),
        "summary": summary(outcome.result()["arms"], outcome.rows, config.time_limit),
    }
    for name, figure in figures.items():
        for suffix, data in style.render(figure).items():
            folder.write(f"figures/{name}.{suffix}", data)


def show_result(result: Mapping[str, Any]) -> None:
    """Print the arms one by one and two by two."""
    arms, limit = result["arms"], result["time_limit_s"]
    counts = sorted({arm["trials"] for arm in arms.values()})
    many = " to ".join(str(n) for n in dict.fromkeys([counts[0], counts[-1]]))
    show(
        "Arms",
        arms,
        _ARM_ROWS,
        f"{many} trials an arm, seed {result['seed']}. A failure counts as the time limit, "
        f"{limit:g} s; invalid trials\nare left out of all rows below theirs. Intervals of means "
        "are bootstrapped.\n",
    )
    if result["paired"]:
        show(
            "Pairs, trial by trial",
            result["paired"],
            _PAIR_ROWS,
            "McNemar's test is exact; Wilcoxon's takes failures as the limit; both two-sided.\n",
        )


def _of_both(pair: Any, which: int) -> str:
    times = pair["both_time_s"]
    return number(times[which] if times else None, ".1f")


def _share(name: str) -> Cell:
    def cell(arm: Mapping[str, Any]) -> str:
        share = arm["share"][name]
        return number(None if share is None else 100 * share, ".1f")

    return cell


_ARM_ROWS: list[tuple[str, Cell]] = [
    ("trials", lambda arm: str(arm["trials"])),
    ("successes", lambda arm: str(arm["successes"])),
    ("  share [%]", lambda arm: _percent(arm["successes"], arm["trials"] - arm["invalid"])),
    ("  Wilson 95 % [%]", lambda arm: span(arm["wilson95"], ".0f", 100.0)),
    ("out of time", lambda arm: str(arm["timeouts"])),
    ("left by the entrance", lambda arm: str(arm["left"])),
    ("invalid", lambda arm: str(arm["invalid"])),
    ("speed over successes [m/s]", lambda arm: number(arm["speed_m_s"])),
    ("progress over time [m/s]", lambda arm: number(arm["progress_per_time_m_s"])),
    ("restricted mean time [s]", lambda arm: number(arm["restricted_mean_time_s"], ".1f")),
    ("  95 % [s]", lambda arm: span(arm["restricted_mean_time_95"])),
    ("stuck episodes", lambda arm: str(arm["stuck"])),
    ("  recovered", lambda arm: str(arm["recovered"])),
    ("forward [% of time]", _share("forward")),
    ("turn left", _share("turn_l")),
    ("turn right", _share("turn_r")),
    ("reverse", _share("reverse")),
    ("hold", _share("hold")),
    ("contact force, mean [N]", lambda arm: number(arm["force_mean_n"], ".2f")),
    ("contact force, largest [N]", lambda arm: number(arm["force_max_n"], ".1f")),
]

_PAIR_ROWS: list[tuple[str, Cell]] = [
    ("trials valid in both", lambda pair: str(pair["trials"])),
    ("only the first succeeded", lambda pair: str(pair["only_first"])),
    ("only the second", lambda pair: str(pair["only_second"])),
    ("both succeeded", lambda pair: str(pair["both"])),
    ("  time, first [s]", lambda pair: _of_both(pair, 0)),
    ("  time, second [s]", lambda pair: _of_both(pair, 1)),
    ("McNemar p", lambda pair: number(pair["mcnemar_p"], ".3g")),
    ("time, first - second [s]", lambda pair: number(pair["time_difference_s"], "+.1f")),
    ("  95 % [s]", lambda pair: span(pair["time_difference_95"], "+.1f")),
    ("Wilcoxon p", lambda pair: number(pair["wilcoxon_p"], ".3g")),
]


def _percent(part: int, whole: int) -> str:
    return number(100 * part / whole if whole else None, ".0f")
