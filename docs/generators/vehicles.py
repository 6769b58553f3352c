"""The pages of the library.

One page for every shipped vehicle: drawing, data, gaps, modes, a run through a curve; and the
tables of vehicles and tracks in `docs/user/library.md`.  The numbers are those of the TOML files,
read line by line with the letters beside them.  Part `data` computes nothing: it rewrites the parts
that come from the files alone.  A vehicle takes about a minute.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image

import railsim
from generators.filling import filled, table
from railsim.definitions.settings import Settings
from railsim.definitions.track.definition import Track
from railsim.definitions.track.layout import curvature_sections
from railsim.definitions.vehicle.definition import Vehicle
from railsim.description.library import MEANING, text_with_bases, trust
from railsim.files.sources import read_toml, shipped_folder
from railsim.linear.vehicle import laws_in_words
from railsim.model.assembly import assemble
from railsim.model.equilibrium import equilibrium
from railsim.model.statics import SLOW
from railsim.plot.style import DISTINCT, SIDE_LINES, Picture, save, shade, spans, styled
from railsim.plot.vehicle import vehicle_figure

DOCS = Path(__file__).parents[1]
PAGES, IMAGES, OVERVIEW = DOCS / "library", DOCS / "img" / "library", DOCS / "user" / "library.md"
VEHICLES = tuple(sorted(path.stem for path in shipped_folder("vehicle").glob("*.toml")))
TRACKS = tuple(sorted(path.stem for path in shipped_folder("track").glob("*.toml")))
CURVE, CURVE_SPEED = "curve_r500", 20.0  # m/s
SEVERITY = 1.1  # of the admissible speed, for the stability
AMPLITUDE = 3e-3  # m
FASTEST = 20.0  # Hz, of the modes that are listed
WIDTH = 900  # pixels
GRAVITY = 9.81
MARKS = re.compile(r"\[[DRCIMA](?: \w+)?\]")
INFINITE = 1e9  # m


# the file, line by line ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Line:
    """One number or text of a file: its table, key and value as written, and the comment."""

    table: str
    key: str
    value: str
    comment: str


def lines_of(text: str) -> list[Line]:
    """All keys of a TOML text with their comments; values over several lines are joined."""
    found: list[Line] = []
    where, key, value, comments, above = "", "", "", [], []
    for raw in text.splitlines():
        code, _, comment = raw.partition("#")
        code, comment = code.strip(), comment.strip()
        if not key and not code:
            above = [*above, comment] if comment else []
            continue
        if not key and code.startswith("["):
            where, above = code.strip("[]"), []
            continue
        if not key:
            key, _, code = (part.strip() for part in code.partition("="))
            comments = [c for c in above if where and not comment and MARKS.search(c)]
            above = []
        value = f"{value} {code}".strip()
        comments += [comment] if comment else []
        if value.count("[") == value.count("]") and value.count("{") == value.count("}"):
            found.append(Line(where, key, value, "; ".join(comments)))
            key, value, comments = "", "", []
    return found


def introduction(text: str) -> str:
    """The comment at the head of a file, without the list of marks."""
    head = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        head.append(line.lstrip("# "))
    words = " ".join(head)
    words = re.split(r"(?:Sources? (?:quality )?of the numbers|Source quality):", words)[0].strip()
    return words + ("" if words.endswith(".") else ".")


def file_of(kind: str, name: str) -> Path:
    """The file of a shipped vehicle or track."""
    return shipped_folder(kind) / f"{name}.toml"


# data from the files alone ------------------------------------------------------------------------


def data(name: str) -> str:
    """Head of a vehicle's page: what the file says."""
    path = file_of("vehicle", name)
    text, vehicle = path.read_text("utf-8"), railsim.load_vehicle(name)
    base = read_toml(path).get("extends")
    parts = [
        f"# {vehicle.name}\n",
        introduction(text) + "\n",
        f"![Drawing of {name}](../img/library/{name}.png)\n",
        facts(name, vehicle),
        "## Data\n",
        f"`vehicles/{name}.toml`, in SI units; the letters: {letters()}"
        + (f" Everything else is as in [`{base}`]({base}.md)." if base else "")
        + "\n",
        f'```toml\n--8<-- "vehicles/{name}.toml"\n```\n',
        "## Gaps\n",
        gaps(text),
    ]
    return "\n".join(parts)


