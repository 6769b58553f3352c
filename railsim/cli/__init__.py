"""The command line: one module per command, imported when the command is called.

`main` is the entry point; only here does an exception become an exit status.  A command's
module holds a click command named `command`; heavy parts of railsim are imported inside its
function, so that ``railsim --help`` answers at once.
"""

import atexit
import gc
import logging
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict
from importlib import import_module
from typing import Any, cast

import click
from click.shell_completion import CompletionItem

from railsim.cli import interrupts
from railsim.cli.common import DONE, ENDED_EARLY, FAILED, LIMIT_EXCEEDED, WRONG_INPUT
from railsim.cli.interrupts import Interrupted
from railsim.cli.terminal import echo, print_json
from railsim.errors import InputError, ModelError, RailsimError, fault_lines, message_of, nearest
from railsim.files.access import remove_partial_files
from railsim.threads import use_one_thread
from railsim.version import __version__

use_one_thread()
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # for which all packages are read

COMPLETE = "_RAILSIM_COMPLETE"  # by which a shell asks for completions
# The compiler's objects live as long as the process: to look through them for garbage takes 0.18 s
# of a start and 0.3 s of the end
OBJECTS_BETWEEN_COLLECTIONS = 300_000

# name of a command, and what it does
COMMANDS = {
    "run": "One vehicle on one track: one HDF5 file and a table of peak values.",
    "study": "Every combination of vehicles, tracks and speeds.",
    "optimise": "Parameters of a vehicle against objectives and constraints.",
    "compare": "Results side by side: tables and overlaid plots.",
    "plot": "Time histories of a result; a track in plan.",
    "animate": "A vehicle and its contacts moving along the track.",
    "report": "One page of inputs, tables against limits and plots.",
    "fmu": "A vehicle on its track as an FMI 3.0 unit for other programs.",
    "export": "A result as CSV, for MATLAB, or as Parquet.",
    "assess": "Running safety and ride comfort of results.",
    "validate-model": "A model against a test: differences of section values and their limits.",
    "identify": "Parameters of a vehicle from measured runs.",
    "modes": "Eigenfrequencies, damping and mode shapes of a vehicle.",
    "critical-speed": "Linear and non-linear critical speed.",
    "curving": "Steady curving over radius, cant deficiency and friction.",
    "stationary": "Standing on twisted track and on cant, against limits.",
    "wear": "Wear of wheel profiles over the distance run, updated step by step.",
    "rail-wear": "Wear of rail profiles over the tonnage of mixed traffic.",
    "irregularity": "The track and wheel forces from accelerations of a vehicle.",
    "assess-track": "A recorded track judged by vehicles, beside geometry limits.",
    "contact": "Contact geometry of a wheel on a rail, equivalent conicity.",
    "spring": "Trailing-arm suspension: design and verify its coil springs.",
    "mechanism": "Planar linkages: kinematics, forces, optimisation.",
    "list": "Available vehicles, tracks, profiles and design files.",
    "validate": "Check files and list every fault.",
    "info": "Contents of a vehicle, track or result file on one screen.",
    "bench": "The runtime benchmark on this machine.",
}
SETTINGS = {"help_option_names": ["-h", "--help"], "show_default": True}
# others are called as their commands
MODULES = {"list": "library", "rail-wear": "wear:rails"}


