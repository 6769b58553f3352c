"""Pages: the one way by which texts of files get into HTML.

A page is rendered once, by jinja2, which shows every text literally; data for its scripts stand in
a block of JSON without any ``<``.  Should a text become part of the page all the same, the browser
runs nothing of it: the page's content security policy names its styles and scripts by their hashes,
and lets it fetch nothing.
"""

from base64 import b64encode
from collections.abc import Iterable, Sequence
from hashlib import sha256
from importlib.resources import files
from typing import Any

import jinja2
from markupsafe import Markup

from railsim.text import printable

BASE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{{ policy }}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="{{ schemes }}">
<title>{{ title }}</title>
{% for style in styles %}
<style>{{ style }}</style>
{% endfor %}
</head>
<body>
{% block body %}{% endblock %}
{% if data is not none %}
<script type="application/json" id="data">{{ data|tojson }}</script>
{% endif %}
{% for script in scripts %}
<script>{{ script }}</script>
{% endfor %}
</body>
</html>
"""


def render_page(
    package: str,
    template: str,
    *,
    title: str,
    styles: Sequence[str],
    scripts: Sequence[str] = (),
    data: Any = None,
    schemes: str = "light",
    **values: Any,
) -> str:
    """Return a page as HTML.

    `package`: Where its files are. `template`: File of the block ``body``; it extends ``base``.
    `styles`, `scripts`: Files that become part of the page. `data`: Data of the scripts, in the
    element ``data``; no number may be infinite or undefined. `schemes`: Colour schemes that the
    styles know. `**values`: What the template refers to.
    """

    def text(name: str) -> str:
        return files(package).joinpath(name).read_text(encoding="utf-8")

    environment = jinja2.Environment(
        loader=jinja2.DictLoader({"base": BASE, "page": text(template)}), autoescape=True,
        trim_blocks=True, lstrip_blocks=True,
        finalize=lambda value: printable(value) if type(value) is str else value,
    )  # fmt: skip
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    shown_styles, run_scripts = [*map(text, styles)], [*map(text, scripts)]
    policy = (
        f"default-src 'none'; img-src data:; style-src {_hashes(shown_styles)}; "
        f"script-src {_hashes(run_scripts)}; base-uri 'none'; form-action 'none'"
    )
    return environment.get_template("page").render(
        policy=Markup(policy), title=title, styles=map(Markup, shown_styles),
        scripts=map(Markup, run_scripts), data=data, schemes=schemes, **values,
    )  # fmt: skip


def _hashes(texts: Iterable[str]) -> str:
    codes = (b64encode(sha256(text.encode()).digest()).decode() for text in texts)
    return " ".join(f"'sha256-{code}'" for code in codes) or "'none'"
