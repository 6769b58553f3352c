"""Loading files: extends, remove, overrides, shipped names, and faults with their file and key."""

import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from railsim.definitions.loading import (
    load_any,
    load_settings,
    load_study,
    load_track,
    load_track_text,
    load_vehicle,
)
from railsim.errors import Fault, InputError, PackageMissing
from railsim.files import sources
from railsim.files.access import is_file
from railsim.files.overrides import split_overrides

HEAD = 'format = "railsim-vehicle/1"\nname = "mine"\n'
COACH = HEAD + 'extends = "coach_manchester"\n'
TRACK = 'format = "railsim-track/1"\nname = "mine"\nplan = [{ type = "STR", length = 10.0 }]\n'
PRIMARY = "assemblies.bogie.assemblies.axle.elements.primary"


def faults(load, *arguments):
    with pytest.raises(InputError) as caught:
        load(*arguments)
    return caught.value.faults


@pytest.fixture
def write(tmp_path):
    def write(name, text):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def test_extending_file_replaces_only_what_it_names(write):
    path = write("mine.toml", COACH + f"[{PRIMARY}]\nstiffness = [1.0, 2.0, 3.0]\n")
    mine, coach = load_vehicle(path), load_vehicle("coach_manchester")
    axle = mine.assemblies["bogie"].assemblies["axle"]
    assert axle.elements["primary"].stiffness == (1.0, 2.0, 3.0)
    assert axle.elements["primary"].damping == (15000.0, 2000.0, 0.0)
    assert mine.bodies == coach.bodies
    assert mine.name == "mine"


def test_element_of_another_kind_replaces_the_old_one_whole(write):
    bar = 'kind = "roll_bar"\nbodies = ["frame", "wheelset"]\nstiffness = 5.0\n'
    path = write("mine.toml", COACH + f"[{PRIMARY}]\n{bar}")
    axle = load_vehicle(path).assemblies["bogie"].assemblies["axle"]
    assert axle.elements["primary"].kind == "roll_bar"


def test_remove_takes_parts_away_before_merging(write):
    path = write("mine.toml", COACH + f'remove = ["{PRIMARY}", "source"]\n')
    mine = load_vehicle(path)
    assert "primary" not in mine.assemblies["bogie"].assemblies["axle"].elements
    assert mine.source is None


def test_remove_names_members_of_lists(write):
    base = write("base.toml", COACH)
    text = HEAD + f'extends = "{base.name}"\nremove = ["assemblies.bogie.placements.rear"]\n'
    mine = load_vehicle(write("mine.toml", text))
    assert [p.name for p in mine.assemblies["bogie"].placements] == ["front"]


def test_extends_finds_a_file_beside_it_with_and_without_its_ending(write):
    write("base.toml", COACH)
    for name in ("base", "base.toml"):
        path = write("mine.toml", HEAD + f'extends = "{name}"\n')
        assert load_vehicle(path).bodies["carbody"].mass == 43628.0


def test_path_wins_over_a_shipped_name(write, monkeypatch, tmp_path):
    write("coach_manchester", COACH.replace("mine", "my own coach"))
    monkeypatch.chdir(tmp_path)
    assert load_vehicle("coach_manchester").name == "my own coach"


def test_shipped_files_are_found_from_anywhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert load_track("curve_r250").length == 980.0
    assert {"coach_manchester", "benchmark_vehicle1"} <= set(sources.library_files("vehicle"))
    assert {"curve_r250", "curve_r500", "straight"} <= set(sources.library_files("track"))


def test_shipped_files_come_from_the_package_once_installed(tmp_path, monkeypatch):
    folder = tmp_path / "railsim" / "shipped" / "tracks"
    folder.mkdir(parents=True)
    (folder / "packed.toml").write_text(TRACK)
    monkeypatch.setattr(sources, "PACKAGE", tmp_path / "railsim")
    assert load_track("packed").length == 10.0


