"""The gallery of examples.

Each script of ``examples/`` gets a page with its question, text, picture, code and output.
Question, text and code are the script's (part `pages`), picture and output come
from a run of it.  The manual offers each as a notebook, too (``docs/manual.py``).
"""

import ast
import contextlib
import io
import json
import re
import runpy
import shutil
import tempfile
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).parents[2]
SCRIPTS = tuple(sorted((ROOT / "examples").glob("[0-9]*.py")))
PAGES, IMAGES = ROOT / "docs" / "examples", ROOT / "docs" / "img" / "examples"


def parts(script: Path) -> tuple[str, str, str]:
    """Question, text and code of a script."""
    source = script.read_text("utf-8")
    question, _, text = (ast.get_docstring(ast.parse(source)) or "").partition("\n")
    return question, text.strip(), source.split('"""', 2)[2].strip()


def output(page: Path) -> str:
    """What the script printed when its page was made."""
    text = page.read_text("utf-8") if page.exists() else ""
    return text.rpartition("```text\n")[2].removesuffix("```\n")


def notebook(script: Path) -> str:
    """The script as a notebook, a cell for each of its paragraphs."""
    question, text, code = parts(script)
    cells = [*re.split(r"\n\n+(?=\S)", code), "figure"]
    head = {
        "cell_type": "markdown",
        "id": "text",
        "metadata": {},
        "source": f"# {question}\n\n{text}",
    }
    body = [
        {"cell_type": "code", "id": f"cell-{i}", "metadata": {}, "source": cell,
         "execution_count": None, "outputs": []}
        for i, cell in enumerate(cells)
    ]  # fmt: skip
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    return json.dumps(
        {
            "cells": [head, *body],
            "metadata": {"kernelspec": kernel},
            "nbformat": 4,
            "nbformat_minor": 5,
        }
    )


def page(script: Path, printed: str) -> str:
    """Page of a script, with its output."""
    question, text, code = parts(script)
    name = script.stem
    return (
        f"# {question}\n\n{text}\n\n![{question}](../img/examples/{name}.png)\n\n"
        f"The script is `examples/{script.name}`:\n\n```py\n{code}\n```\n\n"
        f"It prints:\n\n```text\n{printed}```\n"
    )


def gallery() -> str:
    """Page that leads to all others, in reading order."""
    items = []
    for script in SCRIPTS:
        name, (question, *_) = script.stem, parts(script)
        picture = f"![{question}](../img/examples/{name}.png)"
        items.append(f"## [{question}]({name}.md)\n\n[{picture}]({name}.md)\n")
    return (
        "# Examples\n\nShort scripts in reading order; each answers one question. They are in "
        "the folder\n`examples/` and run in seconds once railsim has compiled its kernels.\n\n"
        + "\n".join(items)
    )


def pages() -> dict[Path, str]:
    """All pages by their files; the outputs are those that stand there."""
    made = {PAGES / "index.md": gallery()}
    for script in SCRIPTS:
        path = PAGES / f"{script.stem}.md"
        made[path] = page(script, output(path))
    return made


def run(names: Sequence[str]) -> None:
    """Run the scripts of these names, or all: new pictures and outputs."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for script in SCRIPTS:
            if names and script.stem not in names:
                continue
            with contextlib.redirect_stdout(io.StringIO()) as printed:
                runpy.run_path(str(script))
            shutil.copy(f"{script.stem}.png", IMAGES)
            (PAGES / f"{script.stem}.md").write_text(page(script, printed.getvalue()), "utf-8")


PARTS = (*(script.stem for script in SCRIPTS), "pages")


def make(words):
    """Run the examples, or some of them, and write their pages; `pages` writes texts only."""
    if "pages" not in words:
        run(words)
    for path, text in pages().items():
        path.write_text(text, "utf-8")
