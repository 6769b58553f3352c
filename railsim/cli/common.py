"""What the commands share: options, the definitions that they name, and how they answer."""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field, fields, replace
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import click
from click.core import ParameterSource
from click.shell_completion import CompletionItem

from railsim.cli.progress import progress_bar
from railsim.cli.terminal import echo, print_json, show
from railsim.errors import Fault, Faults, changed_faults, input_error
from railsim.files import access
from railsim.files.sources import OVERRIDE, find_file, library_files, read_source
from railsim.text import plain

if TYPE_CHECKING:
    from railsim.definitions import Settings, Track, Vehicle
    from railsim.definitions.base import Remark
    from railsim.definitions.file_definition import FileDefinition
    from railsim.studies.spec import RunSpec
    from railsim.table import Table

F = TypeVar("F", bound=Callable[..., Any])

DONE, FAILED, WRONG_INPUT, ENDED_EARLY, LIMIT_EXCEEDED = 0, 1, 2, 3, 4  # exit statuses
COUNT, FROM_0 = click.IntRange(min=1), click.IntRange(min=0)


def option(
    names: str, words: str, metavar: str | None = None, kind: Any = None, **more: Any
) -> Callable[[F], F]:
    """Return an option of a command by its name, and its parameter's where that is another."""
    return click.option(*names.split(), help=words, metavar=metavar, type=kind, **more)


def choice(names: str, words: str, values: str, **more: Any) -> Callable[[F], F]:
    """Return an option with one of several values, ``one|another``; by default the first."""
    allowed = values.split("|")
    return option(names, words, kind=click.Choice(allowed), **{"default": allowed[0]} | more)


def repeated(names: str, words: str, metavar: str, *kind: Any, **more: Any) -> Callable[[F], F]:
    """Return an option that may be given several times."""
    return option(names, words, metavar, *kind, multiple=True, **more)


def values(names: str, words: str, metavar: str, **more: Any) -> Callable[[F], F]:
    """Return an option with several values, see `values_of`."""

    def parse(ctx: Any, param: click.Parameter, text: str | None) -> list[float] | None:
        return values_of(text, param.opts[0]) if text is not None else None

    return option(names, words, metavar, callback=parse, **more)


def flag(name: str, words: str, **more: Any) -> Callable[[F], F]:
    """Return an option without a value."""
    return click.option(*name.split(), is_flag=True, help=words, **more)


def _given_options(names: Sequence[str]) -> list[str]:
    """Return those of some parameters that the command line gives, as it calls them."""
    context = click.get_current_context()
    return [
        param.opts[0] if isinstance(param, click.Option) else str(param.metavar).strip("[]")
        for param in context.command.params
        if param.name in names
        and context.get_parameter_source(param.name) is ParameterSource.COMMANDLINE
    ]


def refusals(found: str, allowed: str, *names: str) -> Faults:
    """Return a fault for each of some parameters that the command line gives."""
    return Faults(Fault(option, "", found, allowed) for option in _given_options(names))


def goes_with(partner: str, present: object, *names: str) -> None:
    """Refuse parameters that the command line gives without their partner: they do nothing."""
    options = _given_options(names)
    if options and not present:
        verb = "goes" if len(options) == 1 else "go"
        raise click.UsageError(f"{' and '.join(options)} {verb} with {partner}")


def together(*options: Callable[[Any], Any]) -> Callable[[F], F]:
    """Return several options as one decorator, in this order."""

    def add(function: Any) -> Any:
        for each in reversed(options):
            function = each(function)
        return function

    return add


def as_speed(text: object) -> float:
    """Return a speed in m/s, or with a unit: ``72km/h``; a type of options."""
    from railsim.units import speed_in_si

    try:
        return float(speed_in_si(str(text)))
    except ValueError:
        raise click.BadParameter(f"'{text}' is not a speed, such as 20 or 72km/h") from None


def in_unit(unit: str) -> Callable[[object], float]:
    """Return a type of options: a number in a unit, which may stand behind it, ``350m``."""

    def read(text: object) -> float:
        try:
            return float(str(text).strip().removesuffix(unit))
        except ValueError:
            words = f"'{text}' is not a number in {unit}, such as 350 or 350{unit}"
            raise click.BadParameter(words) from None

    return read


