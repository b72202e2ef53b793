"""One engine of each kind for all tests, which are skipped with a hint if their engine is not installed."""

from collections.abc import Iterator

import pytest

from realizer.speech.espeak import voice as espeak
from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.hibari import voice as hibari
from realizer.speech.hibari.voice import HibariVoice


@pytest.fixture(autouse=True)
def _skip_without_the_engine(request: pytest.FixtureRequest) -> None:
    for marker, missing in (("espeak", espeak.install_hint), ("hibari", hibari.install_hint)):
        if request.node.get_closest_marker(marker) and (fix := missing()):
            pytest.skip(fix)


@pytest.fixture(scope="session")
def voice() -> Iterator[EspeakVoice]:
    voice = EspeakVoice()
    yield voice
    voice.close()


@pytest.fixture(scope="session")
def neural() -> Iterator[HibariVoice]:
    voice = HibariVoice()
    yield voice
    voice.close()
