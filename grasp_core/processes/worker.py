"""Does tasks that another process sends through a pipe, one after the other, until it ends."""

import os
import pickle
import signal
import sys
from typing import IO

from grasp_core.processes.messages import receive, send


def main() -> None:
    """Receive a function and its arguments, which make the function for all tasks; then do tasks.

    Errors of a task are answers, too. The end of the pipe ends this process.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt ends it through its parent
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what code prints is no answer
    try:
        _answer(sys.stdin.buffer, answers)
    except (EOFError, BrokenPipeError):
        os._exit(0)  # nobody listens; closing `answers` would fail, too


def _answer(tasks: IO[bytes], answers: IO[bytes]) -> None:
    make, arguments = pickle.loads(receive(tasks))  # noqa: S301 - from our own parent
    do = make(*arguments)
    while True:
        task = pickle.loads(receive(tasks))  # noqa: S301 - from our own parent
        try:
            answer = (do(task), None)
        except Exception as error:
            answer = (None, error)
        send(answers, answer)


if __name__ == "__main__":
    main()