def names_of(kind: str) -> Callable[..., list[Any]]:
    """Return what completes an argument in a shell: names of shipped files, or a file."""

    def complete(ctx: click.Context, param: click.Parameter, incomplete: str) -> list[Any]:
        names = [name for name in library_files(kind) if name.startswith(incomplete)]
        return [*map(CompletionItem, names)] or [CompletionItem(incomplete, type="file")]

    return complete


def remarks_on(definition: "FileDefinition", *, supports: bool = True) -> list["Remark"]:
    """Return what is allowed but unusual in a definition, and in a vehicle's `supports` at rest."""
    from railsim.definitions import Track, Vehicle
    from railsim.definitions.base import Remark

    notes = definition.unusual()
    if isinstance(definition, Vehicle):
        from railsim.model.plausibility import vehicle_remarks

        notes = [*notes, *vehicle_remarks(definition, supports=supports)]
    if isinstance(definition, Track):
        from railsim.track.irregularity import measured_remarks

        notes = [*notes, *(Remark("irregularities", text) for text in measured_remarks(definition))]
    if isinstance(definition, Vehicle | Track):
        from railsim.laws.permission import refused_laws

        left_out = "not executed here: left out of pictures and of the vehicle at rest"
        notes = [*notes, *(Remark(f"laws.{name}", left_out) for name in refused_laws(definition))]
    return notes


json_option = flag("--json as_json", "Machine-readable results on stdout.")
quiet_option = flag("--quiet", "No progress bars and fewer remarks.")
overwrite_option = flag("--overwrite", "Replace output that exists.")
set_option = repeated("--set assignments", "Replace a value; may be repeated.", "KEY.PATH=VALUE")
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

extent_options = together(
    option("--start", "Start in m along the track; default 0.", "S", in_unit("m")),
    option("--duration", "Length of the run in s.", "T", in_unit("s")),
    option("--until", "End of the run in m along the track.", "S", in_unit("m")),
)


def _allow(ctx: click.Context, param: click.Parameter, files: Any) -> None:
    """Permit user-defined laws: all that the files name, or those of some files."""
    if files:
        from railsim.laws.permission import allow

        known = {} if files is True else library_files("law")
        paths = [] if files is True else [known.get(file, Path(file)) for file in files]
        allow(*(access.read_text(path, access.DEFINITION_BYTES) for path in paths))


_allowed: dict[str, Any] = {"expose_value": False, "callback": _allow}
allow_code_option = flag("--allow-code", "Execute Python code of laws that files name.", **_allowed)
_law_option = repeated("--law", "Execute the laws of this file or name.", "FILE", **_allowed)
code_options = together(allow_code_option, _law_option)


def options_as_object(name: str, kind: type, *options: Callable[[F], F]) -> Callable[[F], F]:
    """Return what adds options to a command, which takes their values as one object.

    `name`: parameter of the command; `kind`: dataclass of the object, with the options' parameters
    as its fields.
    """
    keys = [field.name for field in fields(kind) if field.init]

    def add(function: F) -> F:
        @wraps(function)
        def command(**values: Any) -> Any:
            load = values.get("load")
            option_values = {key: values.pop(key) for key in keys if key in values}

            def as_load_option(fault: Fault) -> Fault:  # --load stands for an assignment
                of_load = fault.option == "--set" and fault.key in ("load", "vehicle.load")
                return replace(fault, key="", option="--load") if load and of_load else fault

            with changed_faults(as_load_option):
                return function(**values, **{name: kind(**option_values)})

        return together(*options)(command)  # type: ignore[return-value]

    return add


linearisation_options = together(
    choice("--linearisation", "Contact: its derivative or first harmonic.", "tangent|harmonic"),
    option("--amplitude", "Lateral, of the wheelsets, for harmonic, m.", "A", float, default=3e-3),
)


def faults_in(file: str, kind: str, name: str) -> AbstractContextManager[None]:
    """Let faults that computing finds name the file of their key, as those of loading do.

    `file`: as given on the command line: a path, or the name of a shipped file; `kind`: what it
    holds: spring, mechanism; `name`: the definition's own name, which faults found by computing
    bear.
    """

    def locate(fault: Fault) -> Fault:
        if fault.file not in ("", name):
            return fault
        return read_source(find_file(file, kind), kind).fault(fault.key, fault.found, fault.allowed)

    return changed_faults(locate)


