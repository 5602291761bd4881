"""An experiment at points: grid, list, random, Sobol, Morris, Optuna.

FILE is a TOML file that names the experiment, what is varied and how; `studies/` holds ours. The
folder of a study is continued without being asked: a study that was killed goes on where it was
when the same command is given again. A trial that crashes or never ends is a row with a status.

Plan `optuna` (extra `design`) searches: Optuna proposes designs by the results of those before,
for measures to `maximize` and `minimize`. The values of a search are optimistic, so the best
designs and the references are run again on fresh seeds. A measure that ends with `@success` is the
mean over the trials that succeeded; a design without any is worse in it than all others.
"""