def test_loading_needs_neither_numba_nor_matplotlib():
    code = (
        "import sys; from railsim.definitions.loading import load_vehicle;"
        "load_vehicle('coach_manchester');"
        "assert not {'numba', 'matplotlib', 'scipy'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


# faults -------------------------------------------------------------------------------------------


def test_all_faults_of_a_file_come_at_once_with_their_keys(write):
    path = write(
        "mine.toml",
        COACH
        + """
[bodies.carbody]
mass = -1
mas = 3
[bodies.extra]
mass = nan
[assemblies.bogie.elements.new]
kind = "bushin"
bodies = ["frame", "carbdy"]
[assemblies.bogie.elements.other]
kind = "roll_bar"
bodies = ["fram", "carbody"]
stiffness = -5.0
""",
    )
    found = {fault.key: (fault.found, fault.allowed) for fault in faults(load_vehicle, path)}
    other = "assemblies.bogie.elements.other"
    assert found["bodies.carbody.mass"] == ("-1", "must be greater than 0")
    assert found["bodies.carbody.mas"] == ("unknown key", "did you mean 'mass'?")
    assert found["bodies.extra.mass"] == ("nan", "must be a finite number")
    assert found["bodies.extra.inertia"][0] == "missing"
    assert found["bodies.extra.position"] == ("missing", "needed: Centre of gravity [m]")
    assert found["assemblies.bogie.elements.new"][1] == "did you mean 'bushing'?"
    assert found["assemblies.bogie.elements.new.bodies.1"][1] == "did you mean 'carbody'?"
    assert found[f"{other}.bodies.0"] == ("no body 'fram'", "did you mean 'frame'?")
    assert found[f"{other}.stiffness"] == ("-5.0", "must be greater than 0")
    assert len(found) == 9


def test_fault_names_the_file_that_holds_the_key(write):
    base = write("base.toml", COACH + "[bodies.carbody]\nmass = -1\n")
    text = HEAD + 'extends = "base"\n[bodies.carbody]\ninertia = [1, 2]\n'
    mine = write("mine.toml", text)
    files = {fault.key: fault.file for fault in faults(load_vehicle, mine)}
    assert files == {"bodies.carbody.mass": str(base), "bodies.carbody.inertia": str(mine)}


def test_name_near_one_of_an_extended_file_is_told(write):
    """Of the file's own elements none is meant: they are there already."""
    table = PRIMARY.replace("primary", "primry")
    own = f'[{PRIMARY.replace("primary", "primry2")}]\nkind = "bushing"\nbodies = ["a", "b"]\n'
    (fault,) = faults(load_vehicle, write("a.toml", COACH + f"[{table}]\ndamping = 3.0\n"))
    assert fault.key == table
    assert fault.allowed == "it tells what the table describes; did you mean 'primary'?"
    text = COACH + own + f"[{table}]\ndamping = 3.0\n"
    found = {one.key: one.allowed for one in faults(load_vehicle, write("b.toml", text))}
    assert found[table].endswith("did you mean 'primary'?")
    far = write("c.toml", COACH + f"[{PRIMARY.replace('primary', 'zzzz')}]\ndamping = 3.0\n")
    assert faults(load_vehicle, far)[0].allowed == "it tells what the table describes"


def test_short_vector_says_how_many_numbers_are_needed(write):
    path = write("mine.toml", COACH + "[bodies.carbody]\nposition = [1.0]\ninertia = 5.0\n")
    position, inertia = sorted(faults(load_vehicle, path), key=lambda f: f.key, reverse=True)
    assert str(position).endswith("bodies.carbody.position: 1 value; a list of 3")
    assert str(inertia).endswith("bodies.carbody.inertia: 5.0; a list of 3")


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("bodies = 3", "bodies: 3; must be a table"),
        ("[bodies]\ncarbody = 5.0", "bodies.carbody: 5.0; must be a table"),
        (f"[{PRIMARY}]\nkind = 7", "primary: unknown 'kind' '7'; allowed:"),
        (f"[{PRIMARY}]\npreload = [1.0, 2.0]", "primary.preload: 2 values; a list of 3"),
        (f"[{PRIMARY}]\npreload = 'later'", "primary.preload: 'later'; must be 'auto'"),
        (f"[{PRIMARY}]\npreload = 1.0", "primary.preload: 1.0; a list of 3"),
        (f"[{PRIMARY}]\nstiffness = [1, 2, 3, 4]", "primary.stiffness: 4 values; a list of 3"),
        (f"[{PRIMARY}]\nbodies = ['frame']", "primary.bodies: 1 value; a list of 2"),
        (f"[{PRIMARY}]\nbodies = 'frame'", "primary.bodies: 'frame'; a list of 2"),
        ("[bodies.x]\nmass = 'heavy'", "bodies.x.mass: 'heavy'; must be a valid number"),
        ("[elements.new]\nbodies = ['carbody', 'front.frame']", "new: no key 'kind'"),
        ("[assemblies.bogie]\nplacements = []", "placements: 0 values; a list"),
        ("[assemblies.bogie]\nplacements = ['front']", "placements.0: 'front'; must be a table"),
    ],
)
def test_value_of_the_wrong_kind_is_told_in_words(write, text, expected):
    texts = [str(fault) for fault in faults(load_vehicle, write("mine.toml", COACH + text + "\n"))]
    assert any(expected in text for text in texts), texts


