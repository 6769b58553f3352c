"""Texts from files of other sources, shown literally: in a terminal, a picture, a spreadsheet.

A vehicle may be called ``$x^$``, ``=1+1`` or hold escape sequences; wherever it is shown, it is
these characters and does nothing.  For pages see `railsim.page`.
"""

LONGEST_VALUE, LONGEST_FILE = 60, 300  # characters of a value, of a file's name, in a message


def shortened(text: str, longest: int = LONGEST_VALUE) -> str:
    """Return a text for a message; of a longer one the beginning.

    Examples
    --------
    >>> shortened("0123456789", 8)
    '01234...'
    """
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def printable(text: str) -> str:
    r"""Return text without characters that steer a terminal; ends of lines stay.

    Examples
    --------
    >>> printable("coach \x1b[31m\u202e é")
    'coach \\x1b[31m\\u202e é'
    """
    if text.isprintable():
        return text
    return "".join(
        letter if letter.isprintable() or letter in "\n\t " else ascii(letter)[1:-1]
        for letter in text
    )


def unformatted(text: str) -> str:
    r"""Return text for matplotlib, which takes what stands between dollars as a formula.

    Examples
    --------
    >>> print(unformatted("$x^$"))
    \$x^\$
    """
    text = printable(" ".join(text.split())).replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text  # a legend leaves out such names


def spreadsheet_cell(value: object) -> object:
    """Return a cell of a table that no spreadsheet takes as a formula: with an apostrophe before.

    Examples
    --------
    >>> spreadsheet_cell("=1+1"), spreadsheet_cell("-0.3"), spreadsheet_cell(-0.3)
    ("'=1+1", '-0.3', -0.3)
    """
    if not isinstance(value, str) or not value.startswith(("=", "+", "-", "@", "\t", "\r")):
        return value
    try:
        float(value)
    except ValueError:
        return f"'{value}"
    return value
