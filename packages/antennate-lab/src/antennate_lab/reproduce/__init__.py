"""Run what the paper reports, claim by claim, each with a verdict.

Springs, bench, walls, sweeps, gait and tunnel run one after the other; every claim of the paper is
set beside ours and judged by a criterion that is stated before the result, against a trivial rival:
reproduced, conditional, fitted, not reproduced or undecided. The page report.html holds all of it.
With --quick few trials run.
"""
