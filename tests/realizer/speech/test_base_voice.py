"""The base class of voices."""

from realizer.speech.base_voice import BaseVoice
from realizer.speech.utterance import SpeechRequest, Utterance


class Quiet(BaseVoice):
    """A voice that says nothing."""

    name = "quiet"

    def say(self, request: SpeechRequest) -> Utterance:
        return Utterance(0.0, (), (), {})


def test_base_voice_needs_a_name_and_a_method() -> None:
    voice = Quiet()
    assert (voice.name, voice.languages(), voice.missing()) == ("quiet", (), None)
    voice.close()


def test_base_voice_has_no_voices_of_its_own() -> None:
    assert Quiet("low").name == "quiet:low"
    assert "wanted nothing after its name, got 'low'" in (Quiet.missing("low") or "")
