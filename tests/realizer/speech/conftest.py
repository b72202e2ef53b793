"""One espeak-ng for all tests; those that need it are skipped, with what to install, where it is absent."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from realizer.speech.espeak import EspeakVoice, missing


@pytest.fixture(autouse=True)
def _skip_without_espeak(request: pytest.FixtureRequest) -> None:
    if request.node.get_closest_marker("espeak") and (fix := missing()):
        pytest.skip(fix)


@pytest.fixture(scope="session")
def voice() -> Iterator[EspeakVoice]:
    voice = EspeakVoice()
    yield voice
    voice.close()
