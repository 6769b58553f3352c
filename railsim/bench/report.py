"""The whole benchmark as numbers and as text."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from railsim.bench.commands import commands
from railsim.bench.ensembles import COACH_IN_CURVE, SIZES, ensembles
from railsim.bench.machine import SPIN, hardware, vector_instructions, versions
from railsim.bench.parts import GRIDS, REPETITIONS, fastsim_grids, right_hand_side_parts
from railsim.bench.runs import speed_and_error, two_cores
from railsim.bench.scenarios import IRREGULAR, OTHERS, STUDY, Scenario
from railsim.result import Result

# What a default run may be off from RK4 at 0.125 ms: unloading [1], Y [N], yaw [1].
ALLOWED = {"dQ_over_Q0": 1e-4, "Y": 50.0, "Y_mid_curve": 50.0, "yaw": 1e-3}


@dataclass(frozen=True)
class Plan:
    """How much is measured.

    Attributes
    ----------
    runs : tuple of Scenario
        Runs of the time loop.
    batch : tuple of Scenario
        Runs that are done on one core and on two; none: this part is left out.
    repetitions, batches : int
        How often each run, and the batch, is done.
    reference : bool
        Whether errors are measured (RK4 at 0.125 ms takes twenty times as long as the run).
    distance : float
        Where the right-hand side is taken apart [m].
    part_repetitions : int
        How often a part is measured.
    grids : tuple of int
        Grids of FASTSIM.
    ensembles : tuple of int
        Numbers of runs in one call.
    ensemble_run : Scenario
        What these runs are, with changed springs and dampers.
    command_repetitions : int
        How often whole commands run; 0: not at all.
    cold : bool
        Whether a start with empty caches is measured.
    spins : int
        Length of the loop that finds out whether the machine is quiet.
    """

    runs: tuple[Scenario, ...] = (*STUDY, *OTHERS)
    batch: tuple[Scenario, ...] = STUDY
    repetitions: int = 5
    batches: int = 4
    reference: bool = True
    distance: float = 396.0
    part_repetitions: int = REPETITIONS
    grids: tuple[int, ...] = GRIDS
    ensembles: tuple[int, ...] = SIZES
    ensemble_run: Scenario = COACH_IN_CURVE
    command_repetitions: int = 3
    cold: bool = True
    spins: int = SPIN


FULL = Plan()
QUICK = Plan(
    runs=(STUDY[0], STUDY[2], IRREGULAR[0]),
    repetitions=3,
    batches=2,
    ensembles=(1, 8),
    command_repetitions=1,
    cold=False,
)


def shortened(plan: Plan, until: float) -> Plan:
    """Return a plan whose runs end at `until` [m]."""
    return replace(
        plan,
        runs=tuple(replace(run, until=until) for run in plan.runs),
        batch=tuple(replace(run, until=until) for run in plan.batch),
        ensemble_run=replace(plan.ensemble_run, until=until),
        distance=min(plan.distance, until),
    )


def benchmark(plan: Plan, progress: Callable[[float], None] = lambda _: None) -> dict[str, Any]:
    """Measure everything that a plan asks for.

    Returns
    -------
    dict
        Plain numbers and strings, SI; `runs`, `two_cores`, `parts`, `fastsim`, `ensembles`,
        `commands`.
    """
    found: dict[str, Any] = {
        "hardware": hardware() | {"vectors": vector_instructions()},
        "versions": versions(),
        "runs": [],
    }
    references: dict[Scenario, Result] = {}
    for number, scenario in enumerate(plan.runs):
        reference = None
        if plan.reference:
            # the same run in another scheme has the same reference
            plain = replace(scenario, name="", settings=(), target=None)
            if plain not in references:
                references[plain] = plain.reference()
            reference = references[plain]
        found["runs"].append(speed_and_error(scenario, plan.repetitions, reference))
        progress(0.5 * (number + 1) / len(plan.runs))
    found["parts"] = right_hand_side_parts(
        distance=plan.distance, repetitions=plan.part_repetitions
    )
    found["fastsim"] = fastsim_grids(plan.grids, repetitions=plan.part_repetitions)
    progress(0.6)
    found["ensembles"] = ensembles(plan.ensembles, plan.repetitions, plan.ensemble_run)
    progress(0.7)
    if plan.batch:
        found["two_cores"] = two_cores(plan.batches, plan.batch, plan.spins)
    progress(0.8)
    if plan.command_repetitions:
        found["commands"] = commands(plan.command_repetitions, cold=plan.cold)
    progress(1.0)
    return found


Table = tuple[list[str], list[list[str]]]


def tables(found: dict[str, Any]) -> list[Table]:
    """Return what was found as tables: titles of the columns, rows."""
    made = [
        _runs(found["runs"]),
        _parts(found["parts"]),
        _fastsim(found["fastsim"]),
        _ensembles(found["ensembles"]),
    ]
    if "two_cores" in found:
        made.append(_two_cores(found["two_cores"]))
    if "commands" in found:
        made.append(_commands(found["commands"]))
    return made


def _runs(records: Sequence[dict[str, Any]]) -> Table:
    header = [
        "time loop",
        "step (ms)",
        "x real time",
        "best",
        "target",
        "us per step",
        "dQ/Q0 (points)",
        "Y (kN)",
        "Y mid (kN)",
        "yaw (%)",
        "peaks (%)",
    ]
    rows = []
    for record in records:
        error = record.get("error")
        rows.append(
            [
                record["name"],
                f"{1e3 * record['step']:.3g}",
                f"{record['real_time']:.0f}",
                f"{record['real_time_best']:.0f}",
                "" if record["target"] is None else f"{record['target']:.0f}",
                f"{1e6 * record['cpu_per_step']:.2f}",
                *(
                    [""] * 5
                    if error is None
                    else [
                        f"{1e2 * error['dQ_over_Q0']:.4f}",
                        f"{1e-3 * error['Y']:.4f}",
                        f"{1e-3 * error['Y_mid_curve']:.4f}",
                        f"{1e2 * error['yaw']:.3f}",
                        f"{1e2 * error['peaks']:.2f}",
                    ]
                ),
            ]
        )
    return header, rows


def _parts(found: dict[str, Any]) -> Table:
    whole = found["evaluation"]
    times = {
        **found["parts"],
        "rest": found["rest"],
        "evaluation (fast scheme)": whole,
        "of it wheel and rail": found["wheel_rail"],
        "right-hand side (RK4)": found["right_hand_side"],
        "step of the fast scheme": found["step"],
        "one table look-up": found["look_up"],
    }
    rows = [
        [name, f"{1e6 * time:.3f}", f"{100.0 * time / whole:.0f}"] for name, time in times.items()
    ]
    return [f"right-hand side, {found['patches']} patches", "us", "%"], rows


def _fastsim(records: Sequence[dict[str, float]]) -> Table:
    rows = [
        [
            f"{record['grid']} x {record['grid']}",
            f"{1e6 * record['together']:.3f}",
            f"{1e6 * record['alone']:.3f}",
            f"{1e9 * record['together'] / record['grid'] ** 2:.2f}",
        ]
        for record in records
    ]
    return ["FASTSIM", "us per patch, all at once", "us, one alone", "ns per cell"], rows


def _ensembles(records: Sequence[dict[str, Any]]) -> Table:
    alone = records[0]
    rows = [
        [
            str(record["members"]),
            f"{record['real_time']:.0f}",
            f"{record['real_time_best']:.0f}",
            f"{1e6 * record['cpu_per_step']:.2f}",
            f"{record['real_time'] / alone['real_time']:.2f}",
        ]
        for record in records
    ]
    return ["runs in one call", "x real time, all", "best", "us per step and run", "gain"], rows


def _two_cores(found: dict[str, Any]) -> Table:
    before = found["before"]
    quiet = "" if found["quiet"] else " (machine NOT quiet: no figure)"
    rows = [
        [
            f"batch of {found['runs']} runs, wall (s)",
            f"{found['wall_one']:.2f}",
            f"{found['wall_two']:.2f}",
            f"{found['ratio']:.2f}{quiet}",
        ],
        ["ratio that CPU times of whole runs allow", "", "", f"{found['ratio_of_cpu_times']:.2f}"],
        ["ratio that CPU times of time loops allow", "", "", f"{found['ratio_of_loops']:.2f}"],
        [
            "cores that an empty loop gets",
            f"{before['one_core']:.2f}",
            f"{before['two_cores']:.2f}",
            f"{2.0 / before['slowdown']:.2f}",
        ],
    ]
    return ["one and two cores", "one", "two", "ratio"], rows


def _commands(found: dict[str, Any]) -> Table:
    words = {
        "help": "railsim --help",
        "start": "railsim run of 0.1 m: start-up, warm",
        "run": "railsim run, one coach and curve",
        "study": "railsim study, two coaches on two curves, 2 workers",
        "cold_start": "railsim run of 0.1 m, empty caches",
        "start_after": "the same again",
    }
    rows = [
        [words[name], f"{run['wall']:.2f}", f"{run['cpu']:.2f}", f"{run['memory'] / 1e6:.0f}"]
        for name, run in found.items()
    ]
    return ["whole commands", "wall (s)", "CPU (s)", "peak memory (MB)"], rows
