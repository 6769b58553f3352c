"""Variants of a model over the cores: each a run of its own, of which only series come back."""

from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from typing import Any, Self

from railsim.processes import hear_requests, signals_later, worker_context, workers_begin

Task = tuple[Callable[..., Any], tuple[Any, ...]]


@dataclass
class Workers:
    """Processes that carry out tasks; with one worker everything happens in this process.

    Used as a context manager: the processes end with the block.
    """

    count: int
    _pool: ProcessPoolExecutor | None = field(default=None, init=False, repr=False)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._pool is not None:
            self._pool.shutdown(wait=kind is None, cancel_futures=True)
            self._pool = None

    def run(self, tasks: Sequence[Task]) -> list[Any]:
        """Return what the tasks return, in their order; raise the first error of a task."""
        if self.count <= 1 or len(tasks) <= 1:
            return [function(*arguments) for function, arguments in tasks]
        with signals_later(), workers_begin():  # inherited by the processes
            if self._pool is None:
                self._pool = ProcessPoolExecutor(self.count, worker_context(), hear_requests)
            futures = [self._pool.submit(function, *arguments) for function, arguments in tasks]
        return [future.result() for future in futures]
