"""Plant errors in the sources, one at a time, and count those that the tests catch.

    python tests/plant_errors.py --seed 1 --count 40 --kernels 5 --list build/planted.csv

Each error is one token: an operator, a comparison, a sign, a number, a condition.  It is planted
in the working copy, the module's own examples and the test files that name what it defines are run
until one fails, then the file is put back.  The list holds place, change, and the first test that
failed, or `survived`; what stands in a list is not tried again.  `--kernels` limits the errors in
kernels, each of which compiles for minutes: further errors of the seed elsewhere take their place.
`--rooms springs,stability,wear` takes as many of each folder, or of files with this in their name.
`--coverage .coverage` runs the tests that execute the line in place of the nearest files, `--most`
of them, as recorded by `pytest -n 2 --cov=railsim --cov-context=test` (of kernels nothing is).
Run it in a clone of its own, with the extra `cov`: it changes sources.

Mutation operators after DeMillo, Lipton and Sayward (1978), "Hints on test data selection".
"""

import argparse
import ast
import csv
import random
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
SWAPPED = {
    "+": "-", "-": "+", "*": "/", "/": "*", "<": ">=", ">": "<=", "<=": ">", ">=": "<",
    "==": "!=", "!=": "==", "+=": "-=", "-=": "+=", "*=": "/=", "and": "or", "or": "and",
    "True": "False", "False": "True", "min": "max", "max": "min", "sin": "cos", "cos": "sin",
}  # fmt: skip
FACTORS = tokenize.NAME, tokenize.NUMBER, tokenize.STRING  # beside brackets
SECONDS_PER_ERROR = 2400
NEAREST = 5  # files for a constant
SCHEMA = "tests/unit/test_definitions_schema.py"  # knows the bounds of every definition


@dataclass(frozen=True)
class Planted:
    """One changed token: its place (line from 1, column from 0), what it was, what it is."""

    path: str
    line: int
    column: int
    was: str
    now: str


def changes(path: Path) -> Iterator[Planted]:
    """All errors that can be planted in one file: tokens of statements, not of texts or types."""
    source = path.read_text()
    idle = _idle_lines(ast.parse(source))
    with path.open("rb") as file:
        every = tokenize.tokenize(file.readline)
        tokens = [token for token in every if token.type not in (tokenize.NL, tokenize.COMMENT)]
    for before, token, after in zip(tokens, tokens[1:], tokens[2:], strict=False):
        line, column = token.start
        # a star alone or in front of a sequence multiplies nothing
        factor = before.type in FACTORS or before.string in (")", "]")
        star = token.string == "*" and (not factor or after.string == ",")
        if line in idle or star:
            continue
        now = SWAPPED.get(token.string)
        if token.string in "+-" and before.string in ("(", "[", ",", "=", "return", ":"):
            now = "" if token.string == "-" else None
        if token.type == tokenize.NUMBER and re.fullmatch(r"\d+\.\d*(e[-+]?\d+)?", token.string):
            now = repr(float(token.string) * 1.2 if float(token.string) else 1.0)
        elif token.type == tokenize.NUMBER and token.string.isdigit():
            now = str(int(token.string) + 1)
        if now is not None:
            yield Planted(str(path.relative_to(ROOT)), line, column, token.string, now)


def _idle_lines(tree: ast.Module) -> set[int]:
    """Lines of texts, imports, decorators, type annotations and messages of errors."""
    idle: set[int] = set()
    for node in ast.walk(tree):
        parts: list[ast.AST] = []
        if isinstance(node, ast.Import | ast.ImportFrom | ast.Raise | ast.JoinedStr):
            parts = [node]
        elif isinstance(node, ast.FunctionDef):
            returns = [node.returns] if node.returns else []
            annotations = [a.annotation for a in node.args.args if a.annotation]
            parts = [*node.decorator_list, *returns, *annotations]
        elif isinstance(node, ast.AnnAssign):
            parts = [node.annotation]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            parts = [node] if node.end_lineno != node.lineno else []
        for part in parts:
            idle.update(range(part.lineno, part.end_lineno + 1))
    return idle


def tests_of(path: str, count: int) -> list[str]:
    """`count` test files, those first that name most of what module and package define."""
    module = ROOT / path
    room = module.parent.name
    names = {
        node.name
        for node in ast.parse(module.read_text()).body
        if isinstance(node, ast.FunctionDef | ast.ClassDef)
    }
    dotted = path.removesuffix(".py").replace("/", ".")
    scores: dict[str, float] = {}
    for file in sorted((ROOT / "tests").rglob("test_*.py")):
        text = file.read_text()
        words = set(re.findall(r"\w+", text))
        score = 5.0 * (dotted in text) + 3.0 * len(names & words) + 2.0 * (module.stem in words)
        score += 1.5 * (module.stem.split("_")[0] in file.stem) + 1.0 * (room in file.stem)
        score += 4.0 * (file.stem == f"test_{module.stem}")
        score += 0.5 * (f"railsim.{room}" in text)
        scores[str(file.relative_to(ROOT))] = score - 0.00001 * len(text)
    best = sorted(scores, key=lambda name: -scores[name])
    # what runs in the loop is named nowhere: the physics of the whole sees it
    physics = [name for name in best if "/verification/" in name] if room == "kernels" else []
    schema = [SCHEMA] if "railsim/definitions/" in path else []
    return list(dict.fromkeys([*schema, *best[:count], *physics[:count]]))


