"""Hardware and versions."""

import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from railsim.processes import available_cores
from railsim.version import __version__

PACKAGES = ("numpy", "numba", "llvmlite", "scipy", "h5py")


def hardware() -> dict[str, Any]:
    """Return processor, number of cores and memory."""
    return {
        "processor": _from_file("/proc/cpuinfo", "model name") or platform.processor(),
        "cores": available_cores(),
        "memory": _from_file("/proc/meminfo", "MemTotal"),
        "system": f"{platform.system()} {platform.machine()}",
    }


def vector_instructions() -> str:
    """Return the widest vector instructions that the kernels use here."""
    from railsim.kernels.fastsim_simd import available

    return "AVX-512, written out" if available() else "as the compiler chooses"


def versions(more: tuple[str, ...] = ()) -> dict[str, str]:
    """Return the versions of Python, railsim and what the time loop rests on."""
    found = {"python": platform.python_version(), "railsim": __version__}
    for package in PACKAGES + more:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found


def _from_file(path: str, key: str) -> str:
    """Return the first value of a key in a file of lines ``key : value``."""
    if not Path(path).exists():
        return ""
    for line in Path(path).read_text().splitlines():
        name, _, value = line.partition(":")
        if name.strip() == key:
            return value.strip()
    return ""
