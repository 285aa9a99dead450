"""Has other processes do tasks beside this one, and puts the results in the order of the tasks.

Whoever is free takes the next task, and this process works with the others; a task depends on
nothing but itself, so it makes no difference who does it. A thread for each process starts it,
sends tasks and waits for answers. If a process cannot start or ends early, this one does its task.
"""

from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from threading import Condition, Thread
from typing import Any, TypeVar

from grasp_core.processes.messages import unpacked
from grasp_core.processes.process import Process, can_start

Task = TypeVar("Task")
Result = TypeVar("Result")

AHEAD = 8
"""Number of tasks per process that are handed out before the first of them is done."""


@dataclass(slots=True, eq=False)
class _Place:
    """One task in the line, and how it ended."""

    task: Any
    answer: bytes = b""
    """What another process answered: a pickled pair of result and error."""
    ended: tuple[Any, Exception | None] | None = None
    """Result and error, if the task was done here."""

    @property
    def done(self) -> bool:
        """Return whether somebody has done the task."""
        return bool(self.answer) or self.ended is not None

    def result(self) -> Any:
        """Return the result, or raise the error in its place."""
        result, error = self.ended or unpacked(self.answer)
        if error is not None:
            raise error
        return result


class Workers:
    """Processes of this machine that do tasks beside this one; see `working`."""

    def __init__(self, count: int, start: Callable[[], Process], patience_s: float) -> None:
        self._processes = list[Process]()
        self._start, self._patience_s = start, patience_s
        self._changed = Condition()
        self._open = deque[_Place]()
        self._closed = False
        self._done = 0
        self._threads = [
            Thread(target=self._serve, args=(number,), daemon=True) for number in range(count)
        ]
        self._serving = list[Thread]()

    def begin(self) -> None:
        """Start as many of the threads as the system allows."""
        with suppress(RuntimeError):
            for thread in self._threads:
                thread.start()
                self._serving.append(thread)

    def in_order(
        self, tasks: Iterable[Task], here: Callable[[Task], Result], ahead: int = AHEAD
    ) -> Generator[Result]:
        """Yield the result of each task, in their order."""
        coming, line = iter(tasks), deque[_Place]()
        try:
            while self._line_up(coming, line, ahead):
                self._finish(line[0], here)
                yield line.popleft().result()
        finally:
            with self._changed:
                self._open.clear()

    def _line_up(self, coming: Iterator[Any], line: deque[_Place], ahead: int) -> bool:
        """Hand out the next tasks; return whether any are left."""
        while len(line) < ahead * (1 + len(self._threads)):
            try:
                place = _Place(next(coming))
            except StopIteration:
                break
            line.append(place)
            with self._changed:
                self._open.append(place)
                self._changed.notify_all()
        return bool(line)

    def _finish(self, first: _Place, here: Callable[[Any], Any]) -> None:
        """Do tasks in this process until one of them is done, by this process or another."""
        while True:
            with self._changed:
                while not (first.done or self._open):
                    self._changed.wait()
                if first.done:
                    return
                mine = self._open.popleft()
            try:
                mine.ended = here(mine.task), None
            except Exception as error:
                mine.ended = None, error
            self._done += 1

    def _serve(self, number: int) -> None:
        """Start a process, send it tasks and keep its answers, until no more are asked for."""
        place = None
        try:
            process = self._started(number)
            while process and (place := self._next()):
                answer = process.ask(place.task)
                with self._changed:
                    place.answer = answer
                    self._changed.notify_all()
        except Exception:  # it ended, its pipes are closed, or a value cannot be sent or held
            with self._changed:
                if place is not None:
                    self._open.appendleft(place)
                self._changed.notify_all()

    def _started(self, number: int) -> Process | None:
        """Start a process if it is worth it; None if not, or if nothing is asked for any more."""
        with self._changed:
            if self._patience_s > 0.0:
                self._changed.wait_for(lambda: self._closed, self._patience_s)
                # each process needs as many tasks as this one has done in the time of a start
                if len(self._open) < (number + 1) * max(1, self._done):
                    return None
        process = self._start()
        with self._changed:
            self._processes.append(process)
            if self._closed:
                process.end()
        return process

    def _next(self) -> _Place | None:
        with self._changed:
            while not (self._open or self._closed):
                self._changed.wait()
            return None if self._closed else self._open.popleft()

    def close(self) -> None:
        """End the processes, whatever they do."""
        with self._changed:
            self._closed = True
            self._open.clear()
            self._changed.notify_all()
            for process in self._processes:
                process.end()
        for thread in self._serving:
            thread.join()
        for process in self._processes:
            process.close()


@contextmanager
def working(
    count: int, make: Callable[..., Callable[[Any], Any]], *arguments: Any, patience_s: float = 0.0
) -> Generator[Workers | None]:
    """Let processes work beside this one during a `with` block; None if there are none.

    Takes `patience_s` [s].
    """
    if count < 1 or not can_start():
        yield None
        return
    workers = Workers(count, lambda: Process(make, *arguments), patience_s)
    try:
        workers.begin()
        yield workers
    finally:
        workers.close()