def letters_of(kind: str, name: str) -> str:
    """Letters of a file and what it extends, the most frequent first."""
    return trust(text_with_bases(file_of(kind, name), kind))


def letters() -> str:
    """What the letters mean."""
    return ", ".join(f"**{letter}** {words}" for letter, words in MEANING.items()) + "."


def facts(name: str, vehicle: Vehicle) -> str:
    """Table of what one asks first."""
    flat = railsim.definitions.vehicle.flatten.flatten(vehicle)
    wheelsets = flat.of_kind("wheelset")
    mass = sum(body.mass for body in flat.bodies)
    wheel = wheelsets[0].wheelset
    service = vehicle.service
    profiles = " / ".join(dict.fromkeys(wheel.profile))
    rows = [
        (
            "file",
            f"`{name}`" + (f"; load cases {', '.join(vehicle.loads)}" if vehicle.loads else ""),
        ),
        ("source", vehicle.source or ""),
        ("source quality", letters_of("vehicle", name)),
        (
            "mass, mean wheel load",
            f"{mass / 1e3:.2f} t, {mass * GRAVITY / 2e3 / len(wheelsets):.2f} kN",
        ),
        ("wheelsets", f"{len(wheelsets)}, radius {wheel.radius[0]:g} m, profile {profiles}"),
        ("positions of the wheelsets", ", ".join(f"{w.position[0]:g}" for w in wheelsets) + " m"),
        (
            "admissible speed, cant deficiency",
            f"{3.6 * service.admissible_speed:.0f} km/h, {1e3 * service.cant_deficiency:.0f} mm",
        ),
    ]
    return table(("", ""), rows, "---")


def gaps(text: str) -> str:
    """The numbers that are assumed or from memory."""
    found = [
        (line, letter)
        for line in lines_of(text)
        for letter in ("A", "M")
        if f"[{letter}]" in line.comment
    ]
    if not found:
        return "No number of the file is assumed or from memory.\n"
    items = []
    for letter, words in (("A", "Assumed"), ("M", "Recalled, not read")):
        tables: dict[str, list[str]] = {}
        for line, own in found:
            if own == letter:
                tables.setdefault(line.table, []).append(line.key)
        if tables:
            number = sum(len(keys) for keys in tables.values())
            keys = "; ".join(f"`{table}` {', '.join(keys)}" for table, keys in tables.items())
            items.append(f"{words}, in whole or in part ({number}): {keys}.\n")
    return "\n".join(items)


def vehicles_table() -> str:
    """Table of all vehicles."""
    rows = []
    for name in VEHICLES:
        vehicle = railsim.load_vehicle(name)
        flat = railsim.definitions.vehicle.flatten.flatten(vehicle)
        load = vehicle.mass * GRAVITY / 2e3 / len(flat.of_kind("wheelset"))
        rows.append(
            (
                f"[`{name}`](../library/{name}.md)",
                vehicle.name,
                letters_of("vehicle", name),
                f"{vehicle.mass / 1e3:.2f}",
                f"{load:.2f}",
                f"{3.6 * vehicle.service.admissible_speed:.0f}",
            )
        )
    head = ("file", "what it is", "source quality", "mass (t)", "Q0 (kN)", "V (km/h)")
    return table(head, rows, "---")


def tracks_table() -> str:
    """Table of all tracks."""
    rows = []
    for name in TRACKS:
        track = railsim.load_track(name)
        radii = [
            1.0 / section.start_value
            for section in curvature_sections(track)
            if section.type == "CIR"
        ]
        cant = max((abs(getattr(part, "cant", 0.0)) for part in track.cant), default=0.0)
        rows.append(
            (
                f"`{name}`",
                track.name,
                letters_of("track", name),
                f"{track.length:.0f}",
                f"{min(radii, key=abs):g}" if radii else "straight",
                f"{1e3 * cant:.0f}",
                f"{track.speed:g} ({3.6 * track.speed:.0f})",
            )
        )
    head = ("file", "what it is", "source quality", "length (m)", "radius (m)",
            "cant (mm)", "speed, m/s (km/h)")  # fmt: skip
    return table(head, rows)


# what is computed ---------------------------------------------------------------------------------


def computed(name: str) -> str:
    """Rest of a vehicle's page: load cases, modes, stability, a curve."""
    vehicle = railsim.load_vehicle(name)
    small(vehicle_figure(vehicle), IMAGES / f"{name}.png")
    parts = [loads(vehicle)] if vehicle.loads and vehicle.load is None else []
    return "\n".join([*parts, *modes(vehicle), curve(name, vehicle)])


