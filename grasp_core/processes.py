"""Other processes of this machine do tasks, with this one or for it; results come in order.

They are no copies of the caller's program, as the processes of the standard library are: a script
needs no guard against being run again, the folder that it works in may be gone, and the end of one
process fails the task that it does and no other. A thread for each process starts it, sends it
tasks through a pipe, one after the other, and waits for answers. A task depends on nothing but
itself, so it makes no difference who does it. A process keeps the function of its last task, with
all that belongs to it: what tasks have in common, such as an object, is sent once if the function
holds it. The end of its input ends a process, so that none outlives this program.
"""

import gc
import os
import pickle
import signal
import struct
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from queue import Empty, SimpleQueue
from threading import Event, Lock, Thread
from typing import IO, Any, TypeVar

from grasp_core.time_spent import TIME_SPENT

GivenTask = TypeVar("GivenTask")
Result = TypeVar("Result")

MESSAGE_LENGTH = struct.Struct("<Q")
TASKS_AHEAD = 8
"""Number of tasks per process that are handed out before the first of them is done."""
STOP_LOOK_S = 0.1
"""Time between two looks whether to stop, while another process works [s]."""
COLLECTED_AFTER = 50_000
"""New objects after which unused circles are looked for: nearly all results are freed when sent."""


class ProcessEndedError(Exception):
    """A process has ended while it did a task, or could not be given it."""


@dataclass(frozen=True, slots=True, eq=False)
class _Asked:
    """A task, the function that does it, and the future that gets its result."""

    function: Callable[[Any], Any]
    task: Any
    future: "Future[Any]" = field(default_factory=Future[Any])


class Processes:
    """Processes of this machine, each of which does one task at a time; see `local_processes`."""

    ended = ("ProcessEndedError",)
    """Names of the errors of tasks whose process has ended."""

    def __init__(self, workers: int, patience_s: float = 0.0) -> None:
        self.workers, self._patience_s = workers, patience_s
        self._waiting = SimpleQueue[_Asked | None]()
        self._closed, self._lock = Event(), Lock()
        self._running = set[_Process]()
        self._done_here = 0
        self._threads = list[Thread]()
        for number in range(workers):
            thread = Thread(target=self._serve, args=(number,), daemon=True)
            with suppress(RuntimeError):  # as many as the system allows
                thread.start()
                self._threads.append(thread)

    def submit(
        self, function: Callable[[GivenTask], Result], task: GivenTask, /
    ) -> "Future[Result]":
        """Call a function in a process; the future fails if that process ends."""
        return self._ask(function, task).future

    def in_order(
        self, function: Callable[[GivenTask], Result], tasks: Iterable[GivenTask], *,
        here: Callable[[GivenTask], Result] | None = None, ahead: int = TASKS_AHEAD,
        stop: Callable[[], bool] | None = None,
    ) -> Generator[Result]:  # fmt: skip
        """Yield the result of each task, in order; this process helps, by `here` if given.

        Results that are not ready when `stop` says so are dropped.
        """
        coming, line, mine = iter(tasks), deque[_Asked](), here or function
        try:
            while True:
                more = islice(coming, ahead * (1 + self.workers) - len(line))
                line.extend(self._ask(function, task) for task in more)
                if not line:
                    return
                first = line.popleft()
                while not first.future.done() and (other := self._unclaimed()):
                    _do(mine, other.task, other.future)
                    self._done_here += 1
                while stop is not None and not first.future.done():
                    if stop():
                        return
                    wait([first.future], STOP_LOOK_S)
                try:
                    result = first.future.result()
                except ProcessEndedError:
                    result = mine(first.task)
                yield result
        finally:
            while self._unclaimed():
                pass

    def _ask(self, function: Callable[[Any], Any], task: Any) -> _Asked:
        asked = _Asked(function, task)
        self._waiting.put(asked)
        return asked

    def _unclaimed(self) -> _Asked | None:
        try:
            return self._waiting.get_nowait()
        except Empty:
            return None

    def _serve(self, number: int) -> None:
        """Hand tasks to a process, or a new one if it ends; with patience, only if many wait."""
        if self._patience_s > 0.0:
            self._closed.wait(self._patience_s)
            if self._waiting.qsize() < (number + 1) * max(1, self._done_here):
                return
        process = None
        while asked := self._waiting.get():
            try:
                process = process or self._started()
                answer = process.ask(asked.function, asked.task)
            except Exception as error:  # it ended, or none starts, or the task cannot be sent
                if process is not None and isinstance(error, EOFError | OSError):
                    self._end(process)
                    process = None
                asked.future.set_exception(ProcessEndedError(f"a process has ended ({error})"))
                continue
            _do(_result_of, answer, asked.future)

    def _started(self) -> "_Process":
        with self._lock:
            if self._closed.is_set():
                raise ProcessEndedError("the processes are closed")
            process = _Process()
            self._running.add(process)
            return process

    def _end(self, process: "_Process") -> None:
        process.end()
        with self._lock:
            self._running.discard(process)

    def close(self) -> None:
        """End the processes, whatever they do; what was not begun is cancelled."""
        with self._lock:
            self._closed.set()
            for process in self._running:
                process.program.kill()
        while asked := self._unclaimed():
            asked.future.cancel()
        for _ in self._threads:
            self._waiting.put(None)
        for thread in self._threads:
            thread.join()
        for process in list(self._running):
            self._end(process)