def test_wheelset_without_profile_is_named(write):
    text = COACH + 'remove = ["assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile"]\n'
    (fault,) = faults(load_vehicle, write("mine.toml", text))
    assert fault.key == "assemblies.bogie.assemblies.axle.wheelsets.wheelset.profile"
    assert fault.found == "missing"


def test_fault_of_a_definition_that_stands_several_times_is_told_once(write):
    key = "assemblies.bogie.assemblies.axle.wheelsets.wheelset"
    (fault,) = faults(load_vehicle, write("mine.toml", COACH + f"[{key}]\nradius = 0.5\n"))
    assert fault.key == f"{key}.position"


def test_circular_extends_is_refused(write):
    write("a.toml", HEAD + 'extends = "b.toml"\n')
    path = write("b.toml", HEAD + 'extends = "a.toml"\n')
    (fault,) = faults(load_vehicle, path)
    assert fault.key == "extends"
    assert "b.toml -> a.toml -> b.toml" in fault.found


def test_file_that_extends_itself_is_refused(write):
    (fault,) = faults(load_vehicle, write("a.toml", HEAD + 'extends = "a"\n'))
    assert "a.toml -> a.toml" in fault.found


@pytest.mark.parametrize(
    ("text", "key", "found"),
    [
        ("x = 1\ny = = 2\n", "line 2", "broken TOML"),
        ('x = "open', "line 1", "broken TOML"),
        ("[a]\n[a]\n", "line 2", "broken TOML"),
        ("x = 1\nx = 2\n", "line 2", "the key has a value already"),
        ("x = 1\nmass = 26000,5\n", "line 2", "a decimal point, not a comma"),
    ],
)
def test_broken_toml_is_reported_with_its_line(write, text, key, found):
    (fault,) = faults(load_vehicle, write("broken.toml", text))
    assert fault.key == key
    assert found in fault.found


@pytest.mark.parametrize("content", ["run,speed\n1,20\n", "\x00" * 5_000_000])
def test_file_of_another_kind_is_told_what_is_expected(write, content):
    """A table or a result in place of a definition: no word on its syntax alone."""
    (fault,) = faults(load_study, write("summary.csv", content))
    assert fault.allowed == "a study file in TOML is expected here"


def test_file_that_is_no_text_is_refused(tmp_path):
    path = tmp_path / "picture.toml"
    path.write_bytes(b"\xff\xfe\x00\x81")
    (fault,) = faults(load_vehicle, path)
    assert "UTF-8" in fault.found


