"""Does tasks that another process sends through a pipe, one after the other, until it ends."""

import gc
import os
import signal
import sys
from typing import IO

from grasp_core.processes.messages import receive, send, unpacked


def main() -> None:
    """Receive a function and its arguments, which make the function for all tasks; then do tasks.

    Errors of a task are answers, too. The end of the pipe ends this process.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt ends it through its parent
    gc.disable()  # results are freed as soon as they are sent
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what code prints is no answer
    try:
        _answer(sys.stdin.buffer, answers)
    except (EOFError, BrokenPipeError):
        os._exit(0)  # nobody listens; closing `answers` would fail, too


def _answer(tasks: IO[bytes], answers: IO[bytes]) -> None:
    make, arguments = unpacked(receive(tasks))
    do = make(*arguments)
    while True:
        task = unpacked(receive(tasks))
        try:
            answer = (do(task), None)
        except Exception as error:
            answer = (None, error)
        send(answers, answer)


if __name__ == "__main__":
    main()
