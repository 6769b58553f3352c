"""Variants of a model over the cores: each a run of its own, of which only series come back."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Self

from railsim.processes import WorkerPool

Task = tuple[Callable[..., Any], tuple[Any, ...]]


@dataclass
class Workers:
    """Processes for tasks, within a block; with one worker everything happens in this process."""

    count: int
    _pool: WorkerPool | None = field(default=None, init=False, repr=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: Any) -> None:
        if self._pool is not None:
            self._pool.__exit__(*error)
            self._pool = None

    def run(self, tasks: Sequence[Task]) -> list[Any]:
        """Return what the tasks return, in their order; raise the first error of a task."""
        if self.count <= 1 or len(tasks) <= 1:
            return [function(*arguments) for function, arguments in tasks]
        if self._pool is None:
            self._pool = WorkerPool(self.count)
        futures = [self._pool.submit(function, *arguments) for function, arguments in tasks]
        return [future.result() for future in futures]