def tests_at(planted: Planted, data: Any, most: int) -> list[str]:
    """Tests that execute a line of the changed statement.

    Of a constant: the nearest files, which may name it alone, and tests that execute any line of
    its module.  `data`: CoverageData; `most` tests: half nearest by their files, half at random.
    """
    path = ROOT / planted.path
    statements = [
        node
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.stmt) and node.lineno <= planted.line <= node.end_lineno
    ]
    lines = range(0)  # of the decorator of a class there is no statement
    if inner := max(statements, key=lambda node: node.lineno, default=None):
        end = inner.body[0].lineno - 1 if isinstance(getattr(inner, "body", None), list) else 0
        lines = range(inner.lineno, max(end or inner.end_lineno, inner.lineno) + 1)
    (measured,) = [file for file in data.measured_files() if file.endswith(f"/{planted.path}")]
    by_line = data.contexts_by_lineno(measured)
    found = {name for line in lines for name in by_line.get(line, ()) if name}
    near, files = tests_of(planted.path, 8), []
    if not found:
        found = {name for names in by_line.values() for name in names if name}
        files = near[:NEAREST]
    rank = {file: k for k, file in enumerate(near)}
    tests = sorted({name.split("|")[0] for name in found})
    tests.sort(key=lambda name: rank.get(name.split("::")[0], len(near)))
    if len(tests) > most:
        rest = random.Random(1).sample(tests[most // 2 :], most - most // 2)
        tests = [*tests[: most // 2], *rest]
    return [*files, *(name for name in tests if name.split("::")[0] not in files)]


def first_failure(planted: Planted, tests: list[str]) -> str:
    """The first of some tests that fails with the error in place, or `survived`."""
    path = ROOT / planted.path
    source = path.read_text()
    lines = source.splitlines(keepends=True)
    line = lines[planted.line - 1]
    end = planted.column + len(planted.was)
    lines[planted.line - 1] = line[: planted.column] + planted.now + line[end:]
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    try:
        path.write_text("".join(lines))
        run = subprocess.run(
            [*command, *tests],
            cwd=ROOT, capture_output=True, text=True, timeout=SECONDS_PER_ERROR,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return "out of time"
    finally:
        path.write_text(source)
    if run.returncode == 0:
        return "survived"
    failed = re.findall(r"^(?:FAILED|ERROR) (\S+)", run.stdout, re.MULTILINE)
    return failed[0] if failed else "no test could start"


def of_rooms(rooms: list[str], seed: int, count: int) -> list[Planted]:
    """`count` errors, as many in each room: a folder of the package, or a part of files' names."""
    draw, package = random.Random(seed), ROOT / "railsim"
    chosen: list[Planted] = []
    for room in rooms:
        folder = package / room
        files = folder.rglob("*.py") if folder.is_dir() else package.rglob(f"*{room}*.py")
        possible = [planted for path in sorted(files) for planted in changes(path)]
        chosen += draw.sample(possible, min(count // len(rooms), len(possible)))
    return chosen


def main() -> None:
    """Choose the errors by the seed, plant one after the other, write the list as it grows."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--kernels", type=int, help="at most so many in railsim/kernels")
    parser.add_argument("--rooms", type=lambda text: text.split(","), help="of these alone")
    parser.add_argument("--files", type=int, default=10, help="test files for each error")
    parser.add_argument("--coverage", type=Path, help="which tests execute which lines")
    parser.add_argument("--most", type=int, default=300, help="tests for each error by --coverage")
    parser.add_argument("--list", type=Path, default=ROOT / "build" / "planted.csv")
    options = parser.parse_args()
    if options.rooms:
        chosen = of_rooms(options.rooms, options.seed, options.count)
    else:
        files = sorted((ROOT / "railsim").rglob("*.py"))
        possible = [planted for path in files for planted in changes(path)]
        most = min(10 * options.count, len(possible))
        chosen = random.Random(options.seed).sample(possible, most)
    kernels = [planted for planted in chosen if planted.path.startswith("railsim/kernels/")]
    left_out = set() if options.kernels is None else set(kernels[options.kernels :])
    chosen = [planted for planted in chosen if planted not in left_out][: options.count]
    if options.coverage:
        from coverage import CoverageData  # of the extra `cov`, which tests do without

        data = CoverageData(str(options.coverage))
        data.read()
    options.list.parent.mkdir(parents=True, exist_ok=True)
    done = options.list.read_text() if options.list.exists() else ""
    with options.list.open("a", newline="") as file:
        writer = csv.writer(file)
        for planted in chosen:
            place = [planted.path, str(planted.line), planted.was, planted.now]
            if ",".join(place) in done:
                continue
            if options.coverage and planted not in kernels:
                tests = tests_at(planted, data, options.most)
            else:
                tests = [planted.path, *tests_of(planted.path, options.files)]
            result = first_failure(planted, tests)
            writer.writerow([*place, result])
            file.flush()
            print(*place, result, flush=True)


if __name__ == "__main__":
    main()
