"""A process that decodes what strangers send, so that a file which ends the decoder costs that file alone.

One process of a service has one, which starts with the first file and stays. It has limits of memory, of
processor time for each file, and of time.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from realizer.core.errors import RealizerError
from realizer.core.threads import SINGLE_THREAD

MEMORY = 4 * 2**30  # bytes of addresses; half an hour of sound takes a third of it
SECONDS = 20  # of a processor for one file; half an hour of MP3 takes three
PATIENCE = 60.0  # s; on a busy machine, and for the start


@dataclass(frozen=True)
class _Failed:
    message: str


class DecoderProcess:
    """A decoder; several threads may use it, one after the other."""

    def __init__(self) -> None:
        self._turn = threading.Lock()
        self._process: subprocess.Popen[bytes] | None = None
        self._orders: Connection
        self._answers: Connection

    def decode(self, function: str, content: bytes) -> Any:
        """Return what a function makes of a file's content.

        Args:
            function: MODULE:NAME of a function that takes bytes; its result can be pickled.

        Raises:
            RealizerError: of the function, or the file took too much memory or time, or ended the decoder.
        """
        with self._turn:
            if self._process is None or self._process.poll() is not None:
                self.close()
                self._start()
            try:
                self._orders.send((function, content))
                if not self._answers.poll(PATIENCE):
                    raise EOFError
                answer = self._answers.recv()
            except (EOFError, OSError):
                self.close()
                limits = f"{MEMORY / 2**30:g} GB of memory and {SECONDS} s"
                raise RealizerError(f"wanted a file that can be decoded in {limits}, got another") from None
        if isinstance(answer, _Failed):
            raise RealizerError(answer.message)
        return answer

    def close(self) -> None:
        """End the process; the next file starts a new one."""
        process, self._process = self._process, None
        if process is not None:
            self._orders.close()
            self._answers.close()
            process.kill()
            process.wait()

    def _start(self) -> None:
        paths = [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
        environment = {**os.environ, **SINGLE_THREAD, "PYTHONPATH": os.pathsep.join(paths)}
        command = [sys.executable, "-P", "-m", "realizer.core.decoder_process"]
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._orders = Connection(os.dup(self._process.stdin.fileno()), readable=False)
        self._answers = Connection(os.dup(self._process.stdout.fileno()), writable=False)
        self._process.stdin.close()
        self._process.stdout.close()


DECODER = DecoderProcess()
atexit.register(DECODER.close)


def serve(orders: Connection, answers: Connection) -> None:
    """Answer until the owner closes its end."""
    with contextlib.suppress(EOFError, BrokenPipeError):
        while True:
            function, content = orders.recv()
            _limit()
            module, _, name = function.partition(":")
            try:
                answer = getattr(import_module(module), name)(content)
            except RealizerError as error:
                answer = _Failed(str(error))
            except MemoryError:
                answer = _Failed(f"wanted a file that can be decoded in {MEMORY / 2**30:g} GB of memory")
            answers.send(answer)


def _limit() -> None:
    """Limit the memory of this process, and its processor time from now on."""
    try:
        import resource
    except ImportError:  # Windows has no such limits
        return
    used = resource.getrusage(resource.RUSAGE_SELF)
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, resource.RLIM_INFINITY))
    seconds = int(used.ru_utime + used.ru_stime) + SECONDS
    resource.setrlimit(resource.RLIMIT_CPU, (seconds, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def main() -> None:
    """Serve the owner, whose messages come by standard input."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the owner
    orders = Connection(os.dup(0), writable=False)
    answers = Connection(os.dup(1), readable=False)
    os.dup2(2, 1)  # output of libraries must not mix with the answers
    serve(orders, answers)


if __name__ == "__main__":
    # Under its own name, so that what it pickles is known to its owner.
    import realizer.core.decoder_process as named

    named.main()