@pytest.mark.parametrize(
    ("line", "key"),
    [
        ("extends = 3", "extends"),
        ('extends = "nowhere"', "extends"),
        ('remove = ["name"]', "remove"),
        ('extends = "coach_manchester"\nremove = "name"', "remove"),
        ('extends = "coach_manchester"\nremove = ["bodies.carbdy"]', "remove"),
        ('extends = "coach_manchester"\nremove = ["a b"]', "remove"),
    ],
)
def test_wrong_extends_or_remove_is_refused(write, line, key):
    (fault,) = faults(load_vehicle, write("mine.toml", HEAD + line + "\n"))
    assert fault.key == key


def test_what_remove_could_have_meant_is_told(write):
    (fault,) = faults(load_vehicle, write("mine.toml", COACH + 'remove = ["bodies.carbdy"]\n'))
    assert fault.allowed == "did you mean 'carbody'?"


def test_placements_of_one_name_are_one_fault(write):
    placements = 'placements = [{ name = "front" }, { name = "front", position = [9.0, 0.0, 0.0] }]'
    text = COACH + f"[assemblies.bogie]\n{placements}\n"
    (fault,) = faults(load_vehicle, write("mine.toml", text))
    assert fault.key == "assemblies.bogie.placements"
    assert fault.found == "the names front, front"


def test_file_or_name_of_another_kind_is_told_so(write):
    text = 'format = "railsim-vehicle/1"\nname = "x"\nextends = "coach_manchester"\n'
    (fault,) = faults(load_settings, write("v.toml", text))
    assert (fault.key, fault.found) == ("format", "'railsim-vehicle/1'")
    (fault,) = faults(load_vehicle, "curve_r250")
    assert fault.found == "'curve_r250' is a shipped track"
    (fault,) = faults(load_vehicle, write("run.csv", "t,Q\n0,1\n"))
    assert fault.allowed == "a vehicle file in TOML is expected here"


def test_missing_file_names_what_is_shipped(tmp_path):
    (fault,) = faults(load_vehicle, "coach_mancester")
    assert "coach_manchester" in fault.allowed
    (fault,) = faults(load_vehicle, tmp_path)
    assert "is a folder" in fault.found
    (fault,) = faults(load_settings, "nowhere.toml")
    assert "no file" in fault.found


def test_a_name_that_the_system_refuses_is_no_file():
    """Longer than names may be: it is missed like any other, with what is shipped."""
    name = 300 * "x"
    assert is_file(__file__)
    assert not is_file(name)
    (fault,) = faults(load_track, name)
    assert "no file" in fault.found


@pytest.mark.parametrize("text", ["", 'format = "railsim-vehicle/2"', "format = 5"])
def test_wrong_format_is_the_only_fault(write, text):
    for load in (load_vehicle, load_any):
        (fault,) = faults(load, write("mine.toml", text))
        assert fault.key == "format"
        assert "railsim-vehicle/1" in fault.allowed


def test_name_that_is_no_name_is_refused(write):
    path = write("mine.toml", HEAD + '[bodies."my.body"]\nmass = 1.0\n')
    assert any("letters, digits" in fault.allowed for fault in faults(load_vehicle, path))


def test_mark_at_the_beginning_of_a_file_is_passed_over(write):
    """Some editors put one there (byte order mark)."""
    text = 'format = "railsim-settings/1"\nstep = 1e-3\n'
    assert load_settings(write("s.toml", "\ufeff" + text)).step == 1e-3


# overrides ----------------------------------------------------------------------------------------


def test_override_replaces_a_value():
    mine = load_vehicle("coach_manchester", [f"{PRIMARY}.stiffness.1=3.884e6", 'name="x"'])
    primary = mine.assemblies["bogie"].assemblies["axle"].elements["primary"]
    assert primary.stiffness == (31.391e6, 3.884e6, 936340.0)
    assert mine.name == "x"


