"""Does tasks that another process sends through a pipe, one after the other, until it ends."""

import gc
import os
import signal
import sys
from queue import SimpleQueue
from threading import Thread
from typing import IO

from grasp_core.processes.messages import receive, send, unpacked

Messages = SimpleQueue[bytes]
COLLECTED_AFTER = 50_000
"""Number of new objects after which unused circles of objects are looked for: nearly all results
are freed as soon as they are sent."""


def main() -> None:
    """Receive a function and its arguments, which make the function for all tasks; then do tasks.

    Errors of a task are answers, too. The end of the pipe ends this process, whatever it does.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # an interrupt ends it through its parent
    gc.set_threshold(COLLECTED_AFTER)
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # what code prints is no answer
    messages = Messages()
    Thread(target=_listen, args=(sys.stdin.buffer, messages), daemon=True).start()
    try:
        _answer(messages, answers)
    finally:
        os._exit(1)  # Python cannot end in order while a thread reads its input


def _listen(pipe: IO[bytes], messages: Messages) -> None:
    """Receive messages while tasks are done, and end the process when nobody sends any more."""
    try:
        while True:
            messages.put(receive(pipe))
    except (EOFError, OSError):
        os._exit(0)


def _answer(messages: Messages, answers: IO[bytes]) -> None:
    make, arguments = unpacked(messages.get())
    do = make(*arguments)
    while True:
        task = unpacked(messages.get())
        try:
            answer = (do(task), None)
        except Exception as error:
            answer = (None, error)
        send(answers, answer)


if __name__ == "__main__":
    main()
