"""The message `speech`."""

from __future__ import annotations

import pytest

from realizer.protocol.messages.parse import parse_control
from realizer.protocol.messages.replies import ErrorMessage


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ("", "the id of a speech, or a clip"),
        (',"clip":"c","append":"Hello"', "the id of the speech"),
        (',"id":"t","words":[]', ""),
        (',"id":"t","text":"Hello"', "the clip that this describes"),
        (',"clip":"c","phonemes":[{"start":0,"ipa":"p"}],"visemes":[{"start":0,"viseme":1}]', "got both"),
        (
            ',"clip":"c","phonemes":[{"start":0,"ipa":"AH0"}]',
            "phonemes: wanted IPA, got 'AH0': ARPABET or SAMPA?",
        ),
        (
            ',"clip":"c","phonemes":[{"start":0,"ipa":"ah0"}]',
            "phonemes: wanted IPA, got 'ah0': ARPABET or SAMPA?",
        ),
        (',"clip":"c","phonemes":[{"start":0,"ipa":"ma1"},{"start":1,"ipa":"aɪ"}]', ""),
        (',"clip":"c","words":[{"start":-1,"text":"a"}]', "wanted at least 0; got -1"),
        (',"id":"t 1","append":"x"', "a string that matches"),
    ],
)
def test_speech_message_says_what_is_missing(fields, says) -> None:
    message = parse_control('{"type":"speech"' + fields + "}")
    assert isinstance(message, ErrorMessage) == bool(says)
    if isinstance(message, ErrorMessage):
        assert message.code == "invalid"
        assert says in message.message
        assert message.message.count("got") == 1