def test_override_names_members_of_lists_by_name_or_index():
    for member in ("rear", "1"):
        mine = load_vehicle(
            "coach_manchester", [f"assemblies.bogie.placements.{member}.mirror=false"]
        )
        assert not mine.assemblies["bogie"].placements[1].mirror


TABLE = """format = "railsim-settings/1"
[drive]
mode = "table"
speed_table = [[0.0, 20.0], [300.0, 15.0]]
"""


def test_override_names_rows_and_columns_of_tables_by_their_index(write):
    path = write("s.toml", TABLE)
    settings = load_settings(path, ["drive.speed_table.0.1=18", "drive.speed_table.1=[400, 12]"])
    assert settings.drive.speed_table == ((0.0, 18.0), (400.0, 12.0))


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("drive.speed_table.2.1", "no member '2' in drive.speed_table; allowed: 0 to 1"),
        ("drive.speed_table.-1.1", "no member '-1' in drive.speed_table; allowed: 0 to 1"),
        ("drive.speed_table.first.1", "no member 'first' in drive.speed_table; allowed: 0 to 1"),
        ("drive.speed_table.0.2", "no member '2' in drive.speed_table.0; allowed: 0 to 1"),
        ("drive.speed_table.0.1.0", "'drive.speed_table.0.1' is a value and has no members"),
        ("drive.traction_table.0.1", "'drive.traction_table' is not given; give it as a whole"),
        ("outputs.elements.0", "no member '0' in outputs.elements; it is empty"),
        ("drve.mode", "no 'drve' in the file; did you mean 'drive'?"),
    ],
)
def test_override_of_a_member_that_is_not_there_is_refused(write, key, words):
    (fault,) = faults(load_settings, write("s.toml", TABLE), [f"{key}=3"])
    assert str(fault).removesuffix("; ") == f"overrides: {key}: {words}"


def test_override_changes_one_of_several_default_values():
    assert load_settings(None, ["fastsim_grid.0=20"]).fastsim_grid == (20, 10)
    changed = load_settings(None, ["drive.mode=free", "drive.resistance.2=5"])
    assert changed.drive.resistance == (0.0, 0.0, 5.0)
    assert load_settings().fastsim_grid == (10, 10)


def test_override_of_text_needs_no_quotes_even_if_it_looks_like_a_number():
    assert load_track("straight", ["rail=54E1"]).rail == ("54E1", "54E1")
    assert load_track("straight", ['rail=["60E1", "54E1"]']).rail == ("60E1", "54E1")


def test_override_of_the_initial_state_takes_dotted_body_names():
    for key in ("initial.front.frame.y", 'initial."front.frame".y'):
        settings = load_settings(None, [f"{key}=0.003"])
        assert settings.initial["front.frame"].y == 0.003


def test_single_override_needs_no_list():
    assert load_track("straight", "friction=0.3").friction == (0.3, 0.3)


def test_later_override_wins():
    assert load_settings(None, ["scheme=rk4", "scheme=fast"]).scheme == "fast"


def test_wrong_overrides_come_at_once():
    wrong = [
        "bodies.carbdy.mass=3",
        "assemblies.bogie.placements.frnt.mirror=true",
        "bodies.carbody.mass.x=3",
        "nothing",
        "bodies.carbody.mass=[1,",
        "a b=3",
        "bodies.carbody.inertia.7=3",
    ]
    found = [str(fault) for fault in faults(load_vehicle, "coach_manchester", wrong)]
    assert len(found) == len(wrong)
    assert all(text.startswith("overrides: ") for text in found)
    assert "did you mean 'carbody'?" in found[0]
    assert "did you mean 'front'?" in found[1]


