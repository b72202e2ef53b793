"""Programs that tests start: killed when a test has ended, also where it failed."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

__all__ = ["SERVE", "running", "serving"]

SERVE = (sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent")


@contextmanager
def running(command: Sequence[str], **options: Any) -> Iterator[subprocess.Popen[str]]:
    """Start a program; `options` are those of `Popen`."""
    with subprocess.Popen(command, text=True, **{"stdout": subprocess.PIPE, **options}) as program:
        try:
            yield program
        finally:
            program.kill()


@contextmanager
def serving(*options: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """Start a service; its address and its process."""
    with running([*SERVE, *options]) as service:
        assert service.stdout is not None
        yield service.stdout.readline().split()[2], service
