"""Tables between ``<!-- generated: NAME -->`` and ``<!-- end -->`` of a page of the manual."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path

TABLE = re.compile(r"(<!-- generated: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
_MARKERS = re.compile(r"<!-- (keys: .*?|generated: .*?|end|end of keys) -->")


def check_markers(text: str) -> None:
    """Raise ValueError where a begin and an end of a filled table of a page do not alternate."""
    opened = ""
    for match in _MARKERS.finditer(text):
        ends = match[1].startswith("end")
        if ends != bool(opened) or (ends and opened.startswith("keys:") != (match[1] != "end")):
            raise ValueError(
                f"line {text.count(chr(10), 0, match.start()) + 1}: {match[0]} has no partner"
            )
        opened = "" if ends else match[1]
    if opened:
        raise ValueError(f"<!-- {opened} --> has no end")


def table(head: Sequence[str], rows: Iterable[Sequence[str]], rule: str = "---:") -> str:
    """Return a table of the manual; `rule` aligns all columns but the first."""
    rules = ("---", *[rule] * (len(head) - 1))
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, rules, *rows))


def filled(text: str, known: dict[str, str]) -> str:
    """Return a page with its tables filled."""
    check_markers(text)
    return TABLE.sub(lambda match: f"{match[1]}\n{known[match[2]]}\n{match[3]}", text)


def fill_page(
    page: Path, makers: Mapping[str, Callable[[], str]], wanted: Sequence[str] = ()
) -> None:
    """Make the wanted tables of a page, by default all of them."""
    wanted = wanted or list(makers)
    text = page.read_text("utf-8")
    known = {name: make() for name, make in makers.items() if name in wanted}
    for match in TABLE.finditer(text):  # tables that were not asked for stay
        present = match[0].split("-->\n", 1)[1].rsplit("<!-- end", 1)[0]
        known.setdefault(match[2], present.strip() + "\n")
    page.write_text(filled(text, known), encoding="utf-8")
