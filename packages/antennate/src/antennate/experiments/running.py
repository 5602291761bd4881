"""Run an experiment from Python and get what came out as one object."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from antennate import checks, experiments
from antennate.control.registry import CONTROLLERS, KINDS, ControllerFactory
from antennate.errors import BadInputError, ConfigError
from antennate.messages import one_line, shown
from antennate.params.base import Params, from_values
from antennate.studies.columns import content
from antennate.studies.engines import LOCAL, Device, make_engine
from antennate.studies.experiment import Experiment, RunOutcome
from antennate.studies.identity import environment, identity, texts
from antennate.studies.pool import Workers
from antennate.studies.pooling import frame
from antennate.studies.report import write_report
from antennate.studies.run_directory import RunDirectory
from antennate.studies.run_files import FILMS
from antennate.studies.sending import require_sent
from antennate.studies.tables import Table
from antennate.telemetry import FilmView

_PARTS = 100
"""Parts of the making of a film that are told."""


@dataclass(frozen=True, repr=False)
class Result:
    """What came out of an experiment. In a notebook it shows its sentence, table and figure.

    Attributes:
        experiment: The experiment.
        config: Its configuration.
        outcome: Everything that was measured, of a type of its own for each experiment.
        path: Its run directory, None if nothing was written.
    """

    experiment: Experiment[Any, Any]
    config: Params
    outcome: RunOutcome
    path: Path | None = None

    def __repr__(self) -> str:
        """One line: what was run, and what came out."""
        trials = f", {len(self.rows)} trials" if self.rows else ""
        return f"<Result of {self.experiment.name}{trials}: {one_line(self.sentence)}>"

    def _repr_html_(self) -> str:
        """A sentence, the first table and the first figure, for a notebook."""
        from antennate.notebook import html  # only in a notebook

        tables, figures = self.experiment.tables(self.found), self.figures()
        table = tables[0] if tables else Table("", (), ())
        first = next(iter(self.experiment.view.ordered(figures)), "")
        return html(
            self.sentence,
            table.columns,
            table.rows,
            figure=figures.get(first),
            note=table.preface,
        )

    @property
    def rows(self) -> Sequence[Any]:
        """Finished trials, frozen dataclasses in a fixed order; names of fields end in units."""
        return self.outcome.rows

    @property
    def found(self) -> Any:
        """What it came to, an object with the fields of result.json, see docs/results.md."""
        found = self.outcome.result()
        return found if self.path is None else self.experiment.placed(found, self.path)

    @property
    def summary(self) -> dict[str, Any]:
        """The content of result.json, `found` as a dictionary; names end in units."""
        return content(self.found)

    @property
    def sentence(self) -> str:
        """What came out and how sure it is, in one sentence."""
        return self.experiment.sentence(self.found)

    def figures(self) -> Mapping[str, Any]:
        """Figures of matplotlib by name."""
        return self.experiment.figures(self.outcome)

    def to_dataframe(self) -> Any:
        """A pandas DataFrame with a row for each trial and the columns of trials.csv.

        Raises:
            BadInputError: The experiment has no trials.
        """
        if not self.rows:
            raise BadInputError(
                f"to_dataframe: expected trials, found none: {self.experiment.name} has no rows of "
                f"trials{_elsewhere(self.summary)}"
            )
        return frame(self.rows)

    def __reduce__(self) -> tuple[Callable[..., Result], tuple[Any, ...]]:
        """Pickle the name of the experiment in place of its functions."""
        return _restored, (self.experiment.name, self.config, self.outcome, self.path)


def _restored(name: str, config: Params, outcome: RunOutcome, path: Path | None) -> Result:
    return Result(experiments.load(name), config, outcome, path)


def _elsewhere(summary: Mapping[str, Any]) -> str:
    """Where its numbers are: the first list of tables that a summary holds."""
    for name, value in summary.items():
        if isinstance(value, list) and value and isinstance(value[0], Mapping):
            return f"; take pandas.DataFrame(result.summary[{name!r}])"
    return "; take result.summary"


def run(
    name_or_config: str | Params,
    /,
    workers: int = 1,
    out: str | Path | None = None,
    overwrite: bool = False,
    video: int | None = None,
    on_step: Callable[[int, int], None] = lambda done, total: None,
    resume: bool = False,
    engine: Any = LOCAL,
    **settings: Any,
) -> Result:
    """Run an experiment.

    Args:
        name_or_config: Its name, one of `list_experiments()`, or its whole configuration.
        workers: Processes to use; the result does not depend on it. With more than one, the calling
            script needs `if __name__ == "__main__":`.
        out: A run directory to write: configuration, versions, rows, result and figures; None
            for none.
        overwrite: Rename a folder that holds a run to `out`.old first.
        video: Number of a trial of which `out` gets a film for each condition, None for none.
        on_step: Called with how many of how many parts are done.
        resume: Go on with the run that `out` holds, if there is one; with more trials, too.
        engine: Where the workers are: local, dask, dask://HOST:PORT, slurm, or an object with
            `submit` as those of concurrent.futures have.
        settings: Fields of its configuration where a name was given, with nested groups as objects
            or dictionaries. `controllers` also takes classes.

    Raises:
        BadInputError: There is no such experiment, or a setting is unknown or out of bounds.
        OutputError: The directory cannot be written, or holds another run.
        AntennateError: The run failed.
    """
    workers = checks.whole("workers", workers, least=1)
    checks.function("on_step", on_step)
    out = None if out is None else checks.path("out", out)
    for name, given in {"overwrite": overwrite, "resume": resume}.items():
        if given and out is None:
            raise ConfigError(f"{name}: expected out beside it, found none")
    experiment, config = _configured(name_or_config, settings)
    config = experiment.settled(config, out if resume else None)
    if engine != LOCAL and experiment.workers != "anywhere":
        raise ConfigError(
            f"engine: expected an experiment that runs trials on workers, found {experiment.name}"
        )
    if video is not None:
        require_films(experiment, config, checks.whole("video", video), out)
    pool = Workers(workers, make_engine(engine), shared=environment(experiment.name, config))
    if workers > 1 if pool.engine is None else not isinstance(pool.engine, Device):
        require_sent(texts(config.model_dump(mode="json")))
    if out is None:
        return Result(experiment, config, experiment.run(config, pool, on_step, lambda row: None))
    place = (
        experiment.name,
        out,
        overwrite,
        identity(experiment.name, config),
        resume or experiment.continued,
    )
    with RunDirectory.create(*place, tasks=experiment.grows) as directory:
        directory.require_free(names_of(experiment, config, films=video))
        directory.keeps_trials = experiment.workers != "none"
        directory.describe(config)
        pool = replace(pool, trials=directory.trials)
        outcome = experiment.run(config, pool, on_step, directory.append)
        found = experiment.placed(outcome.result(), directory.path)
        keep(experiment, config, outcome, experiment.content(found), directory)
        if video is not None:
            write_films(experiment, config, video, directory)
        write_report(directory, experiment.view)
        return Result(experiment, config, outcome, directory.path)


def names_of(
    experiment: Experiment[Any, Any], config: Params, figures: bool = True, films: int | None = None
) -> list[str]:
    """Names of files, figures and films that a run writes at its end, as far as they are known.

    Args:
        experiment: The experiment.
        config: Its configuration.
        figures: Whether figures are drawn.
        films: Trial that is filmed, None for no film.
    """
    drawn = experiment.view.figures if figures else []
    shot = experiment.films(config, films) if experiment.films and films is not None else {}
    return [*experiment.files(config), *drawn, *map(_film, shot)]


def _film(name: str) -> str:
    """The file of a film."""
    return f"{FILMS}/{re.sub(r'[^A-Za-z0-9_.-]+', '_', name)}.mp4"


def keep(
    experiment: Experiment[Any, Any],
    config: Params,
    outcome: RunOutcome,
    result: Mapping[str, Any],
    directory: RunDirectory,
    figures: bool = True,
) -> None:
    """Write what came out into a run directory: files, rows and result, then figures.

    Args:
        experiment: The experiment.
        config: Its configuration.
        outcome: What its run returned.
        result: What result.json holds, from `Experiment.content`.
        directory: The run directory.
        figures: Whether figures are drawn.
    """
    for name, make in experiment.files(config).items():
        if (content := make(outcome)) is not None:
            directory.write(name, content)
            directory.kept = True  # with what says what it is of
    directory.finish(result, outcome.rows)
    if figures:
        directory.write_figures(experiment.figures(outcome))


def require_films(
    experiment: Experiment[Any, Any], config: Params, trial: int, out: str | Path | None = ""
) -> None:
    """Find out before a run whether its films can be made."""
    from antennate.telemetry.film import require_video  # slow to import

    trials = getattr(config, "trials", 1)
    if experiment.films is None or out is None:
        what = "an experiment that can be filmed" if out is not None else "a run directory, `out`"
        raise ConfigError(f"video: expected {what}, found {experiment.name} without")
    if not 0 <= trial < trials:
        raise ConfigError(f"video: expected a trial of this run, 0 to {trials - 1}, found {trial}")
    experiment.films(config, trial)
    require_video()


def write_films(
    experiment: Experiment[Any, Any],
    config: Params,
    trial: int,
    directory: RunDirectory,
    on_step: Callable[[int, int], None] = lambda done, total: None,
    view: FilmView = "above",
) -> None:
    """Run one trial of each condition once more, and write its film into the run directory."""
    from antennate.telemetry.film import encoded

    assert experiment.films is not None  # noqa: S101 `require_films` looked
    records = experiment.films(config, trial)
    for done, (name, record) in enumerate(records.items()):

        def step(part: int, total: int, before: int = _PARTS * done) -> None:
            on_step(before + _PARTS * part // total, _PARTS * len(records))

        data = encoded(record().seen_from(view), step)
        directory.write(_film(name), data)


def study(
    experiment: str | Callable[..., Any],
    vary: Mapping[str, Any],
    settings: Mapping[str, Any] | None = None,
    **more: Any,
) -> Result:
    """Run an experiment, or a function of your own, at many points of its parameters.

    Args:
        experiment: Name of an experiment, or trial(config, seed) -> row: `config` holds the
            parameters by name, `seed` is 0, 1, 2 and so on, the row is a dictionary or a dataclass.
        vary: By dotted name a list of values, or {"low": ..., "high": ...} for a range.
        settings: Parameters that are the same at all points.
        more: Further fields of a study (plan, points, seed, trials, response, assumed, leave_out),
            and how to run it, as for `run` (workers, out, engine, on_step). With `out` the study
            goes on with what the directory holds of it.

    Raises:
        BadInputError: A name is unknown, a value out of bounds, or the plan is empty.
        OutputError: The directory cannot be written, or another process works on it.
        AntennateError: The run failed.
    """
    from antennate.experiments.study.subject import FUNCTIONS, plain

    if not isinstance(experiment, str):
        name = getattr(experiment, "__name__", "")
        if not name or name in experiments.names():
            raise BadInputError(
                "study: expected an experiment, or a function with a name that no experiment has, "
                f"found {shown(name) if name else f'a {type(experiment).__name__}'}"
            )
        FUNCTIONS.add(name, experiment)
        experiment = name
    values = {"vary": plain(vary), "settings": plain(settings or {})}
    return run("study", experiment=experiment, **values, **more)


def list_experiments() -> dict[str, str]:
    """Name and summary of every experiment that `run` takes."""
    return experiments.summaries()


def _configured(
    experiment: str | Params, settings: Mapping[str, Any]
) -> tuple[Experiment[Any, Any], Params]:
    if isinstance(experiment, str):
        chosen = experiments.load(experiment)
        values = dict(settings)
        if "controllers" in values:
            values["controllers"] = _names(values["controllers"])
        return chosen, from_values(chosen.config, values)
    if settings:
        raise ConfigError(
            f"run: expected settings only beside a name, found {', '.join(settings)} beside "
            f"{type(experiment).__name__}"
        )
    for name in experiments.names():
        chosen = experiments.load(name)
        if type(experiment) is chosen.config:
            return chosen, experiment
    raise ConfigError(
        f"run: expected a name or the configuration of an experiment, found "
        f"{type(experiment).__name__}"
    )


def _names(controllers: Iterable[str | ControllerFactory]) -> tuple[str, ...]:
    """Controllers by name; classes become known to this process under their own."""
    names = []
    if isinstance(controllers, str):
        controllers = [controllers]
    if not isinstance(controllers, Iterable):
        raise ConfigError(f"controllers: expected a list, found {shown(controllers)}")
    for controller in controllers:
        if isinstance(controller, str):
            names.append(controller)
            continue
        checks.function("controllers", controller)
        name = controller.__name__
        if KINDS.get(name) is not controller:
            CONTROLLERS.add(name, controller)
        names.append(name)
    return tuple(names)
