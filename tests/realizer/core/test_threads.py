"""Threads of linear algebra."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from realizer.core.threads import SINGLE_THREAD, use_one_thread
from tests.waiting import LIMIT


def test_use_one_thread_keeps_what_the_environment_says(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in SINGLE_THREAD:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("OMP_NUM_THREADS", "3")
    use_one_thread()
    assert {name: os.environ[name] for name in SINGLE_THREAD} == {**SINGLE_THREAD, "OMP_NUM_THREADS": "3"}


def test_use_one_thread_comes_before_numpy_in_commands() -> None:
    script = "import realizer.cli, sys; assert 'numpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", script], check=True, timeout=LIMIT)
