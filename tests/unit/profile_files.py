"""Profile files in every format, written from the definitions, and ways to damage them."""

import numpy as np

from railsim.profiles import load_profile


def points(name, every=4):
    """Points of a built-in profile in millimetres, every 0.2 mm."""
    profile = load_profile(name)
    return 1e3 * profile.y[::every], 1e3 * profile.z[::every]


def csv_mm(y, z, **_):
    return "y_mm,z_mm\n" + "".join(f"{a:.6f},{b:.6f}\n" for a, b in zip(y, z, strict=True))


def csv_m(y, z, **_):
    rows = "".join(f"{1e-3 * a:.9f},{1e-3 * b:.9f}\n" for a, b in zip(y, z, strict=True))
    return "y,z\n" + rows


def bare(y, z, **_):
    return "# measured\n" + "".join(f"{a:.6f}  {b:.6f}\n" for a, b in zip(y, z, strict=True))


def simpack(y, z, kind="wheel", **keys):
    settings = "".join(f"    {key} = {value}\n" for key, value in keys.items())
    return (
        "! a profile\n  header.begin\n    version  = 1\n"
        f"    type     = {1 if kind == 'wheel' else 0}   ! 0 rail, 1 wheel\n  header.end\n"
        "  spline.begin\n    approx.smooth = 0.0\n    comment = 'measured'\n"
        f"    units.len.f = 1000.0\n{settings}    point.begin\n"
        + "".join(f"      {a:.6f}  {b:.6f}  1.0\n" for a, b in zip(y, z, strict=True))
        + "    point.end\n  spline.end\n"
    )


def miniprof(y, z, **_):
    return (
        "Filename=x\nProgramName=\nMPTypeNo=299\nXOffset=0.0000\n"
        f'XYPoints={len(y)}\n"RefPoint1="\nColumnDef=X,Y,A\n\n'
        + "".join(f"{a:.4f} {b:.4f} 0.1\n" for a, b in zip(y, z, strict=True))
    )


def damaged(text, rng):
    """The text with one to three faults of random kinds."""
    for _ in range(rng.integers(1, 4)):
        text = DAMAGES[rng.integers(len(DAMAGES))](text, rng)
    return text


def _lines(change):
    def apply(text, rng):
        lines = text.split("\n")
        return "\n".join(change(lines, rng))

    return apply


def _numbers(change):
    """Damage to the lines that hold points."""

    def apply(text, rng):
        lines = text.split("\n")
        rows = []
        for i, line in enumerate(lines):
            words = line.replace(",", " ").split()
            try:
                rows.append((i, float(words[0]), float(words[1])))
            except (IndexError, ValueError):
                continue
        if not rows:
            return text
        index = [row[0] for row in rows]
        y, z = np.array([row[1] for row in rows]), np.array([row[2] for row in rows])
        separator = "," if "," in lines[index[0]] else " "
        y, z = change(y, z, rng)
        new = [f"{a:.6f}{separator}{b:.6f}" for a, b in zip(y, z, strict=True)]
        return "\n".join(lines[: index[0]] + new + lines[index[-1] + 1 :])

    return apply


def _cut(y, z, rng):
    a, b = np.sort(rng.integers(0, y.size, 2))
    keep = (np.arange(y.size) < a) | (np.arange(y.size) >= b)
    return y[keep], z[keep]


def _window(y, z, rng):
    a, b = np.sort(rng.integers(0, y.size + 1, 2))
    return y[a:b], z[a:b]


def _step(y, z, rng):
    at = rng.integers(0, y.size)
    return y, z + (np.arange(y.size) >= at) * rng.normal() * 3


def _noise(y, z, rng):
    size = 10.0 ** rng.uniform(-4, 1)
    return y + size * rng.normal(size=y.size), z + size * rng.normal(size=y.size)


def _shuffle(y, z, rng):
    order = rng.permutation(y.size)
    return y[order], z[order]


def _swap(y, z, rng):
    return (z, y) if rng.random() < 0.3 else (-y, z)


def _tilt(y, z, rng):
    angle = rng.normal() * 0.3
    return y * np.cos(angle) - z * np.sin(angle), y * np.sin(angle) + z * np.cos(angle)


def _spikes(y, z, rng):
    z = z.copy()
    at = rng.integers(0, z.size, rng.integers(1, 6))
    z[at] += rng.normal(size=at.size) * 10.0 ** rng.uniform(-2, 3)
    return y, z


def _scale(y, z, rng):
    factor = rng.choice([-1.0, 0.001, 1000.0, 0.0, 2.54, 0.5, 1e30])
    return (y * factor, z * factor) if rng.random() < 0.7 else (y, z * factor)


def _shift(y, z, rng):
    return y + rng.normal() * 30, z + rng.normal() * 30


def _hollow(y, z, rng):
    return y, z + rng.normal() * np.exp(-(((y - rng.uniform(-20, 40)) / rng.uniform(1, 15)) ** 2))


def _thin(y, z, rng):
    every = rng.integers(1, 60)
    return y[::every], z[::every]


def _replace_text(text, rng):
    pieces = [
        "nan",
        "inf",
        "1e999",
        "x",
        "--3",
        "1.2.3",
        ",",
        ";",
        "\t",
        "é",
        "0x1F",
        "1,5",
        "\r",
        "\x00",
        '"',
        "=",
        "#",
        "!",
        "point.end",
        "units.len.f = 0",
        "1d5",
        " ",
        "ColumnDef=Z",
    ]
    for _ in range(rng.integers(1, 6)):
        at = rng.integers(0, max(len(text), 1))
        text = text[:at] + pieces[rng.integers(len(pieces))] + text[at + rng.integers(0, 3) :]
    return text


DAMAGES = [
    _lines(lambda lines, rng: [x for x in lines if rng.random() > 0.02]),
    _lines(lambda lines, rng: [lines[i] for i in rng.permutation(len(lines))]),
    _lines(lambda lines, rng: [x for x in lines for _ in range(1 + (rng.random() < 0.1))]),
    _lines(lambda lines, rng: lines[: rng.integers(0, len(lines) + 1)]),
    _lines(lambda lines, rng: lines[rng.integers(0, len(lines)) :]),
    lambda text, rng: text[: rng.integers(0, len(text) + 1)],
    _replace_text,
    _replace_text,
    *[
        _numbers(change)
        for change in (
            _cut,
            _window,
            _step,
            _noise,
            _shuffle,
            _swap,
            _tilt,
            _spikes,
            _scale,
            _shift,
            _hollow,
            _thin,
        )
    ],
]
