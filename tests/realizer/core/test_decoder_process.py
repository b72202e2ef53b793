"""Tests of `realizer.core.decoder_process`."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest

from realizer.core import decoder_process
from realizer.core.decoder_process import DecoderProcess
from realizer.core.errors import RealizerError

HERE = "tests.realizer.core.test_decoder_process"


def length(content: bytes) -> tuple[int, int]:
    return len(content), os.getpid()


def refuse(content: bytes) -> None:
    raise RealizerError("wanted another file")


def die(content: bytes) -> None:
    os.kill(os.getpid(), int(content))


def fill_memory(content: bytes) -> int:
    return len(bytes(2 * decoder_process.MEMORY))


def fail(content: bytes) -> None:
    raise ZeroDivisionError


@pytest.fixture
def decoder(monkeypatch: pytest.MonkeyPatch) -> Iterator[DecoderProcess]:
    monkeypatch.setenv("PYTHONPATH", str(Path.cwd()))
    made = DecoderProcess()
    yield made
    made.close()


def test_decoder_is_a_process_that_stays(decoder: DecoderProcess) -> None:
    content = bytes(3_000_000)
    first, second = (decoder.decode(f"{HERE}:length", content) for _ in range(2))
    assert first == second
    assert first[0] == len(content)
    assert first[1] != os.getpid()
    with pytest.raises(RealizerError, match=r"^wanted another file$"):
        decoder.decode(f"{HERE}:refuse", b"")
    assert decoder.decode(f"{HERE}:length", content) == first


@pytest.mark.parametrize("number", [signal.SIGSEGV, signal.SIGKILL, signal.SIGXCPU])
def test_decoder_that_a_file_ends_costs_that_file(decoder: DecoderProcess, number: int) -> None:
    with pytest.raises(RealizerError, match="wanted a file that can be decoded in 4 GB of memory and 20 s"):
        decoder.decode(f"{HERE}:die", b"%d" % number)
    assert decoder.decode(f"{HERE}:length", b"ab")[0] == 2


def test_decoder_limits_memory(decoder: DecoderProcess) -> None:
    with pytest.raises(RealizerError, match="decoded in 4 GB of memory"):
        decoder.decode(f"{HERE}:fill_memory", b"")
    assert decoder.decode(f"{HERE}:length", b"ab")[0] == 2


def test_decoder_that_fails_in_an_unknown_way_costs_that_file(decoder: DecoderProcess) -> None:
    with pytest.raises(RealizerError, match="wanted a file that can be decoded"):
        decoder.decode(f"{HERE}:fail", b"")
    assert decoder.decode(f"{HERE}:length", b"ab")[0] == 2
