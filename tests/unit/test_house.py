"""The house itself: sizes of functions and modules, and where numba's inside may be used."""

import ast
import gc
import re
from functools import cache
from pathlib import Path

import pytest

import railsim

PACKAGE = Path(railsim.__file__).parent
PARAMETERS, FUNCTION, MODULE = 10, 80, 500
# beyond a limit, with the reason
LARGER = {"notation.py": "the table of quantities"}
# public functions that take the numbers of one patch or pair of profiles
MORE_PARAMETERS = {"creep_force", "exact_creep_force"}


@pytest.fixture(autouse=True, scope="module")
def million_nodes():
    """The syntax trees, which no collection of garbage searches, and which go with these tests."""
    gc.disable()
    nodes()
    gc.enable()
    yield
    nodes.cache_clear()
    modules.cache_clear()


@cache
def modules():
    return {
        path.relative_to(PACKAGE).as_posix(): ast.parse(path.read_text())
        for path in sorted(PACKAGE.rglob("*.py"))
    }


@cache
def nodes():
    return [(name, node) for name, tree in modules().items() for node in statements(tree)]


def statements(node):
    """All statements within a node, without the expressions in them, which are most of a tree."""
    for part in ("body", "orelse", "handlers", "finalbody", "cases"):
        for inner in getattr(node, part, ()):
            yield inner
            yield from statements(inner)


def functions():
    return [(name, node) for name, node in nodes() if isinstance(node, ast.FunctionDef)]


def is_command(function):
    return any("command" in ast.unparse(mark) for mark in function.decorator_list)


def test_no_function_takes_more_than_ten_parameters():
    """Commands and keyword options of public functions apart."""
    found = []
    for name, function in functions():
        arguments = function.args
        count = len(arguments.posonlyargs) + len(arguments.args)
        count -= bool(arguments.args) and arguments.args[0].arg in ("self", "cls")
        if function.name.startswith("_"):
            count += len(arguments.kwonlyargs)
        if count > PARAMETERS and not is_command(function):
            found.append((name, function.name))
    found = [(name, function) for name, function in found if function not in MORE_PARAMETERS]
    assert [row for row in found if row[1] != "__init__"] == []


def test_no_function_is_longer_than_eighty_lines_of_code():
    """Docstring, comments and empty lines do not count."""
    found = []
    for name, function in functions():
        lines = (PACKAGE / name).read_text().splitlines()
        body = function.body[1:] if ast.get_docstring(function) else function.body
        if not body:
            continue
        text = [line.strip() for line in lines[body[0].lineno - 1 : function.end_lineno]]
        code = [line for line in text if line and not line.startswith("#")]
        if len(code) > FUNCTION:
            found.append((name, function.name, len(code)))
    assert found == []


def test_no_module_is_longer_than_five_hundred_lines():
    sizes = {name: len((PACKAGE / name).read_text().splitlines()) for name in modules()}
    assert {name for name, size in sizes.items() if size > MODULE} <= set(LARGER)


def test_only_two_modules_use_the_inside_of_numba():
    """Beside `cgutils`, which numba's manual tells those to use who write instructions.

    `record` has the types of records, `compiler` all else.
    """
    users = set()
    for name, node in nodes():
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("numba.core"):
            names = {alias.name for alias in node.names}
            users |= {name} if names != {"cgutils"} else set()
    assert users == {"kernels/compiler.py", "kernels/record.py"}


def test_every_kernel_module_is_in_the_table_of_the_manual():
    page = PACKAGE.parent / "docs" / "architecture.md"
    text = page.read_text().partition("## Kernels")[2]
    names = {path.stem for path in (PACKAGE / "kernels").glob("*.py")} - {"__init__"}
    assert [name for name in sorted(names) if f"`{name}`" not in text] == []


# steel; standard gauge with wheels 1360 mm apart and rails at 1:40; runs begin at 0
SHARED = "contact/", "simulation/", "studies/", "fmi/", "animation/"
USUAL = {
    "G": 82e9, "nu": 0.28, "load": 60e3, "radius": 0.46, "start": 0.0, "gauge": 1.435,
    "back_to_back": 1.36, "inclination": 1.0 / 40.0, "tape_circle_distance": 1.5,
    "allow_code": False, "frames_per_second": 20,
}  # fmt: skip


def test_defaults_that_are_repeated_are_the_same_everywhere():
    others, count = [], 0
    for name, function in functions():
        if not name.startswith(SHARED):
            continue
        arguments = function.args
        last = arguments.args[len(arguments.args) - len(arguments.defaults) :]
        names = [argument.arg for argument in (*last, *arguments.kwonlyargs)]
        for key, value in zip(names, [*arguments.defaults, *arguments.kw_defaults], strict=True):
            if key in USUAL and isinstance(value, ast.Constant) and value.value is not None:
                count += 1
                others += [(name, function.name, key)] * (value.value != USUAL[key])
    assert others == []
    assert count > 30


def test_what_was_found_does_not_read_like_its_limit():
    """Six digits show 0.5000001 as 0.5, which is allowed: messages show twelve."""
    short = re.compile(r"found \{[^}\"]*:\.?[1-9]?g\}")
    paths = PACKAGE.rglob("*.py")
    assert [name.name for name in paths if short.search(name.read_text())] == []