def loads(vehicle: Vehicle) -> str:
    """Masses, axle loads and heights of the load cases."""
    rows, first = [], None
    for case in (None, *vehicle.loads):
        loaded = vehicle if case is None else vehicle.replace(load=case)
        model = assemble(loaded, railsim.load_track("straight"), Settings())
        balance = equilibrium(model, SLOW)
        body = model.index.bodies.index(str(vehicle.reference))
        z = float(balance.state[6 * body + 2])
        first = z if first is None else first
        axle = balance.Q0.sum(axis=1) / 1e3
        rows.append(
            (
                case or "as the file has it",
                f"{loaded.mass / 1e3:.2f}",
                f"{axle.min():.1f} to {axle.max():.1f}",
                f"{balance.Q0.min() / 1e3:.2f} to {balance.Q0.max() / 1e3:.2f}",
                f"{1e3 * (z - first):+.1f}",
            )
        )
    head = ("load case", "mass (t)", "axle loads (kN)", "wheel loads (kN)", "body lower by (mm)")
    return f"## Load cases\n\n{table(head, rows)}"


def modes(vehicle: Vehicle) -> list[str]:
    """Modes at the admissible speed, and the stability beyond it."""
    V = vehicle.service.admissible_speed
    found = railsim.modes(vehicle, speed=V).record()
    rows = [
        (mode["name"], f"{mode['natural_frequency']:.2f}", f"{100.0 * mode['damping_ratio']:.1f}")
        for mode in sorted(found["modes"], key=lambda mode: mode["natural_frequency"])
        if 0.05 < mode["natural_frequency"] < FASTEST
        and abs(mode["damping_ratio"]) < 0.999
        and not mode["name"].startswith("rolling")
    ]
    listed = table(("mode", "frequency (Hz)", "damping (%)"), rows)
    worst = least_damped(vehicle, SEVERITY * V)
    verdict = (
        f"At {3.6 * SEVERITY * V:.0f} km/h, {100.0 * (SEVERITY - 1.0):.0f} % above the admissible "
        f"speed, with the contact linearised for lateral amplitudes of {1e3 * AMPLITUDE:g} mm, the "
        f"least damped mode is {worst['name']} at {worst['natural_frequency']:.2f} Hz with a "
        f"damping of {100.0 * worst['damping_ratio']:.2f} %."
    )
    if worst["damping_ratio"] < 0.0 and any("friction elements" in r for r in found["remarks"]):
        verdict += (
            " Dry friction, which linear analysis takes as sticking, limits this motion; see "
            "[Vehicles and tracks](../validation/vehicles_and_tracks.md) for runs at the "
            "admissible speed."
        )
    return [
        "## Modes\n",
        f"Straight track, {3.6 * V:.0f} km/h, friction 0.4, up to {FASTEST:g} Hz, undamped "
        "frequency; dry friction sticks:\n",
        listed,
        f"{verdict} {hunting(vehicle)}\n",
    ]


def hunting(vehicle: Vehicle) -> str:
    """From which speed it hunts, found by a ramp."""
    found = railsim.critical_speed(vehicle)
    where = found.conditions
    words = (
        f"Rails {where['rails']}, friction {where['friction']}, {laws_in_words(where)}, "
        f"up to {3.6 * found.high:.0f} km/h: "
    )
    if found.linear is None:
        words += "no loss of stability at rest"
    else:
        words += f"rest loses its stability at {3.6 * found.linear.speed:.0f} km/h"
        rigid = found.linear.speed_on_rigid_rails
        if rigid is not None:
            words += f" ({3.6 * rigid:.0f} on rigid rails)"
    line = found.linear_over_amplitude
    if line is not None and line.smallest is not None:
        speed, amplitude = line.smallest
        words += (
            f", linearised for amplitudes of {1e3 * line.amplitude[0]:g} to "
            f"{1e3 * line.amplitude[-1]:g} mm at {3.6 * speed:.0f} km/h or more "
            f"({1e3 * amplitude:g} mm)"
        )
    lowest = found.lowest
    if lowest is None:
        return f"{words}; from no disturbance tried does it hunt."
    return (
        f"{words}; hunting, once excited, lasts down to {3.6 * lowest.speed:.0f} km/h "
        f"(non-linear critical speed, by ramp), there with {1e3 * lowest.amplitude:.2g} mm."
    )