MOST_VALUES = 2000


class Inputs(NamedTuple):
    """Definitions of an analysis."""

    vehicle: "Vehicle"
    track: "Track"
    settings: "Settings"


@dataclass(frozen=True)
class Given:
    """Values of VEHICLE, TRACK, ``--load``, ``--settings``, ``--set``, as far as there are any."""

    vehicle: str = ""
    track: str | None = None
    load: str | None = None
    settings: str | None = None
    assignments: tuple[str, ...] = ()

    @property
    def overrides(self) -> tuple[str, ...]:
        """The assignments with that of the load case."""
        load = () if self.load is None else (f"vehicle.load={self.load}",)
        return (*self.assignments, *load)

    def inputs(self, changes: Sequence[str] = ()) -> Inputs:
        """Load vehicle, track (by default ``straight``) and settings, with assignments of --over.

        Raises InputError: everything that is wrong in any of them.
        """
        from railsim.definitions.loading import load_settings, load_track, load_vehicle
        from railsim.files.overrides import split_overrides

        faults, parts = Faults(), dict[str, list[str]](vehicle=[], track=[], settings=[])
        with faults.caught():
            parts = split_overrides([*self.overrides, *changes])
        with faults.caught():
            coach = load_vehicle(self.vehicle, parts["vehicle"])
        with faults.caught():
            rails = load_track("straight" if self.track is None else self.track, parts["track"])
        with faults.caught():
            settings = load_settings(self.settings, parts["settings"])
        if changes:  # without them the inputs have been loaded before, free of faults
            of_over = (replace(f, option="--over") if f.file == OVERRIDE else f for f in faults)
            faults = Faults(of_over)
        faults.check()
        return Inputs(coach, rails, settings)

    def run(self, speed: float | None, **extent: Any) -> "RunSpec":
        """Return the run of the inputs at a speed."""
        from railsim.studies.spec import RunSpec

        how: Any = {"settings": self.settings, "assignments": self.overrides, **extent}
        return RunSpec(self.vehicle, str(self.track), speed, **how)


def given_options(settings: str = "", *, load: bool = True) -> Callable[[F], F]:
    """Add ``--load``, ``--settings`` and ``--set``; the command takes them as `given`.

    With them it takes VEHICLE and TRACK, or ``--vehicle`` and ``--track``, which it has besides.

    `settings`: what counts of the settings file, by default all.
    """
    words = f"Settings file: {settings}." if settings else "Settings file."
    options: list[Any] = [option("--settings", words, "F"), set_option]
    return options_as_object("given", Given, *[load_option] * load, *options)


def values_of(text: str, option: str) -> list[float]:
    """Return the values of ``A:B:N`` (N values from A to B) or ``A,B,C``; units may stand behind.

    Each is returned once.

    >>> values_of("10:20:3", "--speeds"), values_of("0.2,0.4,0.2", "--friction")
    ([10.0, 15.0, 20.0], [0.2, 0.4])
    >>> values_of("36:72:2 km/h", "--speeds"), values_of("36km/h,20", "--speeds")
    ([10.0, 20.0], [10.0, 20.0])
    """
    from railsim.units import number_with_unit, range_values

    allowed = "first:last:number, such as 10:60:26, at least 2; or values with commas between"
    try:
        values = range_values(text)
        if values is None:
            each = ((number_with_unit(part), part) for part in text.split(","))
            values = [float(part) if number is None else number for number, part in each]
        if len(values) > MOST_VALUES:
            raise ValueError
    except ValueError:
        raise input_error(option, f"found '{text}'", allowed) from None
    if not all(abs(value) < float("inf") for value in values):
        raise input_error(option, f"found '{text}'", "finite numbers")
    return list(dict.fromkeys(values))


