"""Finding and reading definition files: TOML, `extends` and `remove`.

The result is one nested table of plain values with its provenance: for each key the file that it
came from, so that a fault can be reported where it was written.
"""

import itertools
import os
import re
import sys
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from railsim.errors import Fault, Faults, InputError, argument_fault, input_error, nearest
from railsim.files.access import DEFINITION_BYTES, is_file, read_text
from railsim.files.key_paths import descend, key_path
from railsim.text import shortened

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

PACKAGE = Path(__file__).resolve().parent.parent
FOLDERS = {
    "vehicle": "vehicles",
    "track": "tracks",
    "spring": "vehicles/springs",
    "mechanism": "vehicles/mechanisms",
    "limits": "limits",
    "scenario": "scenarios",
    "published": "published",
    "study": "studies",
    "measurement": "examples/measured_run",
}
LAWS = "laws"
"""Folder of a library with Python files of laws."""
# Keys that hold the name of another file, relative to the file in which they stand.
FILE_KEYS = {"profile", "rail", "file"}
FILE_KEYS_OF = {
    "study": {"vehicles", "tracks", "settings", "limits"},
    "scenario": {"track", "wheels"},
    "mechanism": {"reference"},
}
"""Further ones in the files of a kind."""

DEEPEST = 50  # levels of tables and lists
MOST_KEYS = 100_000  # in a file; the largest vehicles and tracks have less
# A key of too many parts, quoted ones too: the parser's time grows with the square of the number.
_PART = r"""(?:[\w-]+|"(?:\\.|[^"\\\n])*"|'[^'\n]*')[ \t]*\.[ \t]*"""
_DEEP_KEY = re.compile(rf"""(?<![\w"'-])(?:{_PART}){{{DEEPEST}}}""")
_DECIMAL_COMMA = re.compile(r"=\s*[-+]?\d+,\d")
LONGEST_CHAIN = 20  # files that extend each other

KeyPath = tuple[str, ...]


OVERRIDE = "overrides"  # parameter that holds assignments, for the command line `--set`


def located_fault(file: str, key: str, found: str, allowed: str) -> Fault:
    """Return the fault of a key that came from a file or from an assignment."""
    if file == OVERRIDE:
        return argument_fault(OVERRIDE, key, found, allowed, "--set")
    return Fault(file, key, found, allowed)


@dataclass
class Source:
    """A definition as plain values.

    `file`: file that was asked for; `data`: its content with `extends` resolved and overrides
    applied; `origin`: file by key path; a key without an entry of its own came with its table.
    """

    file: str
    data: dict[str, Any] = field(default_factory=dict)
    origin: dict[KeyPath, str] = field(default_factory=dict)

    def file_of(self, path: KeyPath) -> str:
        """Return the file that holds a key, or the table around it."""
        for end in range(len(path), -1, -1):
            if path[:end] in self.origin:
                return self.origin[path[:end]]
        return self.file

    def fault(self, key: str, found: str, allowed: str = "") -> Fault:
        """Return a fault of this source with the file that holds the key."""
        return located_fault(self.file_of(tuple(key.split("."))), key, found, allowed)


def shipped_folder(kind: str) -> Path:
    """Return the folder of the vehicles or tracks that come with railsim."""
    installed, folder = PACKAGE / "shipped", FOLDERS.get(kind, LAWS)
    return (installed if installed.is_dir() else PACKAGE.parent) / folder


def library_folders(kind: str) -> Iterator[Path]:
    """Yield the folders in which a bare name is looked for, in their order.

    Those of the environment variable `RAILSIM_PATH`, those that come with railsim, and those of
    installed packages that declare an entry point of the group `railsim.library`.  Each library has
    the layout of railsim's own: `vehicles/`, `vehicles/springs/`, `tracks/`; and laws in `laws/`.
    """
    inside = FOLDERS.get(kind, LAWS)
    for folder in filter(None, os.environ.get("RAILSIM_PATH", "").split(os.pathsep)):
        yield Path(folder) / inside
    yield shipped_folder(kind)
    for entry in _installed_libraries(tuple(sys.path)):  # last: it takes some 50 ms
        library = entry.load()
        # a module stands for the folder that holds it
        root = Path(library.__file__).parent if hasattr(library, "__file__") else Path(library)
        yield root / inside


