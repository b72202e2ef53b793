"""The message `speech`: text chunk by chunk, or annotations of a sound clip."""

from __future__ import annotations

import re
from typing import Any, Literal

from pydantic import AliasChoices, Field, field_validator, model_validator

from realizer.protocol.messages.common import Message, examples

# Longest text of one `speech` message; a speech may have any number of them.
MAX_APPEND = 20_000  # characters
# Of other alphabets: capitals, as of SAMPA, and the vowels of ARPABET with their stress in any case.
_NOT_IPA = re.compile("[A-Z]|^(a[aehowxy]|e[hry]|i[hy]|o[wy]|u[hw])[0-2]$")


class TimedText(Message):
    """A word, a phoneme or a viseme of a clip, and its time."""

    start: float = Field(ge=0, le=1e5, description="seconds from the start of the clip")
    end: float | None = Field(None, ge=0, le=1e5, description="default: the start of the next one")
    text: str = Field(
        max_length=256,
        validation_alias=AliasChoices("text", "word", "ipa", "phoneme", "viseme"),
        description='the word, the IPA, or the viseme\'s name in its set; a phoneme "" is a pause',
    )

    @field_validator("text", mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class SpeechMessage(Message):
    """Speak text or clips that arrive in parts; without `id`, describe the contents of a clip.

    Text may contain Markdown, stage directions such as *smiles* and [nod], emoji, <sync id="m"/>, SSML and
    behaviours. A sentence is spoken when it is complete. The speech
    is block `id`, from its first sound to its last. Its parts are the blocks `id.1`, `id.2`, ..., each with
    the behaviour `id`, whose syncs are those of the text: documents refer to them as `id:id:m`, before and
    after they have arrived. Without `close` the block does not end.

    A clip is sent as binary messages, little-endian: u8 kind 4, u8 version 1, u16 flags (0x200: the last
    piece), u32 number of the piece, f64 0, u32 rate in Hz of raw mono int16 PCM (0: the pieces are a WAV,
    FLAC, Ogg, MP3 or WebM file), u8 length of the id, the id, sound. Documents name it as a file: `clip:ID`.
    A speech may name a clip of PCM whose pieces are still to come, if this message describes it or a piece
    has arrived: it begins with the first 200 ms, or where words are known, at the end of a word after these.
    Raw PCM with the id `heard:CHARACTER` is no clip: that character hears it (see `heard`).
    """

    model_config = examples(
        {"type": "speech", "id": "turn", "append": 'Hello <sync id="m"/>there. '},
        {"type": "speech", "id": "turn", "close": True},
        {"type": "speech", "clip": "c", "words": [{"start": 0.1, "end": 0.4, "text": "Hello"}]},
    )

    type: Literal["speech"]
    id: str | None = Field(None, pattern=r"^[A-Za-z0-9_][A-Za-z0-9_-]{0,63}$")
    append: str | None = Field(None, max_length=MAX_APPEND, description="text with markup, as above")
    plain: bool = Field(
        False, description="with its first message: text has no Markdown, stage directions and the like"
    )
    close: bool = Field(False, description="the end of the text: the rest is spoken, then the block ends")
    composition: Literal["MERGE", "APPEND", "REPLACE"] = Field(
        "APPEND", description="of the block, with its first message"
    )
    character: str | None = Field(None, max_length=256, description="with its first message")
    language: str | None = Field(None, max_length=64, description="BCP-47; default: the service's")
    clip: str | None = Field(None, min_length=1, max_length=64, description="id of the clip described here")
    text: str | None = Field(None, max_length=MAX_APPEND, description="the words of the clip as plain text")
    words: list[TimedText] = Field([], max_length=MAX_APPEND)
    phonemes: list[TimedText] = Field([], max_length=MAX_APPEND, description="in IPA")
    visemes: list[TimedText] = Field([], max_length=MAX_APPEND, description="instead of phonemes")
    viseme_set: str = Field("oculus", max_length=64, description="of visemes: mpeg4, oculus, sapi or polly")
    final: bool = Field(True, description="whether the description of the clip is complete")

    @property
    def describes_clip(self) -> bool:
        """Whether it describes its clip; one that only names the clip changes no annotation."""
        return bool(self.text is not None or self.words or self.phonemes or self.visemes)

    @model_validator(mode="after")
    def _whole(self) -> SpeechMessage:
        if self.id is None and self.clip is None:
            raise ValueError("wanted the id of a speech, or a clip")
        if self.id is None and (self.append is not None or self.close):
            raise ValueError("wanted the id of the speech that is appended to or closed")
        if self.clip is None and self.describes_clip:
            raise ValueError("wanted the clip that this describes")
        if self.phonemes and self.visemes:
            raise ValueError("wanted phonemes or visemes, got both")
        for phoneme in self.phonemes:
            if _NOT_IPA.search(phoneme.text):
                raise ValueError(f"phonemes: wanted IPA, got {phoneme.text!r}: ARPABET or SAMPA?")
        return self
