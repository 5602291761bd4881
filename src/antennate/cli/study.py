"""One shape for every command that runs a study: parse, run, keep, tell, draw."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from antennate.cli import OK
from antennate.cli.arguments import Config, Options, parse
from antennate.cli.folder import RunFolder, to_json
from antennate.cli.progress import progress, terminate_as_interrupt

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Outcome = TypeVar("Outcome")
Step = Callable[[int, int], None]
Keep = Callable[[Any], None]


@dataclass(frozen=True)
class Study(Generic[Config, Outcome]):
    """A command around a function of the API.

    Attributes:
        name: Name of the command.
        description: What `--help` says.
        model: Its configuration.
        run: run(config, workers, on_step, on_row): `on_step` takes how many of how many parts are
            done, `on_row` takes each finished trial, a dataclass.
        result: The content of result.json.
        show: Prints the tables of a result.
        draw: Figures by name; the names must be known to folder.py.
        rows: The trials of an outcome for trials.csv, in a fixed order.
        files: Further files by name, likewise known to folder.py.
        parts: What the progress bar counts.
    """

    name: str
    description: str
    model: type[Config]
    run: Callable[[Config, int, Step, Keep], Outcome]
    result: Callable[[Outcome], Mapping[str, Any]]
    show: Callable[[Mapping[str, Any]], None]
    draw: Callable[[Outcome], Mapping[str, Figure]]
    rows: Callable[[Outcome], Sequence[Any]] = lambda outcome: ()
    files: Callable[[Outcome], Mapping[str, str]] = lambda outcome: {}
    parts: str = "trials"

    def command(self, argv: Sequence[str]) -> int:
        """Run the command and return its exit code.

        Raises:
            AntennateError: Something given cannot be used, the physics became invalid, or a worker
                died.
        """
        config, options = parse(self.name, self.description, self.model, argv)
        return self.carry_out(argv, config, options)

    def carry_out(self, argv: Sequence[str], config: Config, options: Options) -> int:
        """Run what has been parsed."""
        with RunFolder.open(self.name, options.out, options.overwrite) as folder:
            folder.describe(self.name, argv, config)
            with progress(self.parts) as step, terminate_as_interrupt():
                outcome = self.run(config, options.worker_count, step, folder.append)
            result = self.result(outcome)
            for name, content in self.files(outcome).items():
                folder.write(name, content)
            folder.finish(result, self.rows(outcome))
            if options.json:
                sys.stdout.write(to_json(result))
            else:
                self.show(result)
            if not options.no_figures:
                self._draw(outcome, folder)
            sys.stderr.write(f"written to {folder.path}\n")
        return OK

    def _draw(self, outcome: Outcome, folder: RunFolder) -> None:
        from antennate import figures as style

        for name, figure in self.draw(outcome).items():
            for suffix, data in style.render(figure).items():
                folder.write(f"figures/{name}.{suffix}", data)