@cache
def _installed_libraries(_: tuple[str, ...]) -> "tuple[EntryPoint, ...]":
    """Entry points of libraries in the packages on a path."""
    from importlib.metadata import entry_points

    return tuple(entry_points(group="railsim.library"))


def library_files(kind: str) -> dict[str, Path]:
    """Return the files of the libraries by their bare names; the first of each name is used."""
    files: dict[str, Path] = {}
    for folder in library_folders(kind):
        for path in sorted(folder.glob("*.toml" if kind in FOLDERS else "*.py")):
            files.setdefault(path.stem, path)
    return dict(sorted(files.items()))


def find_file(name: str | Path, kind: str, beside: Path | None = None) -> Path:
    """Return the file that a path or a bare name means; a path wins over a name.

    `name`: path, or name of a shipped file without its ending; `kind`: what is looked for; settings
    have no shipped files; `beside`: file that names it: relative paths count from its folder.
    Raises InputError: there is no such file.
    """
    if not isinstance(name, str | os.PathLike):
        found = f"a {type(name).__name__}"
        raise TypeError(f"the file of the {kind} is {found}; give a path, or the name of one")
    folder = beside.parent if beside is not None else Path()
    candidates = [folder / name]
    if beside is not None:
        candidates.append(folder / f"{name}.toml")
    in_libraries: Iterable[Path] = ()
    if kind in FOLDERS:
        in_libraries = (folder / f"{name}.toml" for folder in library_folders(kind))
    same = None
    for candidate in itertools.chain(candidates, in_libraries):
        # a file of somebody else leads to definitions only
        if not is_file(candidate) or (beside is not None and candidate.suffix != ".toml"):
            continue
        # a file that extends its own name means the shipped one
        if beside is None or candidate.resolve() != beside.resolve():
            return candidate
        same = candidate
    if same is not None:
        return same
    raise InputError([_no_file(name, kind, candidates[0], beside)])


def find_any(name: str | Path) -> Path:
    """Return the file that a path or the bare name of anything shipped means.

    Raises InputError: there is no such file.
    """
    if is_file(name):
        return Path(name)
    for kind in FOLDERS:
        if str(name) in library_files(kind):
            return find_file(name, kind)
    found = f"'{name}' is a folder" if os.path.isdir(name) else f"no file '{name}'"
    names = {name for kind in FOLDERS for name in library_files(kind)}
    hint = nearest(str(name), names).removeprefix("allowed: ")
    raise input_error(name, found, f"a path, or a shipped name: {hint}")


def _no_file(name: str | Path, kind: str, path: Path, beside: Path | None) -> Fault:
    found = f"'{name}' is a folder" if os.path.isdir(path) else f"no file '{name}'"
    others = (k for k in FOLDERS if k != kind and str(name) in library_files(k))
    if beside is None and (other := next(others, None)):
        found = f"'{name}' is a shipped {other}"
    allowed = "a path"
    if kind in FOLDERS:
        names = nearest(str(name), library_files(kind)).removeprefix("allowed: ")
        allowed = f"a path, or the name of a shipped {kind} file: {names}"
    if beside is not None:
        return Fault(str(beside), "extends", found, allowed)
    if "," in str(name):
        allowed = "blanks between several names, no commas"
    return Fault(str(name), "", found, allowed)


def read_toml(path: Path, kind: str = "") -> dict[str, Any]:
    """Read a TOML file; `kind`: what it should hold.

    Raises InputError: it cannot be read, is not text or not TOML (with the line); where its ending
    is that of another file too, such as a table or a result, with what is expected.
    """
    try:
        return parse_toml(read_text(path, DEFINITION_BYTES), str(path))
    except InputError as error:
        if not kind or path.suffix in ("", ".toml"):
            raise
        expected = f"a {kind} file in TOML is expected here"
        raise InputError(replace(fault, allowed=expected) for fault in error.faults) from None


