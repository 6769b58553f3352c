"""What the commands share: options, tables, machine-readable output."""

import json
import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from railsim.text import printable

if TYPE_CHECKING:
    from railsim.definitions.base import Remark
    from railsim.definitions.file_definition import FileDefinition
    from railsim.table import Table

F = TypeVar("F", bound=Callable[..., Any])


COUNT = click.IntRange(min=1)


def option(
    names: str, words: str, metavar: str | None = None, kind: Any = None, **more: Any
) -> Callable[[F], F]:
    """Return an option of a command by its name, and its parameter's where that is another."""
    return click.option(*names.split(), help=words, metavar=metavar, type=kind, **more)


def flag(name: str, words: str, **more: Any) -> Callable[[F], F]:
    """Return an option without a value."""
    return click.option(*name.split(), is_flag=True, help=words, **more)


class Speed(click.ParamType):  # type: ignore[type-arg]
    """A speed in m/s, or with a unit: ``72km/h``."""

    name = "speed"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Return the speed in m/s."""
        from railsim.units import speed_in_si

        try:
            return float(speed_in_si(str(value)))
        except ValueError:
            self.fail(f"'{value}' is not a speed, such as 20 or 72km/h", param, ctx)


def echo(text: object = "", *, err: bool = False) -> None:
    """Print a line, on stderr with `err`; what would steer the terminal is shown as its code."""
    click.echo(printable(str(text)), err=err)


def show(*parts: "str | Table") -> None:
    """Print lines and tables; a terminal gets both in its width, coloured unless ``NO_COLOR``."""
    terminal = sys.stdout.isatty()
    width = shutil.get_terminal_size().columns if terminal else None
    for part in parts:
        if isinstance(part, str):
            for line in part.split("\n"):
                echo(in_width(line, width))
        else:  # texts of tables are literal already
            lines = part.lines(width, colour=terminal and not os.environ.get("NO_COLOR"))
            click.echo("\n".join(lines))


def in_width(line: str, width: int | None) -> str:
    """Return a line, in several ones where a terminal is narrower, under its first word."""
    if width is None or len(line) <= width or not line.strip():
        return line
    indent = " " * (len(line) - len(line.lstrip()) + 2)
    return textwrap.fill(
        line, width, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False
    )


def names_of(kind: str) -> Callable[..., list[Any]]:
    """Return what completes an argument in a shell: names of shipped files, or a file."""

    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:
        from click.shell_completion import CompletionItem

        from railsim.files.sources import shipped_names

        names = [name for name in shipped_names(kind) if name.startswith(incomplete)]
        return [*map(CompletionItem, names)] or [CompletionItem(incomplete, type="file")]

    return complete


def remarks_on(definition: "FileDefinition", *, supports: bool = True) -> list["Remark"]:
    """Return what is allowed but unusual in a definition, and in a vehicle's `supports` at rest."""
    from railsim.definitions import Track, Vehicle
    from railsim.definitions.base import Remark

    found = definition.unusual()
    if isinstance(definition, Vehicle):
        from railsim.model.plausibility import vehicle_remarks

        found = [*found, *vehicle_remarks(definition, supports=supports)]
    if isinstance(definition, Track):
        from railsim.track.irregularity import measured_remarks

        texts = measured_remarks(definition)
        found = [*found, *(Remark("irregularities", text) for text in texts)]
    if isinstance(definition, Vehicle | Track):
        from railsim.laws.permission import refused

        left_out = "not executed here: left out of pictures and of the vehicle at rest"
        found = [*found, *(Remark(f"laws.{name}", left_out) for name in refused(definition))]
    return found


json_option = flag("--json as_json", "Machine-readable results on stdout.")
quiet_option = flag("--quiet", "No progress bars and remarks.")
overwrite_option = flag("--overwrite", "Replace output that exists.")
set_option = option(
    "--set assignments",
    "Replace one value of the input; may be given several times.",
    "KEY.PATH=VALUE",
    multiple=True,
)
load_option = option("--load", "Load case of the vehicle; by default its design load.", "NAME")
workers_option = option("--workers", "Number of processes; default: all cores.", "N", COUNT)
scheduler_option = option("--scheduler", "Address of a dask scheduler to run on.", "ADDRESS")
fail_option = flag("--fail", "Exit status 4 where a limit is exceeded.")
rails_option = option("--track", "Rails, gauge, friction, support; default straight.", "F")
vehicle_argument = click.argument("vehicle", shell_complete=names_of("vehicle"))
track_argument = click.argument("track", shell_complete=names_of("track"))
optional_track = click.argument(
    "track", metavar="[TRACK]", required=False, shell_complete=names_of("track")
)