@dataclass
class Output:
    """Values of ``--out``, ``--overwrite``, ``--json``, ``--quiet``.

    `written`: files written so far.
    """

    out: str | None = None
    overwrite: bool = False
    as_json: bool = False
    quiet: bool = False
    written: list[Path] = field(default_factory=list, init=False)

    @property
    def folder(self) -> Path | None:
        """The folder of ``--out``."""
        return Path(self.out) if self.out else None

    def reserve(self, *names: str) -> Path | None:
        """Refuse the folder before anything is computed, if these files cannot be written."""
        if self.folder is not None:
            access.check_folder(self.folder, names, overwrite=self.overwrite)
        return self.folder

    def file(self, default: str | Path, endings: Sequence[str] = (), suffix: str = "") -> Path:
        """Return the file of ``--out``, by default another with this suffix; refuse it early."""
        path = Path(self.out or default)
        if not self.out and path.name and suffix:
            # a name of the library may end in a number: turnout_245_1in9.25
            path = path.with_name((path.stem if path.suffix[1:2].isalpha() else path.name) + suffix)
        access.check_file(path, overwrite=self.overwrite, endings=endings)
        return path

    def write(self, name: str, content: Any) -> None:
        """Write a file into the folder, if there is one.

        `name`: its name; `content`: bytes, a text, a `Table` (as CSV), a figure, or plain data (as
        JSON); a function that returns one of them is called only where something is written.
        """
        if self.folder is not None:
            data = {name: _bytes(content)}
            self.written += access.write_folder(self.folder, data, overwrite=True)

    def write_all(self, content: Mapping[str, Any]) -> None:
        """Write files into the folder, all of them or none; contents as of `write`.

        One alone would refuse the same command, which is to go on after an interruption.
        """
        if self.folder is not None:
            data = {name: _bytes(one) for name, one in content.items()}
            self.written += access.write_folder(self.folder, data, overwrite=self.overwrite)

    def answer(
        self, record: Any, parts: "Iterable[str | Table]" = (), remarks: Iterable[object] = ()
    ) -> None:
        """Print the record as JSON; or texts and tables, remarks, and what was written."""
        if self.as_json:
            print_json(record)
            return
        show(*parts, *(() if self.quiet else (f"remark: {remark}" for remark in remarks)))
        for path in self.written:
            echo(path)

    def finish(
        self, names: Any, result: Any, parts: Any, remarks: Iterable[object] = (), **more: Any
    ) -> None:
        """Write record, with `more`, and plot of a result under two names, and answer with them."""
        record = result.record()
        for entry in record if isinstance(record, list) else [record]:
            entry |= more
        self.write_all({names[0]: record, names[1]: result.plot})
        self.answer(record, parts, remarks)

    def progress(self, words: str) -> AbstractContextManager[Callable[[float], None]]:
        """Show progress under these words, see `railsim.cli.progress.progress_bar`."""
        return progress_bar(words, quiet=self.quiet)

    @contextmanager
    def studying(self, words: str) -> Iterator[dict[str, Any]]:
        """Give what studies take: whether to overwrite, whom to tell progress and remarks."""
        with self.progress(words) as progress:
            yield {"overwrite": self.overwrite, "progress": progress, "on_remark": self.remark}

    def remark(self, text: object) -> None:
        """Print a remark on stderr, also if quiet."""
        echo(f"remark: {text}", err=True)

    def wrote(self, path: str | Path, **facts: Any) -> None:
        """Answer with the only file that a command has written; ``--quiet`` not at all."""
        if self.as_json or not self.quiet:
            self.written.append(Path(path))
            self.answer({"file": str(path), **facts})


def _bytes(content: Any) -> bytes:
    from railsim.table import Table

    content = content() if callable(content) else content
    if isinstance(content, bytes):
        return content
    if hasattr(content, "savefig"):
        from railsim.plot.style import to_bytes

        return to_bytes(content)
    if isinstance(content, Table):
        content = content.csv()
    elif not isinstance(content, str):
        content = json.dumps(plain(content), indent=1, allow_nan=False) + "\n"
    return str(content).encode()


def output_options(out: str = "") -> Callable[[F], F]:
    """Add ``--overwrite``, ``--json``, ``--quiet``, and ``--out DIR`` where `out` says for what.

    The command takes them as `output`.
    """
    folder = [option("--out", out, "DIR")] if out else []
    return options_as_object("output", Output, *folder, overwrite_option, json_option, quiet_option)


answer_options = options_as_object("output", Output, json_option, quiet_option)
"""Adds ``--json`` and ``--quiet``; the command takes them as `output`."""