def parse_toml(text: str, file: str) -> dict[str, Any]:
    """Parse TOML text; `file` is its name in messages.

    Raises InputError: a syntax error, with its line; tables nested too deeply, too long a number.
    """
    if max(text.count("=") + text.count("\n["), text.count("{")) > MOST_KEYS:
        raise input_error(file, "too many keys", f"{MOST_KEYS} at most")
    try:
        if _DEEP_KEY.search(text):
            raise RecursionError
        data = tomllib.loads(text)
        if _depth(data) <= DEEPEST:
            return data
        raise RecursionError
    except RecursionError:
        found = "values nested too deeply"
        raise input_error(file, found, f"{DEEPEST} levels at most") from None
    except tomllib.TOMLDecodeError as error:
        position = re.search(r"\s*\(at line (\d+), column (\d+)\)", str(error))
        if position:
            message = str(error).replace(position.group(0), "")
            key = f"line {position.group(1)}"
            found = f"broken TOML at column {position.group(2)}: {message}"
            if _DECIMAL_COMMA.search(text.split("\n")[int(position.group(1)) - 1]):
                found += "; numbers have a decimal point, not a comma"
            elif message == "Cannot overwrite a value":
                found += "; the key has a value already"
        else:
            line = text.count("\n") + 1
            key, found = f"line {line}", f"broken TOML: {error}"
        suffix = Path(file).suffix
        allowed = "" if suffix in ("", ".toml") else f"a file in TOML, not {suffix}"
        raise input_error(file, found, allowed, key=key) from None
    except (ValueError, OverflowError) as error:  # a whole number of thousands of digits
        raise input_error(file, f"a value is out of range: {error}") from None


def _depth(data: Any) -> int:
    """Return how deeply tables and lists are nested; at most one more than `DEEPEST`.

    Raises ValueError: a whole number that needs more than TOML's 64 bits.
    """
    level, depth = [data], 0
    while level and depth <= DEEPEST:
        inner: list[Any] = []
        for node in level:
            members = node.values() if isinstance(node, dict) else node
            if any(isinstance(member, int) and member.bit_length() > 63 for member in members):
                raise ValueError("a whole number of more than 64 bits")
            inner += [member for member in members if isinstance(member, dict | list)]
        level, depth = inner, depth + 1
    return depth


def read_source(path: Path, kind: str, data: dict[str, Any] | None = None) -> Source:
    """Read a file, unless its content is given, and everything that it extends.

    Raises InputError: a file is missing or broken, or the chain of `extends` runs in a circle.
    """
    return _extended(data or read_toml(path, kind), path, kind, (path.resolve(),))


def text_source(text: str, file: str, kind: str) -> Source:
    """Return the source of a text; relative paths in it count from the current folder."""
    return _extended(parse_toml(text, file), Path(file), kind, ())


def _extended(data: dict[str, Any], path: Path, kind: str, chain: tuple[Path, ...]) -> Source:
    data, base_name, removed = _without_extends(data, path)
    _anchor_files(data, path.parent, FILE_KEYS | FILE_KEYS_OF.get(kind, set()))
    source = Source(str(path), data, dict.fromkeys(_paths(data, ()), str(path)))
    if base_name is None:
        return source
    # the file's own kind, so that a file of a wrong kind is told by its format, not by its base
    stated = str(data.get("format")).removeprefix("railsim-").partition("/")[0]
    base_path = find_file(base_name, stated if stated in FOLDERS else kind, beside=path)
    if base_path.resolve() in chain:
        names = " -> ".join(p.name for p in (*chain, base_path))
        raise input_error(path, f"a circle: {names}", "a chain with an end", key="extends")
    if len(chain) > LONGEST_CHAIN:
        found = f"the {len(chain)}th file in a chain"
        raise input_error(path, found, f"{LONGEST_CHAIN} at most", key="extends")
    base = _extended(read_toml(base_path), base_path, kind, (*chain, base_path.resolve()))
    faults = Faults()
    for key in removed:
        try:
            parent, last = descend(base.data, key_path(key))
            if isinstance(parent, dict) and last not in parent:
                raise KeyError(nearest(last, parent))
            del parent[last]
        except KeyError as missing:
            found, allowed = f"no key {key!r} in {base.file}", str(missing.args[0])
            faults.append(Fault(str(path), "remove", found, allowed))
    faults.check()
    if kind == "limits":
        Faults(_source_faults(base.data, data, (), str(path))).check()
    _merge(base.data, data, (), base.origin, str(path))
    return Source(str(path), base.data, base.origin)


