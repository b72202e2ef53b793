"""Sound clips: pieces in order, limits, annotations that move the lips."""

from __future__ import annotations

import asyncio
import io
import json
import struct
import wave

import numpy as np
import pytest
from websockets.asyncio.client import connect

from bml_schema.feedback import BlockProgress, SyncPointProgress, WarningFeedback, parse_feedback
from realizer.core.settings import Settings
from realizer.protocol.messages.parse import parse_control
from realizer.protocol.wire import ClipPiece, pack_clip, unpack
from realizer.server.serve import Server
from realizer.server.speech import audio_clips
from realizer.server.speech.audio_clips import AudioClips, ClipError
from realizer.speech.sound_visemes.recogniser import recognised
from tests.waiting import LIMIT

RATE = 16000
SOUND = np.rint(9000 * np.sin(np.arange(RATE) * 0.05)).astype("<i2")
SPEAK = (
    '<bml id="b" xmlns:bmlt="http://hmi.ewi.utwente.nl/bmlt"><speech id="s">{}'
    '<description priority="1" type="audio/x-clip"><bmlt:audiofile fileName="clip:{}"/></description>'
    "</speech></bml>"
)


def annotation(**fields):
    return parse_control(json.dumps({"type": "speech", **fields}))


def wav(pcm: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(RATE)
        file.writeframes(pcm.tobytes())
    return buffer.getvalue()


def test_add_chunk_joins_pieces_of_pcm() -> None:
    known = AudioClips()
    known.add_chunk(ClipPiece("c", 0, RATE, SOUND[:1000].tobytes(), final=False))
    assert not known.recordings
    known.add_chunk(ClipPiece("c", 1, RATE, SOUND[1000:].tobytes()))
    assert np.array_equal(known.recordings["c"].pcm, SOUND)
    assert known.recordings["c"].rate == RATE


def test_add_chunk_joins_pieces_of_a_file() -> None:
    known, content = AudioClips(), wav(SOUND)
    known.add_chunk(ClipPiece("c", 0, 0, content[:777], final=False))
    known.add_chunk(ClipPiece("c", 1, 0, content[777:]))
    assert known.recordings["c"].rate == RATE
    assert np.array_equal(known.recordings["c"].pcm, SOUND)


def test_add_chunk_keeps_the_warnings_about_a_file() -> None:
    known = AudioClips()
    form = struct.pack("<HHIIHH", 3, 1, RATE, 4 * RATE, 4, 32)
    data = (SOUND / np.float32(3000)).astype("<f4").tobytes()
    chunks = b"fmt " + struct.pack("<I", 16) + form + b"data" + struct.pack("<I", len(data)) + data
    known.add_chunk(ClipPiece("c", 0, 0, b"RIFF\0\0\0\0WAVE" + chunks))
    (text,) = known.recordings["c"].warnings
    assert "wanted samples of -1..1" in text


def test_add_chunk_recognises_mouth_shapes_as_they_arrive() -> None:
    known = AudioClips()
    for number, piece in enumerate(np.split(SOUND, 20)):
        known.add_chunk(ClipPiece("c", number, RATE, piece.tobytes(), final=number == 19))
    assert known.recordings["c"].heard == recognised(SOUND.astype(np.int16), RATE)


def test_add_chunk_recognises_nothing_in_described_or_long_sound() -> None:
    known = AudioClips()
    known.annotate(annotation(clip="c", text="Hello"))
    known.add_chunk(ClipPiece("c", 0, RATE, SOUND.tobytes()))
    known.add_chunk(ClipPiece("d", 0, RATE, np.tile(SOUND, 3).tobytes()))
    assert known.recordings["c"].heard is known.recordings["d"].heard is None


def test_annotate_accepts_times_before_and_after_the_sound() -> None:
    known = AudioClips()
    known.annotate(annotation(clip="c", words=[{"start": 0, "text": "Hi"}], final=False))
    known.add_chunk(ClipPiece("c", 0, RATE, SOUND.tobytes()))
    assert not known.recordings, "the annotation is not complete"
    known.annotate(annotation(clip="c", words=[{"start": 0.5, "end": 0.9, "text": "you"}]))
    recording = known.recordings["c"]
    assert [(w.start, w.end, w.text) for w in recording.words] == [(0, 0.5, "Hi"), (0.5, 0.9, "you")]
    assert recording.text == "Hi you"
    known.annotate(
        annotation(clip="c", visemes=[{"start": 0.2, "viseme": "PP"}, {"start": 0.3, "viseme": "sil"}])
    )
    assert [(p.start, p.ipa) for p in known.recordings["c"].phonemes] == [(0.2, "p"), (0.3, "")]
    assert known.recordings["c"].words == (), "a new annotation replaces the old one"


def test_add_chunk_replaces_a_clip_that_begins_anew() -> None:
    known = AudioClips()
    known.add_chunk(ClipPiece("c", 0, RATE, SOUND.tobytes()))
    known.annotate(annotation(clip="c", text="Hello"))
    known.add_chunk(ClipPiece("c", 0, RATE, SOUND[:80].tobytes()))
    assert len(known.recordings["c"].pcm) == 80
    assert known.recordings["c"].text is None


@pytest.mark.parametrize(
    ("piece", "says"),
    [
        (ClipPiece("c", 1, RATE, b"ab"), "wanted piece 0, got 1"),
        (ClipPiece("c", 0, 7, b"ab"), "got 7"),
        (ClipPiece("c", 0, RATE, b"abc"), "two bytes"),
        (ClipPiece("c", 0, RATE, b""), "wanted sound"),
        (ClipPiece("c", 0, 0, b"no sound at all"), "wanted"),
    ],
)
def test_add_chunk_refuses_invalid_pieces(piece, says) -> None:
    known = AudioClips()
    with pytest.raises(ClipError, match=says) as error:
        known.add_chunk(piece)
    assert error.value.where == "clip:c"
    assert not known.recordings


def test_add_chunk_removes_the_oldest_clips(monkeypatch) -> None:
    monkeypatch.setattr(audio_clips, "MAX_BYTES", 100)
    known = AudioClips()
    known.add_chunk(ClipPiece("a", 0, RATE, bytes(60)))
    known.add_chunk(ClipPiece("b", 0, RATE, bytes(60)))
    assert list(known.recordings) == ["b"]
    known.add_chunk(ClipPiece("c", 0, RATE, bytes(30), final=False))
    with pytest.raises(ClipError, match="at most 100 bytes"):
        known.add_chunk(ClipPiece("c", 1, RATE, bytes(90)))


@pytest.mark.parametrize(
    ("fields", "where"),
    [
        ({"words": [{"start": 1, "text": "a"}, {"start": 0, "text": "b"}]}, "speech.words"),
        ({"visemes": [{"start": 1, "text": "aa"}, {"start": 0, "text": "PP"}]}, "speech.visemes"),
        ({"visemes": [{"start": 0, "viseme": "PPP"}]}, "speech.visemes"),
        ({"visemes": [{"start": 0, "viseme": 1}], "viseme_set": "mine"}, "speech.visemes"),
    ],
)
def test_annotate_names_the_field_of_invalid_times(fields, where) -> None:
    with pytest.raises(ClipError) as error:
        AudioClips().annotate(annotation(clip="c", **fields))
    assert error.value.where == where


# over a WebSocket ------------------------------------------------------------------------------------------


def play(*messages, until: str = "b:end", **settings) -> list:
    """Return the messages of a service up to a block progress."""
    got: list = []

    async def run() -> None:
        async with (
            asyncio.timeout(LIMIT),
            Server(Settings(port=0, voice="silent", **settings)) as server,
            connect(server.url, max_size=None) as socket,
        ):
            for message in messages:
                await socket.send(json.dumps(message) if isinstance(message, dict) else message)
            async for message in socket:
                got.append(message)
                if isinstance(message, str) and f'id="{until}"' in message:
                    return

    asyncio.run(run())
    return got


def feedback(messages: list) -> list:
    return [parse_feedback(m) for m in messages if isinstance(m, str) and m.startswith("<")]


def test_clips_are_spoken_with_their_annotated_times() -> None:
    got = play(
        {"type": "subscribe", "stream": "audio", "rate": RATE},
        pack_clip(ClipPiece("c1", 0, RATE, SOUND[:5000].tobytes(), final=False)),
        pack_clip(ClipPiece("c1", 1, RATE, SOUND[5000:].tobytes())),
        {
            "type": "speech",
            "clip": "c1",
            "words": [{"start": 0.1, "end": 0.4, "text": "One"}, {"start": 0.62, "end": 0.9, "text": "two"}],
        },
        SPEAK.format('<text>One <sync id="m"/>two</text>', "c1"),
    )
    received = feedback(got)
    assert not [f for f in received if isinstance(f, WarningFeedback)]
    times = {f.id: f.time for f in received if isinstance(f, SyncPointProgress)}
    assert times["b:s:m"] == pytest.approx(0.62, abs=1e-3)
    assert (times["b:s:word-1"], times["b:s:word-2"]) == pytest.approx((0.1, 0.62), abs=1e-6)
    assert times["b:s:end"] == pytest.approx(1.0, abs=1e-6)
    packets = [unpack(m) for m in got if isinstance(m, bytes)]
    start = next(f for f in received if isinstance(f, BlockProgress)).global_time
    late = packets[1]  # the first one has silence before the start, or comes when the start is past
    assert late.stream == "audio"
    first = round(late.time * RATE) - round(start * RATE)
    assert np.array_equal(late.values, SOUND[first : first + len(late.values)])


def test_clips_move_lips_by_their_visemes() -> None:
    visemes = [{"start": 0, "viseme": 2}, {"start": 0.5, "viseme": 21}, {"start": 0.6, "viseme": 2}]
    got = play(
        {"type": "subscribe", "stream": "fap", "encoding": "json", "fps": 50},
        pack_clip(ClipPiece("c", 0, RATE, SOUND.tobytes())),
        {"type": "speech", "clip": "c", "visemes": visemes, "viseme_set": "sapi"},
        SPEAK.format("", "c"),
        idle=False,
    )
    start = next(f for f in feedback(got) if isinstance(f, BlockProgress)).global_time
    frames = [json.loads(m) for m in got if isinstance(m, str) and m.startswith('{"type":"fap"')]
    gap = {round(f["time"] - start, 2): -f["values"][3] - f["values"][4] for f in frames}
    closed = [t for t, value in gap.items() if 0.1 < t < 0.9 and value <= 0]
    assert closed
    assert all(0.42 < t < 0.68 for t in closed)


def test_clips_without_annotation_move_the_jaw_by_loudness() -> None:
    sound = SOUND * (np.arange(RATE) < RATE // 2)
    got = play(
        {"type": "subscribe", "stream": "fap", "encoding": "json", "fps": 25},
        pack_clip(ClipPiece("c", 0, 0, wav(sound.astype("<i2")))),
        SPEAK.format("", "c"),
        idle=False,
    )
    start = next(f for f in feedback(got) if isinstance(f, BlockProgress)).global_time
    frames = [json.loads(m) for m in got if isinstance(m, str) and m.startswith('{"type":"fap"')]
    jaw = {f["time"] - start: f["values"][2] for f in frames}
    assert max(value for t, value in jaw.items() if t < 0.5) > 100
    assert max(value for t, value in jaw.items() if 0.75 < t < 1.0) < 20


def test_clips_that_are_invalid_cause_an_error_and_a_warning() -> None:
    got = play(
        pack_clip(ClipPiece("c", 3, RATE, SOUND.tobytes())),
        b"\x01\x01 no clip, but a header as long as one",
        SPEAK.format("", "c"),
        SPEAK.format("<text>Hello</text>", "c").replace('id="b"', 'id="b2"'),
        until="b2:end",
    )
    errors = [json.loads(m) for m in got if isinstance(m, str) and m.startswith("{")]
    assert [(e["code"], e.get("where")) for e in errors] == [("clip", "clip:c"), ("unsupported", None)]
    warnings = {f.id: f for f in feedback(got) if isinstance(f, WarningFeedback)}
    assert "wanted a clip that was sent to its last piece" in warnings["b:s"].text
    assert "clip:c" in warnings["b2:s"].text, "it is spoken all the same"