def extent_options(function: F) -> F:
    """Add ``--start``, ``--duration``, ``--until``."""
    for option, metavar, words in (
        ("--until", "S", "End of the run in m along the track."),
        ("--duration", "T", "Length of the run in s."),
        ("--start", "S", "Start in m along the track; default 0."),
    ):
        function = click.option(option, type=float, metavar=metavar, help=words)(function)
    return function


def _allow(ctx: click.Context, param: click.Parameter, files: Any) -> None:
    """Permit laws of one's own: all that the files name, or those of some files."""
    if files:
        from railsim.files.access import DEFINITION_BYTES, read_text
        from railsim.files.sources import library_files
        from railsim.laws.permission import allow

        known = {} if files is True else library_files("law")
        paths = [] if files is True else [known.get(file, Path(file)) for file in files]
        allow(*(read_text(path, DEFINITION_BYTES) for path in paths))


allow_code_option = flag(
    "--allow-code",
    "Execute the Python code of laws that the files name.",
    expose_value=False,
    callback=_allow,
)


def code_options(function: F) -> F:
    """Add ``--allow-code`` and ``--law``, which permit laws of one's own."""
    files = option(
        "--law",
        "Execute the laws of this file, or of this name; may be given several times.",
        "FILE",
        multiple=True,
        expose_value=False,
        callback=_allow,
    )
    return allow_code_option(files(function))


def collected(name: str, kind: type, *options: Callable[[F], F]) -> Callable[[F], F]:
    """Return what adds options to a command, which takes their values as one object.

    `name`: parameter of the command; `kind`: dataclass of the object, with the options' parameters
    as its fields.
    """
    keys = [field.name for field in fields(kind) if field.init]

    def add(function: F) -> F:
        @wraps(function)
        def command(**values: Any) -> Any:
            own = {key: values.pop(key) for key in keys if key in values}
            return function(**values, **{name: kind(**own)})

        for option in reversed(options):
            command = option(command)
        return command  # type: ignore[return-value]

    return add


def linearisation_options(function: F) -> F:
    """Add ``--linearisation`` and ``--amplitude``."""
    linearisation = option(
        "--linearisation",
        "Contact: its derivative, or its first harmonic for --amplitude.",
        kind=click.Choice(["tangent", "harmonic"]),
        default="tangent",
    )
    amplitude = option(
        "--amplitude",
        "Lateral amplitude of the wheelsets in m, for harmonic.",
        "A",
        float,
        default=3e-3,
    )
    return linearisation(amplitude(function))


@contextmanager
def faults_in(file: str, kind: str, name: str) -> Iterator[None]:
    """Let faults that computing finds name the file of their key, as those of loading do.

    `file`: as given on the command line: a path, or the name of a shipped file; `kind`: what it
    holds: spring, mechanism; `name`: the definition's own name, which faults found by computing
    bear.
    """
    from railsim.errors import InputError
    from railsim.files.sources import find_file, read_source

    try:
        yield
    except InputError as error:
        source = read_source(find_file(file, kind), kind)
        raise InputError(
            source.fault(fault.key, fault.found, fault.allowed)
            if fault.file in ("", name)
            else fault
            for fault in error.faults
        ) from None


def print_json(data: Any) -> None:
    """Print data as JSON; numbers that JSON lacks become null."""
    click.echo(json.dumps(plain(data), indent=2, allow_nan=False))


def plain(data: Any) -> Any:
    """Return data as JSON can hold it: names as text, numbers that it lacks as null."""
    if isinstance(data, dict):
        return {str(key): plain(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [plain(value) for value in data]
    if isinstance(data, float):
        return data if abs(data) < float("inf") else None
    return data
