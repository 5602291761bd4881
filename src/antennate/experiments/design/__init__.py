"""Search for a better design: several parameters and objectives.

FILE is a TOML file that names the parameters and their ranges, the experiments that evaluate a
design, their objectives, and reference designs; `studies/` holds ours. Optuna proposes (extra
`design`). Like a study it goes on where it was killed when the same command is given again. The
values of a search are optimistic, so the best designs are run again on fresh seeds. An objective
that ends with `@success`, as `flex_max_deg@success`, is the mean over the trials that succeeded; a
design without any is worse in it than all others.
"""