def _source_faults(
    table: Mapping[str, Any], changes: Mapping[str, Any], path: KeyPath, file: str
) -> Iterator[Fault]:
    """Yield a fault of each value that would bear the source, or the check, of the one it replaces.

    A table with a `source` speaks for all that is below it.
    """
    for key in ("source", "checked") if changes.keys() - {"checked"} else ():
        if table.get(key) and key not in changes:
            key = ".".join((*path, key))
            yield Fault(file, key, "missing", "needed beside a value in place of another")
    for key, value in changes.items():
        old = table.get(key)
        if isinstance(value, dict) and isinstance(old, dict):
            yield from _source_faults(old, value, (*path, key), file)


def _paths(node: Any, path: KeyPath) -> Iterator[KeyPath]:
    """Yield the key paths of everything in a nested table; a list comes as a whole."""
    if isinstance(node, dict):
        for key, value in node.items():
            yield (*path, str(key))
            yield from _paths(value, (*path, str(key)))


def _without_extends(
    data: dict[str, Any], path: Path
) -> tuple[dict[str, Any], str | None, list[str]]:
    data = dict(data)
    base = data.pop("extends", None)
    removed = data.pop("remove", [])
    faults = Faults()
    if base is not None and not isinstance(base, str):
        found, allowed = shortened(repr(base)), "a path or the name of a file"
        faults.append(Fault(str(path), "extends", found, allowed))
    if not isinstance(removed, list) or not all(isinstance(key, str) for key in removed):
        found, allowed = shortened(repr(removed)), "a list of dotted key paths"
        faults.append(Fault(str(path), "remove", found, allowed))
    elif removed and base is None:
        faults.append(Fault(str(path), "remove", "no 'extends'", "'remove' goes with 'extends'"))
    faults.check()
    return data, base, removed


def _merge(
    table: dict[str, Any],
    changes: dict[str, Any],
    parent: KeyPath,
    origin: dict[KeyPath, str],
    file: str,
) -> None:
    """Put `changes` over a table; a table of another `kind` replaces the old one as a whole."""
    for key, value in changes.items():
        path = (*parent, key)
        old = table.get(key)
        origin[path] = file
        kind = old.get("kind") if isinstance(old, dict) else None
        if isinstance(value, dict) and isinstance(old, dict) and value.get("kind", kind) == kind:
            _merge(old, value, path, origin, file)
        else:
            table[key] = value
            replace_origin(origin, path, old, value, file)


def replace_origin(
    origin: dict[KeyPath, str], path: KeyPath, old: Any, value: Any, file: str
) -> None:
    """Note that the value at a path, with everything in it, came from a file."""
    for old_path in _paths(old, path):
        origin.pop(old_path, None)
    origin[path] = file
    origin.update(dict.fromkeys(_paths(value, path), file))


def _anchor_files(node: Any, folder: Path, keys: set[str]) -> None:
    """Make the names of existing files absolute, so that they mean the same from everywhere."""
    members = node.items() if isinstance(node, dict) else enumerate(node)
    for key, value in list(members):
        if key in keys and not isinstance(value, dict):
            node[key] = _anchor(value, folder)
        elif isinstance(value, dict | list):  # in a table under such a key all may be files
            _anchor_files(value, folder, keys.union(value) if key in keys else keys)


def _anchor(value: Any, folder: Path) -> Any:
    if isinstance(value, list):
        return [_anchor(member, folder) for member in value]
    if isinstance(value, str) and value and is_file(folder / value):
        return str((folder / value).resolve())
    return value
