"""``railsim list``: what vehicles, tracks, profiles and design files there are."""

from pathlib import Path
from typing import Any

import click

from railsim.cli import common as cli
from railsim.errors import Fault, Faults, nearest
from railsim.files.access import check_folder, make_folder


@click.command()
@click.argument("kinds", nargs=-1, metavar="[KIND]...")
@cli.option("--draw", "Draw every listed vehicle and track into this folder.", "DIR")
@cli.output_options()
def command(kinds: tuple[str, ...], draw: str | None, output: cli.Output) -> None:
    """List everything that can be given by its bare name: vehicles, tracks, profiles, laws ...

    Besides railsim's own files, the list contains those of the folders in the environment variable
    RAILSIM_PATH and of installed packages with an entry point `railsim.library`.

    \b
    Example:
      railsim list vehicles
    """
    from railsim.description.library import KINDS, LAWS, MEANING, PROFILES, library_entries
    from railsim.table import Column, Table

    allowed = [*KINDS, PROFILES, LAWS]
    wrong = (kind for kind in kinds if kind not in allowed)
    Faults(Fault("list", "", f"no kind '{one}'", nearest(one, allowed)) for one in wrong).check()
    entries = [entry for kind in kinds or allowed for entry in library_entries(kind)]
    if draw is not None:
        _draw(entries, Path(draw), output)
    parts: list[str | Table] = []
    for kind in kinds or allowed:
        rows = [entry for entry in entries if entry["kind"] == kind]
        if not rows:
            parts += [f"{kind}: none", ""]
            continue
        quality = [Column("trust", "source quality")] * any(entry["trust"] for entry in rows)
        parts += [kind, Table([Column("name"), *quality, Column("title", " ")], rows), ""]
    if any(entry["trust"] for entry in entries):
        meanings = ", ".join(f"{letter} {meaning}" for letter, meaning in MEANING.items())
        parts.append(f"source quality, the most frequent first: {meanings}")
    output.answer(entries, parts)


def _draw(entries: list[dict[str, Any]], folder: Path, output: cli.Output) -> None:
    from railsim.definitions.loading import load_any

    drawn = [entry for entry in entries if entry["kind"] in ("vehicles", "tracks")]
    check_folder(folder, [f"{entry['name']}.png" for entry in drawn], overwrite=output.overwrite)
    make_folder(folder)
    with output.progress("drawing") as show:
        for number, entry in enumerate(drawn, start=1):
            entry["picture"] = str(folder / f"{entry['name']}.png")
            definition: Any = load_any(entry["file"])
            definition.plot(entry["picture"], overwrite=output.overwrite)
            show(number / len(drawn))