def least_damped(vehicle: Vehicle, speed: float) -> dict:
    """Oscillation with the smallest damping at a speed, the contact linearised harmonically."""
    found = railsim.modes(
        vehicle, speed=speed, linearisation="harmonic", amplitude=AMPLITUDE
    ).record()["modes"]
    return min(
        (m for m in found if m["natural_frequency"] > 0.05 and not m["name"].startswith("rolling")),
        key=lambda mode: mode["damping_ratio"],
    )


def curve(name: str, vehicle: Vehicle) -> str:
    """A run through the curve of 500 m: picture and largest values."""
    track = railsim.load_track(CURVE)
    result = railsim.simulate(vehicle, track, speed=CURVE_SPEED)
    small(curve_figure(result, track), IMAGES / f"{name}_curve.png")
    yaw = 1e3 * np.abs(result.wheelset_yaw[:, 0]).max()
    values = (
        ("lateral force of the leading outer wheel", -result.Y[:, 0, 0].min() / 1e3, "kN", 1),
        ("largest derailment quotient", np.nanmax(result.Y_over_Q), "", 2),
        ("largest wheel unloading", -100.0 * result.dQ_over_Q0.min(), "%", 1),
        ("yaw of the leading wheelset against the track", yaw, "mrad", 2),
    )
    words = "; ".join(
        f"{what} {value:.{digits}f} {unit}".strip() for what, value, unit, digits in values
    )
    return (
        f"## Through a curve\n\n`{CURVE}` (R 500 m, cant 100 mm) at {3.6 * CURVE_SPEED:.0f} km/h, "
        f"friction 0.4, no irregularities; status {result.status}: {words}.\n\n"
        f"![Run of {name} through {CURVE}](../img/library/{name}_curve.png)\n"
    )


def curve_figure(result: railsim.Result, track: Track) -> Picture:
    """Lateral forces and displacement of the leading and the last wheelset over the distance."""
    s = result.distance
    shown = s > 200.0
    with styled():
        figure = Picture(8.0, 3.0)
        force, moved = figure.subplots(1, 2)
        for k, (index, words) in enumerate(((0, "first"), (-1, "last"))):
            for side, (which, line) in enumerate(SIDE_LINES.items()):
                force.plot(
                    s[shown], result.Y[shown, index, side] / 1e3, color=DISTINCT[k], ls=line,
                    label=f"{words} wheelset, {which}",
                )  # fmt: skip
            lateral = 1e3 * result.wheelset_lateral[shown, index]
            moved.plot(s[shown], lateral, color=DISTINCT[k], label=f"{words} wheelset")
        force.set(ylabel="$Y$ (kN), to the right")
        moved.set(ylabel="$y$ (mm), to the right")
        for axes in (force, moved):
            axes.set_xlabel("$s$ (m)")
            axes.margins(x=0.0)
            shade(axes, spans(curvature_sections(track), s[shown], s[shown]), with_names=True)
        for axes in (force, moved):
            axes.legend(fontsize=7, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.2))
        return figure


def small(figure: Picture, path: Path) -> None:
    """Save a picture in few colours."""
    save(figure, path, overwrite=True)
    with Image.open(path) as picture:
        height = round(picture.height * WIDTH / picture.width)
        picture = picture.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS)
        picture.quantize(48).save(path, optimize=True)


# pages --------------------------------------------------------------------------------------------

REST = re.compile(r"^## (?:Load cases|Modes)$", re.MULTILINE)


def page(name: str, compute: bool) -> str:
    """Page of a vehicle; without computing, its second part stays as it is."""
    if compute:
        return f"{data(name)}\n{computed(name)}"
    present = (PAGES / f"{name}.md").read_text("utf-8")
    return f"{data(name)}\n{present[REST.search(present).start() :]}"


def overview(text: str) -> str:
    """`docs/user/library.md` with its tables."""
    return filled(text, {"vehicles": vehicles_table(), "tracks": tracks_table()})


PARTS = (*VEHICLES, "data")


def make(parts):
    """Write the pages of these vehicles, by default of all."""
    compute = "data" not in parts
    for name in [name for name in parts if name in VEHICLES] or VEHICLES:
        (PAGES / f"{name}.md").write_text(page(name, compute), encoding="utf-8")
        print(name, flush=True)
    OVERVIEW.write_text(overview(OVERVIEW.read_text("utf-8")), encoding="utf-8")
