"""An experiment at many points: grid, list, random, Sobol, Morris.

FILE is a TOML file that names the experiment, what is varied and how; `studies/` holds ours. The
folder of a study is continued without being asked: a study that was killed goes on where it was
when the same command is given again. A trial that crashes or never ends is a row with a status.
"""
