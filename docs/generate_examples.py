"""Make the gallery of examples: ``python docs/generate_examples.py``.

Each script of ``examples/`` gets a page with its question, its text, its picture and its code.  The
pages are made from the scripts' docstrings (``--pages`` makes nothing else), the pictures by the
scripts themselves.
"""

import ast
import os
import runpy
import shutil
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
SCRIPTS = tuple(sorted((ROOT / "examples").glob("[0-9]*.py")))
PAGES, IMAGES = ROOT / "docs" / "examples", ROOT / "docs" / "img" / "examples"


def told(script: Path) -> tuple[str, str]:
    """Question and text of a script."""
    text = ast.get_docstring(ast.parse(script.read_text("utf-8"))) or ""
    question, _, rest = text.partition("\n")
    return question, rest.strip()


def page(script: Path) -> str:
    """Page of a script."""
    question, text = told(script)
    name = script.stem
    return (
        f"# {question}\n\n{text}\n\n![{question}](../img/examples/{name}.png)\n\n"
        f'```py\n--8<-- "examples/{script.name}"\n```\n'
    )


def gallery() -> str:
    """Page that leads to all others, in reading order."""
    items = []
    for script in SCRIPTS:
        name, (question, _) = script.stem, told(script)
        picture = f"![{question}](../img/examples/{name}.png)"
        items.append(f"## [{question}]({name}.md)\n\n[{picture}]({name}.md)\n")
    return (
        "# Examples\n\nTen short scripts in reading order; each answers one question. They are in "
        "the folder\n`examples/` and run in seconds once railsim has compiled its kernels.\n\n"
        + "\n".join(items)
    )


def pages() -> dict[Path, str]:
    """All pages by their files."""
    return {PAGES / "index.md": gallery()} | {
        PAGES / f"{script.stem}.md": page(script) for script in SCRIPTS
    }


if __name__ == "__main__":
    PAGES.mkdir(exist_ok=True)
    for path, text in pages().items():
        path.write_text(text, "utf-8")
    if "--pages" not in sys.argv:
        IMAGES.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory() as folder:
            os.chdir(folder)
            for script in SCRIPTS:
                runpy.run_path(str(script))
                shutil.copy(f"{script.stem}.png", IMAGES)
            os.chdir(ROOT)
