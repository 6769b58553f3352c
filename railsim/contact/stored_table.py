"""Contact tables kept on disk between runs."""

import hashlib
import json
import os
import zlib
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

import numpy as np

from railsim.contact.table import (
    ContactTable,
    Normal,
    TableGrid,
    build_contact_table,
    complete_grid,
)
from railsim.kernels import cache, contact_geometry, elastic_patch, non_elliptic
from railsim.kernels import hertz as hertz_kernel
from railsim.kernels import table_slice as kernel
from railsim.kernels.lock import exclusive
from railsim.profiles.profile import Profile

MOST_OPEN = 16  # stored tables that a process keeps open, mapped and checked
# bytes of all stored tables, beyond which those go that have not been used for longest, and for an
# hour at least: some 70 of 0.12 GB
MOST_BYTES, IN_USE = 8e9, 3600.0


@lru_cache(1)
def generator_hash() -> str:
    """Hash of the sources that decide what a table holds."""
    digest = hashlib.sha256()
    here = Path(__file__).parent
    modules = (kernel, contact_geometry, elastic_patch, non_elliptic, hertz_kernel)
    sources = [Path(str(module.__file__)) for module in modules]
    for path in (here / "table.py", here / "curves.py", here / "zones.py", *sources):
        digest.update(path.read_bytes())
    return digest.hexdigest()


def cached_contact_table(
    wheel: Profile,
    rail: Profile,
    radius: float = 0.46,
    gauge: float = 1.435,
    inclination: float = 0.025,
    back_to_back: float = 1.360,
    tape_circle_distance: float = 1.5,
    G: float = 82e9,
    nu: float = 0.28,
    *,
    centre_height: float | None = None,
    normal: Normal | None = None,
    grid: TableGrid | None = None,
    widening: float = 0.0,
) -> ContactTable:
    """As `build_contact_table`, from the disk where the same table has been built before.

    The name of the stored table is a hash of everything that enters: both profiles, all numbers,
    the grid and the generator's sources.  Tables are written under a temporary name and renamed,
    so that parallel runs never see half a table; they are memory-mapped, so that parallel runs
    share one copy.  A table that is not, byte for byte, what was stored is built again: all of it
    is read once after each change of its file's number, size or time.
    """
    grid = complete_grid(grid, normal)
    numbers = (radius, gauge, inclination, back_to_back, tape_circle_distance, G, nu)
    height = centre_height
    digest = hashlib.sha256(generator_hash().encode())
    for part in (repr((numbers, height, grid, widening)).encode(), wheel.key(), rail.key()):
        digest.update(part)
    return load_or_build(
        digest.hexdigest(),
        lambda: build_contact_table(
            wheel, rail, *numbers, centre_height=height, grid=grid, widening=widening
        ),
    )


def load_or_build(digest: str, build: Callable[[], ContactTable]) -> ContactTable:
    """Return the table stored under a hash of all that enters, or build and store it."""
    folder = cache.cache_subfolder("tables")
    if folder is None:
        return build()
    path = folder / f"{digest[:32]}.npy"
    if stored := _stored_table(path):
        return stored
    with exclusive(folder / "tables.lock"):
        if stored := _stored_table(path):  # by the process that was waited for
            return stored
        table = build()
        _store_table(table, path)
    return table


def _stored_table(path: Path) -> ContactTable | None:
    text = cache.load(path.with_suffix(".json"))
    if text is None:
        return None
    try:
        found = path.stat()
    except OSError:
        return None
    return _checked_table(path, text, (found.st_mtime_ns, found.st_size, found.st_ino))


@lru_cache(MOST_OPEN)
def _checked_table(path: Path, text: bytes, stamp: tuple[int, ...]) -> ContactTable | None:
    """Table whose bytes were checked since its file last changed, by this process or another."""
    checked = path.with_suffix(".checked")
    known = repr(stamp).encode()
    try:
        facts = json.loads(text)
        crc = facts.pop("crc32")
        facts["w"] = np.array(facts["w"])
        table = ContactTable(values=np.load(path, mmap_mode="r"), **facts)
        with suppress(OSError):
            os.utime(path.with_suffix(".json"))  # the time of the last use
        if cache.load(checked) == known:
            return table
        whole = zlib.crc32(table.values.data) == crc
    except (OSError, ValueError, TypeError, KeyError, EOFError):
        whole = False
    if whole:
        cache.store(checked, known)
        return table
    for part in (path, path.with_suffix(".json")):
        cache.discard(part)
    return None


def _store_table(table: ContactTable, path: Path) -> None:
    if cache.load(path.with_suffix(".json")):  # meanwhile, by another process
        return  # on a network disk a file that others have mapped must not be replaced
    facts = {name: getattr(table, name) for name in ContactTable.__dataclass_fields__}
    facts["crc32"] = zlib.crc32(facts.pop("values").data)
    facts["w"] = table.w.tolist()

    def write(handle: int) -> None:
        with os.fdopen(os.dup(handle), "wb") as file:
            np.save(file, table.values)

    if cache.store_file(path, write):
        cache.store(path.with_suffix(".json"), json.dumps(facts).encode())
        with suppress(OSError):
            drop_unused(path.parent)


def drop_unused(folder: Path) -> None:
    """Remove the tables that have not been used for longest where all are larger than allowed."""
    tables = [path for path in folder.glob("*.json") if path.with_suffix(".npy").exists()]
    used = {path: path.stat().st_mtime for path in tables}
    sizes = {path: path.with_suffix(".npy").stat().st_size for path in tables}
    total, latest = sum(sizes.values()), max(used.values(), default=0.0)
    for path in sorted(used, key=used.__getitem__):
        if total <= MOST_BYTES or used[path] > latest - IN_USE:
            return
        for name in (".json", ".checked", ".npy"):  # without the first it is not read
            path.with_suffix(name).unlink(missing_ok=True)
        total -= sizes[path]
