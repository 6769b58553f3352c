"""Hook of mkdocs: the manual offers each example as a notebook."""

import sys
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

sys.path.insert(0, str(Path(__file__).parent))
from generators.examples import SCRIPTS, notebook


def on_files(files: Files, *, config: Any) -> Files:
    """Add the notebooks, made from the scripts."""
    for script in SCRIPTS:
        name = f"examples/{script.stem}.ipynb"
        files.append(File.generated(config, name, content=notebook(script)))
    return files


def on_page_markdown(markdown: str, *, page: Any, config: Any, files: Files) -> str:
    """Link the notebook of an example below its code."""
    name = Path(page.file.src_path).with_suffix(".ipynb")
    if files.get_file_from_path(str(name)) is None:
        return markdown
    return f"{markdown}\n[Download as a notebook]({name.name})\n"