def test_fault_of_an_overridden_value_names_the_option():
    wrong = ["bodies.carbody.mass=-3", "bodies.carbody.weight=3", "reference=engine"]
    found = faults(load_vehicle, "coach_manchester", wrong)
    assert {fault.file for fault in found} == {"overrides"}
    assert {fault.on_command_line().file for fault in found} == {"--set"}
    assert {f.key for f in found} == {"bodies.carbody.mass", "bodies.carbody.weight", "reference"}


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("primary.stiffness.x=soft", "stiffness.0: 'soft'; must be a valid number"),
        ("primary.stifness.x=1e6", "no 'stifness' in assemblies.bogie"),
        ("primary.stiffness.q=1e6", "allowed: x, y, z or 0 to 2"),
    ],
)
def test_fault_of_a_short_path_names_what_is_wrong(key, words):
    with pytest.raises(InputError, match=words):
        load_vehicle("coach_manchester", [key])


def test_overrides_are_sorted_by_their_beginning():
    texts = ["vehicle.name=x", "track.friction=0.3", "settings.step=1e-3"]
    assert split_overrides(texts) == {
        "vehicle": ["name=x"],
        "track": ["friction=0.3"],
        "settings": ["step=1e-3"],
    }
    (fault,) = faults(split_overrides, ["friction=0.3"])
    assert "vehicle., track. or settings." in fault.allowed


def test_override_leaves_the_file_alone():
    load_track("straight", ["plan.0.length=5.0"])
    assert load_track("straight").length == 1000.0


# files that files name ----------------------------------------------------------------------------


def test_profile_file_is_found_beside_the_file_that_names_it(write):
    profile = write("worn.csv", "y_mm,z_mm\n")
    path = write("mine.toml", TRACK + 'rail = ["worn.csv", "60E1"]\n')
    assert load_track(path).rail == (str(profile.resolve()), "60E1")


def test_vehicles_of_a_study_are_found_beside_it_by_all_that_loads_it(write):
    own = write("mine.toml", 'extends = "coach_manchester"\n')
    text = 'format = "railsim-study/1"\nname = "s"\nvehicles = ["mine.toml", "coach_25t"]\n'
    path = write("study.toml", text + 'tracks = ["straight"]\nspeeds = [20.0]\n')
    for load in (load_study, load_any):
        assert load(path).vehicles == (str(own.resolve()), "coach_25t")


def test_text_of_a_track_reads_back():
    track = load_track("curve_r250", ["plan.2.radius=-300.0", "cant.2.cant=-0.1"])
    assert load_track_text(track.to_toml()) == track


def test_any_file_is_recognised_by_its_format():
    definition = load_any(Path(sources.shipped_folder("track")) / "straight.toml")
    assert definition.KIND == "track"
    assert definition.name.startswith("Straight")


def test_a_missing_element_is_told_with_the_way_to_add_it():
    with pytest.raises(InputError, match=r"no 'mine' in elements; it is empty; ") as caught:
        load_vehicle("coach_manchester", ["elements.mine.kind=bushing"])
    assert 'elements.mine={kind="actuator|airspring|' in str(caught.value)
    with pytest.raises(InputError, match=r"did you mean 'carbody'[?]$"):
        load_vehicle("coach_manchester", ["bodies.carbdy.mass=3"])


def test_errors_come_whole_from_another_process():
    """Exceptions are sent by their arguments: the message was taken for faults of one letter."""
    for error in (
        InputError(Fault("a.toml", f"key{k}", "-1", "above 0") for k in range(300)),
        PackageMissing([Fault("plot", "", "needs the package 'pandas'", "install it")]),
    ):
        sent = pickle.loads(pickle.dumps(error))
        assert type(sent) is type(error)
        assert sent.faults == error.faults
        assert str(sent) == str(error)


def test_names_in_one_word_are_told_to_be_separated_by_blanks():
    with pytest.raises(InputError, match="no file 'a,b'; blanks between several names, no commas"):
        sources.find_file("a,b", "vehicle")