@contextmanager
def local_processes(workers: int, patience_s: float = 0.0) -> Generator[Processes]:
    """Have processes do tasks during a `with` block; the first starts after `patience_s` [s]."""
    started = Processes(workers, patience_s)
    try:
        yield started
    finally:
        started.close()


def _do(function: Callable[[Any], Any], task: Any, future: "Future[Any]") -> None:
    """Call a function on a task, and give the future what comes of it."""
    try:
        result = function(task)
    except Exception as error:
        future.set_exception(error)
    else:
        future.set_result(result)


class _Process:
    """A program of our own, with the pipes to it and from it."""

    def __init__(self) -> None:
        if getattr(sys, "frozen", False) or not sys.executable:
            raise OSError("Python is a part of another program, which is not started again")
        self.function: Callable[[Any], Any] | None = None  # that of its last task
        places = [place for place in (path or _working_folder() for path in sys.path) if place]
        # not -m alone: the current folder must not come before the installed packages
        self.program = subprocess.Popen(
            [sys.executable, "-P", "-m", "grasp_core.processes"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            # processes share the processors: threads of BLAS would only wait for each other
            env={"OPENBLAS_NUM_THREADS": "1", **os.environ, "PYTHONPATH": os.pathsep.join(places)},
        )  # fmt: skip

    def ask(self, function: Callable[[Any], Any], task: Any) -> bytes:
        """Have a task done; return result, error and time spent, pickled."""
        if self.program.stdin is None or self.program.stdout is None:
            raise OSError("no pipe was opened")
        send(self.program.stdin, (None if function == self.function else function, task))
        self.function = function
        return receive(self.program.stdout)

    def end(self) -> None:
        """End the process, whatever it does; what was not sent is lost."""
        self.program.kill()
        self.program.wait()
        for pipe in (self.program.stdin, self.program.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()


def _working_folder() -> str:
    """Return where an empty place for modules is; empty if the folder is gone."""
    try:
        return str(Path.cwd())
    except OSError:
        return ""


def send(pipe: IO[bytes], value: Any) -> None:
    """Send one value, after its length in bytes; protocol 5 keeps the bits of contiguous arrays."""
    message = pickle.dumps(value, protocol=5)
    pipe.write(MESSAGE_LENGTH.pack(len(message)))
    pipe.write(message)
    pipe.flush()


def receive(pipe: IO[bytes]) -> bytes:
    """Receive the bytes of one value, for `unpacked`."""
    (length,) = MESSAGE_LENGTH.unpack(_exactly(pipe, MESSAGE_LENGTH.size))
    return _exactly(pipe, length)


def _exactly(pipe: IO[bytes], length: int) -> bytes:
    message = pipe.read(length)
    if len(message) < length:
        raise EOFError("the other process has ended")
    return message


def unpacked(message: bytes) -> Any:
    """Return the value of a message of our own process, whose objects nearly all live on."""
    collects = gc.isenabled()
    gc.disable()
    try:
        return pickle.loads(message)  # noqa: S301 - our own process sent it
    finally:
        if collects:
            gc.enable()


def _result_of(answer: bytes) -> Any:
    """Return a task's result, or raise the error in its place."""
    result, error, spent = unpacked(answer)
    TIME_SPENT.add(spent)
    if error is not None:
        raise error
    return result


def main() -> None:
    """Do the tasks that come through standard input until it ends; errors are answers, too."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt ends it through its parent
    gc.set_threshold(COLLECTED_AFTER)
    asked, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nothing = os.open(os.devnull, os.O_RDWR)
    os.dup2(nothing, 0)  # code that looks at its input would wait for the thread that reads tasks
    os.dup2(nothing, 1)  # what code prints is no answer
    messages = SimpleQueue[bytes]()
    Thread(target=_listen, args=(asked, messages), daemon=True).start()
    function: Callable[[Any], Any] = repr
    try:
        while True:
            new, task = unpacked(messages.get())
            function = function if new is None else new
            try:
                answer = (function(task), None)
            except Exception as error:
                answer = (None, error)
            send(answers, (*answer, TIME_SPENT.taken()))
    finally:
        os._exit(1)  # Python cannot end in order while a thread reads its input


def _listen(pipe: IO[bytes], messages: "SimpleQueue[bytes]") -> None:
    """Receive messages while tasks are done, and end the process when nobody sends any more."""
    try:
        while True:
            messages.put(receive(pipe))
    except (EOFError, OSError):
        os._exit(0)


if __name__ == "__main__":
    main()
