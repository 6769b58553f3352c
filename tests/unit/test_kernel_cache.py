"""The disk cache of compiled kernels, in a copy of them: never an old callee, never a recompile."""

import os
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import SimpleNamespace

import numba
import pytest

import railsim.kernels
from railsim.kernels import lock
from railsim.kernels.compiler import KernelCache

# in another file than what it calls, and compiled in a second
CALLER = """
from railsim.kernels import compiled
from railsim.kernels.hertz import log_curvature_ratio

@compiled
def caller(log_k):
    return log_curvature_ratio(log_k) + log_curvature_ratio(-log_k)
"""

# prints twice the logarithm of A/B of a circle, which is 0, and how often numba had to compile
PROGRAM = """
import os
import numba
from railsim.kernels.caller import caller
assert numba.config.CACHE_DIR == os.environ.get("NUMBA_CACHE_DIR", "")  # others' kernels
print(caller(0.0), sum(caller.stats.cache_misses.values()))
"""

# of all functions in the compiled code of `caller`: those that other code could be bound to
VISIBLE = """
from llvmlite.binding import Linkage
(compiled,) = caller.overloads.values()
functions = list(compiled.library.get_defined_functions())
visible = [function.name for function in functions if function.linkage != Linkage.internal]
names = [function.name.partition("B")[0] for function in functions]
assert any("caller" in name for name in names)
assert any("carlson_rd" in name for name in names)
print(*(name.partition("B")[0] for name in visible))
"""


def copy_of_kernels(folder):
    package = folder / "railsim"
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(Path(railsim.kernels.__file__).parent, package / "kernels", ignore=ignored)
    (package / "__init__.py").touch()
    (package / "kernels" / "caller.py").write_text(CALLER)
    return package / "kernels"


@pytest.fixture
def copied_kernels(tmp_path):
    return copy_of_kernels(tmp_path)


@pytest.fixture(scope="module")
def compiled_kernels(tmp_path_factory):
    """A copy of which `PROGRAM` has run once, and the names that `VISIBLE` printed after it."""
    kernels = copy_of_kernels(tmp_path_factory.mktemp("compiled"))
    line, names = output(PROGRAM + VISIBLE, kernels.parent.parent)
    assert line == "0.0 1"
    return kernels, names.split()


def output(program, folder, **variables):
    environment = {name: text for name, text in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    environment |= {"RAILSIM_CACHE_DIR": str(folder / "cache"), **variables}
    done = subprocess.run(
        [sys.executable, "-c", program],
        cwd=folder,  # where the copy is imported from
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    return done.stdout.splitlines()


def run(folder, **variables):
    (line,) = output(PROGRAM, folder, **variables)
    number, misses = line.split()
    return float(number), int(misses)


@pytest.mark.slow
def test_edited_callee_in_another_file_gives_the_new_number(compiled_kernels):
    kernels, _ = compiled_kernels
    callee = kernels / "hertz.py"
    line = "return math.log(carlson_rd(0.0, k2, 1.0) /"
    text = callee.read_text()
    assert text.count(line) == 1
    callee.write_text(text.replace(line, line.replace("return", "return 3.5 +")))
    assert run(kernels.parent.parent)[0] == 7.0


@pytest.mark.slow
@pytest.mark.further
def test_second_process_compiles_nothing(copied_kernels):
    folder = copied_kernels.parent.parent
    assert run(folder) == (0.0, 1)
    assert run(folder) == (0.0, 0)


@pytest.mark.parametrize(("name", "value"), [("OPT", 0), ("BOUNDSCHECK", 1)])
def test_code_compiled_in_another_way_is_other_code(monkeypatch, tmp_path, name, value):
    """What a debugging run stores is not what later runs load."""
    codegen = SimpleNamespace(magic_tuple=lambda: ("processor", "features"))
    kept = KernelCache(output, tmp_path)
    usual = kept._path("f(x)", codegen)
    monkeypatch.setattr(numba.config, name, value)
    assert kept._path("f(x)", codegen) != usual


def test_lock_whose_file_was_removed_is_no_lock(tmp_path):
    """Who waited for the removed file does not go on beside the holder of the next one."""
    path = tmp_path / "tables.lock"
    first = lock._acquire(path)
    with ThreadPoolExecutor(1) as threads:
        waiting = threads.submit(lock._acquire, path)
        time.sleep(2.0 * lock.POLL)  # it has opened the file
        path.unlink()
        second = lock._acquire(path)
        os.close(first)
        time.sleep(3.0 * lock.POLL)
        assert not waiting.done()
        os.close(second)
        os.close(waiting.result(timeout=10.0))


@pytest.mark.slow
def test_process_that_ends_while_it_compiles_lets_one_of_the_next_ones_compile(copied_kernels):
    """Of those that begin at once one compiles, the others wait and load: workers of a machine."""
    folder = copied_kernels.parent.parent
    dies = "import os\nfrom railsim.kernels import compiler\nKernel = compiler.KernelCache\n"
    dies += "Kernel.save_overload = lambda *of_one: os._exit(1)\n" + PROGRAM
    with pytest.raises(subprocess.CalledProcessError):
        output(dies, folder)
    with ThreadPoolExecutor(2) as threads:
        found = list(threads.map(run, [folder] * 2))
    assert sorted(found) == [(0.0, 0), (0.0, 1)]


@pytest.mark.slow
def test_folder_that_a_user_chose_for_numba_is_used(copied_kernels, tmp_path):
    run(copied_kernels.parent.parent, NUMBA_CACHE_DIR=str(tmp_path / "mine"))
    assert list((tmp_path / "mine").rglob("caller.caller*"))
    assert not (tmp_path / "cache").exists()


@pytest.mark.slow
def test_without_a_folder_to_write_to_kernels_run_uncached(copied_kernels, tmp_path):
    (tmp_path / "file").touch()
    run(copied_kernels.parent.parent, RAILSIM_CACHE_DIR=str(tmp_path / "file" / "cache"))


@pytest.mark.slow
def test_no_other_code_is_bound_to_the_callees_of_a_function(compiled_kernels):
    """Else results depend on which function was compiled or called first, see `railsim.kernels`."""
    _, names = compiled_kernels
    assert names
    assert all("caller" in name for name in names)
