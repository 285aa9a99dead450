"""Has other processes do tasks beside this one, and puts the results in the order of the tasks.

Whoever is free takes the next task, and this process works with the others; a task depends on
nothing but itself, so it makes no difference who does it. A thread for each process sends tasks and
waits for answers. If a process cannot start or ends early, this one does its task.

The processes are programs of their own and not copies of the caller's, as those of the module
`multiprocessing` are: a script that plans needs no guard against being run again.
"""

import os
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Condition, Thread
from typing import IO, Any, TypeVar

from grasp_core.processes.messages import receive, send, unpacked

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


@dataclass(frozen=True, slots=True, eq=False)
class _Process:
    """A process with the pipes to it and from it."""

    program: "subprocess.Popen[bytes]"
    tasks: IO[bytes]
    answers: IO[bytes]

    def end(self) -> None:
        """End the process, whatever it does."""
        self.program.kill()
        self.program.wait()

    def close(self) -> None:
        """Close the pipes; what was not sent is lost."""
        for pipe in (self.tasks, self.answers):
            with suppress(OSError):
                pipe.close()


class Workers:
    """Processes of this machine that do tasks beside this one; see `working`."""

    def __init__(self, processes: Sequence[_Process], start: Any) -> None:
        self._processes = processes
        self._changed = Condition()
        self._open = deque[_Place]()
        self._closed = False
        self._threads = [
            Thread(target=self._serve, args=(process, start), daemon=True) for process in processes
        ]
        self._serving = list[Thread]()

    def begin(self) -> None:
        """Start as many of the threads as the system allows."""
        with suppress(RuntimeError):
            for thread in self._threads:
                thread.start()
                self._serving.append(thread)

    def in_order(self, tasks: Iterable[Task], here: Callable[[Task], Result]) -> Generator[Result]:
        """Yield the result of each task, in their order.

        Args:
            tasks: Tasks that can be pickled.
            here: Does a task in this process, with the result that the others would give.

        Raises:
            Exception: What the first task that fails raises, in the place of its result.
        """
        coming, line = iter(tasks), deque[_Place]()
        try:
            while self._line_up(coming, line):
                self._finish(line[0], here)
                yield line.popleft().result()
        finally:
            with self._changed:
                self._open.clear()

    def _line_up(self, coming: Iterator[Any], line: deque[_Place]) -> bool:
        """Hand out the next tasks; return whether any are left."""
        while len(line) < AHEAD * (1 + len(self._processes)):
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

    def _serve(self, process: _Process, start: Any) -> None:
        """Send tasks to a process and keep its answers, until no more are asked for."""
        place = None
        try:
            send(process.tasks, start)
            while place := self._next():
                send(process.tasks, place.task)
                answer = receive(process.answers)
                with self._changed:
                    place.answer = answer
                    self._changed.notify_all()
        except Exception:  # it ended, its pipes are closed, or a value cannot be sent or held
            with self._changed:
                if place is not None:
                    self._open.appendleft(place)
                self._changed.notify_all()

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
    count: int, make: Callable[..., Callable[[Any], Any]], *arguments: Any
) -> Generator[Workers | None]:
    """Start processes for a `with` block; None if there are none.

    Args:
        count: Number of processes beside this one.
        make: A function that can be imported by name; it returns the function that does a task.
        arguments: Arguments of `make`, which can be pickled.
    """
    processes = _started(count)
    if not processes:
        yield None
        return
    workers = Workers(processes, (make, arguments))
    try:
        workers.begin()
        yield workers
    finally:
        workers.close()


def _started(count: int) -> list[_Process]:
    """Start processes, as many as the system allows; none where Python is part of a program."""
    if not sys.executable or getattr(sys, "frozen", False):
        return []
    # not -m alone: the current folder must not come before the installed packages
    command = [sys.executable, "-P", "-m", "grasp_core.processes.worker"]
    processes = list[_Process]()
    with suppress(OSError):
        paths = os.pathsep.join(path or str(Path.cwd()) for path in sys.path)
        for _ in range(count):
            program = subprocess.Popen(  # noqa: S603 - our own program
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": paths},
            )  # fmt: skip
            if program.stdin and program.stdout:
                processes.append(_Process(program, program.stdin, program.stdout))
    return processes