class LazyGroup(click.Group):
    """A group whose commands are imported when they are called."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands."""
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command."""
        if cmd_name not in COMMANDS:
            return None
        module, _, name = MODULES.get(cmd_name, cmd_name.replace("-", "_")).partition(":")
        found = getattr(import_module(f"railsim.cli.{module}"), name or "command")
        return cast(click.Command, found)

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that the arguments begin with; a wrong name gets the nearest one."""
        if args and args[0] not in COMMANDS and not args[0].startswith("-"):
            ctx.fail(f"no command '{args[0]}'; {nearest(args[0], COMMANDS)}")
        return super().resolve_command(ctx, args)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the commands that begin so, without importing them."""
        if incomplete.startswith("-"):
            return super().shell_complete(ctx, incomplete)
        known = (name for name in COMMANDS if name.startswith(incomplete))
        return [CompletionItem(name, help=COMMANDS[name]) for name in known]

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands without importing them."""
        with formatter.section("Commands"):
            formatter.write_dl([*COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings=SETTINGS)
@click.version_option(__version__, prog_name="railsim")
def railsim() -> None:
    """Simulate the dynamics of rail vehicles.

    \b
    Example:
      railsim run coach_manchester curve_r250 --speed 20
    """


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status.

    `arguments`: arguments after the program's name; by default those of the process. Returns: 0
    done, 2 wrong input, 3 ended early for a physical reason, 4 a limit is exceeded where that was
    asked for, 130 interrupted by Ctrl-C (143 by SIGTERM), 1 anything else, such as a full disk. An
    unforeseen error is one line too, with the path of a report (`railsim.cli.fault_report`).
    """
    if arguments is None:
        gc.set_threshold(OBJECTS_BETWEEN_COLLECTIONS)
        atexit.register(gc.freeze)
    # the commands print themselves what the library logs
    logging.getLogger("railsim").addHandler(logging.NullHandler())
    # without a home matplotlib says at every start where it keeps its fonts instead
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    interrupts.usable_streams()
    if arguments is None and COMPLETE in os.environ:
        from click.shell_completion import shell_complete

        return shell_complete(railsim, {}, "railsim", COMPLETE, os.environ[COMPLETE])
    try:
        status = _status(arguments)
        for sentence in getattr(sys.modules.get("railsim.kernels.cache"), "notices", ()):
            echo(f"remark: {sentence}", err=True)
        sys.stdout.flush()
    except BrokenPipeError:
        interrupts.silence()
        return DONE
    except OSError as error:  # nobody can read what is printed: a full disk behind `>`
        interrupts.silence()
        with suppress(OSError):
            echo(f"railsim: {message_of(error)}", err=True)
        return FAILED
    return status


def _status(command_line: Sequence[str] | None) -> int:
    """Call a command and return the exit status that its end stands for."""
    arguments = sys.argv[1:] if command_line is None else list(command_line)
    with interrupts.remembered_interrupts(last=command_line is None):
        try:
            return _call(arguments)
        except InputError as error:
            faults = [fault.on_command_line() for fault in error.faults]
            for line in fault_lines(faults):
                echo(line, err=True)
            return _fail(arguments, WRONG_INPUT, {"faults": [asdict(fault) for fault in faults]})
        except RailsimError as error:
            echo(f"railsim: {error}", err=True)
            status = WRONG_INPUT if isinstance(error, ModelError) else FAILED
            return _fail(arguments, status, {"error": str(error)})
        except (KeyboardInterrupt, click.Abort) as interrupt:
            request = interrupt if isinstance(interrupt, Interrupted) else Interrupted()
            remove_partial_files()  # of one just created no block has taken care yet
            echo(f"railsim: {request}", err=True)
            return request.status
        except BrokenPipeError:
            raise
        except (OSError, MemoryError) as error:
            echo(f"railsim: {message_of(error)}", err=True)
            return FAILED
        except Exception as error:
            from railsim.cli.fault_report import write_report

            echo(f"railsim: {write_report(error, arguments)}", err=True)
            return FAILED


def _fail(arguments: Sequence[str], status: int, record: dict[str, Any]) -> int:
    """Print the error, as JSON if requested; return the status."""
    if "--json" in arguments:
        print_json({"exit_status": status, **record})
    return status


def _call(arguments: list[str]) -> int:
    """Call a command; if it fails after a lost interrupt, the interrupt is the reason."""
    try:
        with railsim.make_context("railsim", arguments) as context:
            status = railsim.invoke(context) or DONE
    except click.exceptions.Exit as end:
        status = end.exit_code
    except click.ClickException as error:
        where: click.Context | None = getattr(error, "ctx", None)
        if where is not None:
            echo(where.get_usage(), err=True)
        echo(f"railsim: {error.format_message()}", err=True)
        status = _fail(arguments, WRONG_INPUT, {"error": error.format_message()})
    except Exception:
        interrupts.raise_pending_signal()
        raise
    if status not in (DONE, ENDED_EARLY, LIMIT_EXCEEDED):
        interrupts.raise_pending_signal()
    return int(status)
