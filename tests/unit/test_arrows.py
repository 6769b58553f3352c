"""Lower floors name no higher one, in imports or in texts, and pictures are chosen by type."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

import railsim
from railsim.plot import FIGURES, plot

PACKAGE = Path(railsim.__file__).parent
CONTRACTS = tomllib.loads((PACKAGE.parent / "pyproject.toml").read_text())["tool"]["importlinter"]
FLOORS = [re.split(r"[ |:]+", layer) for layer in CONTRACTS["contracts"][0]["layers"]]

# what the server of worker processes loads before it forks
PRELOADED = {("processes.py", "railsim.studies.worker")}


def texts(tree):
    """Every text of a module that is no docstring or text below a field."""
    said = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in said:
            yield node.value


def test_no_text_of_a_floor_names_a_module_of_a_higher_one():
    found = []
    for height, floor in enumerate(FLOORS):
        higher = {name for layer in FLOORS[:height] for name in layer}
        for name in floor:
            home = PACKAGE / name
            files = home.rglob("*.py") if home.is_dir() else [home.with_suffix(".py")]
            for file in files:
                source = file.read_text()
                if not re.search(r"""["']railsim\.""", source):
                    continue
                for text in texts(ast.parse(source)):
                    named = re.fullmatch(r"railsim\.(\w+)[\w.:]*", text)
                    if named and named[1] in higher:
                        found.append((str(file.relative_to(PACKAGE)), text))
    assert set(found) <= PRELOADED


@pytest.mark.parametrize("name", FIGURES)
def test_every_type_that_is_drawn_has_a_method_plot(name):
    homes = {
        "CriticalSpeed": "railsim.stability.critical_speed",
        "Curving": "railsim.stability.curving",
        "Modes": "railsim.linear.modes",
        "RootLocus": "railsim.linear.modes",
    }
    module = __import__(homes.get(name, "railsim"), fromlist=[name])
    assert callable(getattr(module, name).plot)


def test_what_nothing_draws_is_refused():
    with pytest.raises(TypeError, match=r"a dict cannot be plotted; .*CriticalSpeed"):
        plot({})
