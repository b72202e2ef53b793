"""Tests of audiofile, and of speech with a recording."""

from pathlib import Path

import numpy as np
import pytest

from realizer.behaviours.audio import faults, recording
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.media import MediaError
from realizer.speech.espeak.voice import EspeakVoice, install_hint
from realizer.speech.utterance import Recording, SpeechRequest
from tests.realizer.behaviours.conftest import wav


def sound(played, rate: int = 8000) -> np.ndarray:
    return np.abs(played.realization.sound(rate).astype(float))


def test_audio_sounds_from_its_start_for_its_duration(play, media: Path) -> None:
    played = play(
        '<bmlt:audiofile id="a" fileName="hello.wav" start="1"/><wait id="w" duration="3"/>', media=media
    )
    assert played.warnings == []
    assert played.times("a") == {"start": 1, "end": 1.5}
    heard = sound(played)
    assert not heard[:8000].any()
    assert heard[8000:12000].max() == pytest.approx(0.5 * 32767, abs=200)
    assert not heard[12000:].any()


def test_audio_ties_others_to_its_end_and_does_not_stretch(play, media: Path) -> None:
    played = play(
        '<bmlt:audiofile id="a" fileName="sounds/bell.wav"/><head id="h" lexeme="NOD" start="a:end"/>'
        '<faceLexeme id="f" lexeme="SMILE" start="a:start" end="a:end"/>',
        media=media,
    )
    assert played.times("a") == {"start": 0, "end": 0.25}
    assert played.times("h")["start"] == played.times("f")["end"] == 0.25


def test_audio_is_cut_off_at_an_end_in_the_document(play, media: Path) -> None:
    played = play(
        '<bmlt:audiofile id="a" fileName="hello.wav" end="0.2"/><wait id="w" duration="1"/>', media=media
    )
    assert played.times("a") == {"start": 0, "end": 0.2}
    heard = sound(played)
    assert heard[:1600].max() > 15000
    assert not heard[2100:].any()


def test_audio_with_a_later_end_is_silent_after_its_own(play, media: Path) -> None:
    played = play('<bmlt:audiofile id="a" fileName="hello.wav" start="0" end="2"/>', media=media)
    assert played.times("a")["end"] == 2
    assert not sound(played)[4000:].any()


def test_audio_tied_at_its_end_starts_early_enough(play, media: Path) -> None:
    played = play(
        '<bmlt:audiofile id="a" fileName="hello.wav" end="w:end"/><wait id="w" duration="2"/>', media=media
    )
    assert played.times("a") == pytest.approx({"start": 1.5, "end": 2})


def test_audio_file_that_cannot_be_read_is_dropped(play, media: Path) -> None:
    (media / "not.wav").write_bytes(b"ID3 this is an mp3")
    played = play('<bmlt:audiofile id="a" fileName="not.wav"/><head id="h" lexeme="NOD"/>', media=media)
    assert played.warnings == [("b:a", "CANNOT_CREATE_BEHAVIOR")]
    assert "'not.wav': wanted a mp3 file" in played.warnings_text
    assert played.times("h")


def test_audio_volume_changes_while_it_sounds(play, media: Path) -> None:
    played = play(
        '<bmlt:audiofile id="a" fileName="hello.wav"/>'
        '<bmla:parametervaluechange id="p" target="b:a" paramId="volume" start="0.25">'
        '<bmla:trajectory type="instant" targetValue="20"/></bmla:parametervaluechange>',
        media=media,
    )
    heard = sound(played)
    assert heard[:1900].max() == pytest.approx(0.5 * 32767, rel=0.02)
    assert heard[2800:4000].max() == pytest.approx(0.1 * 32767, rel=0.02)


@pytest.mark.slow
def test_speech_with_a_recording_moves_its_lips_and_syncs(play, media: Path) -> None:
    if fix := install_hint():
        pytest.skip(fix)
    voice = EspeakVoice()
    said = voice.say(SpeechRequest("Mind the open map, please.", voice="en-us+m7"))
    voice.close()
    (media / "said.wav").write_bytes(wav(said.pcm.tobytes(), rate=said.sample_rate))
    played = play(
        '<speech id="s"><text>Mind the <sync id="x"/>open map, please.</text>'
        '<description priority="1" type="audiofile"><bmlt:audiofile fileName="said.wav"/></description>'
        "</speech>",
        media=media,
    )
    assert played.warnings == []
    assert played.times("s")["end"] == pytest.approx(said.duration)
    assert played.times("s")["x"] == pytest.approx(said.words[2].start, abs=0.06)
    assert sound(played).max() > 1000, "the recording is heard"
    open_vowel = next(p for p in said.phonemes if p.ipa == "æ")
    closed = next(p for p in said.phonemes if p.ipa == "p")
    opening = [
        -played.fap(5, (p.start + p.end) / 2) - played.fap(4, (p.start + p.end) / 2)
        for p in (open_vowel, closed)
    ]
    assert opening[0] > opening[1] + 50, "the mouth is open in the vowel and closed in the p"


def test_speech_without_its_recording_is_synthesized_with_a_warning(play, media: Path) -> None:
    played = play(
        '<speech id="s"><text>Hello there</text>'
        '<description priority="1" type="audiofile"><bmlt:audiofile fileName="none.wav"/></description>'
        "</speech>",
        media=media,
    )
    assert played.warnings == [("b:s", "CANNOT_CREATE_BEHAVIOR")]
    assert "none.wav" in played.warnings_text
    assert played.times("s")["end"] > 0.3


def test_speech_with_a_recording_without_text_guesses_its_syncs(play, media: Path) -> None:
    (media / "still.wav").write_bytes(wav(bytes(16_000)))
    played = play(
        '<speech id="s"><text>Hello <sync id="x"/>there</text>'
        '<description priority="1" type="audiofile"><bmlt:audiofile fileName="still.wav"/></description>'
        "</speech>",
        media=media,
    )
    assert played.times("s")["end"] == pytest.approx(1.0)
    assert 0.3 < played.times("s")["x"] < 0.8


CLIP = Recording(8000, np.zeros(80, np.int16))


def test_recording_is_a_file_of_the_media_folder(media: Path) -> None:
    found = recording("hello.wav", PlanningContext(media=media))
    assert (found.rate, len(found.pcm)) == (8000, 4000)


def test_recording_is_a_clip_of_a_client() -> None:
    assert recording(" clip:hi ", PlanningContext(clips={"hi": CLIP})) is CLIP


@pytest.mark.parametrize("name", ["clip:hi", "hello.wav"])
def test_recording_without_media_and_clips_is_an_error(name: str) -> None:
    with pytest.raises(MediaError):
        recording(name, PlanningContext())
    (fault,) = faults(name, PlanningContext())
    assert fault.fatal
    assert fault.text.startswith("fileName: wanted a ")


def test_faults_suggest_the_id_of_a_clip() -> None:
    (fault,) = faults("clip:helo", PlanningContext(clips={"hello": CLIP}))
    assert fault.text.endswith("""got 'clip:helo', did you mean "clip:hello"?""")
    assert faults("clip:hello", PlanningContext(clips={"hello": CLIP})) == ()
