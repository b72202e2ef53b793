"""Threads of linear algebra, which libraries start for each process when they are loaded."""

import os

# Our matrices are small: further threads only wait for each other, on a busy machine for long.
SINGLE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


def use_one_thread() -> None:
    """Let libraries of linear algebra that are loaded later use one thread, if no variable says otherwise."""
    for name, value in SINGLE_THREAD.items():
        os.environ.setdefault(name, value)
