"""The espeak-ng engine, which `engine_worker` runs: synthesizes sound and events.

espeak-ng is GPL-3 and not thread-safe, and its sound depends on earlier requests. Therefore it is loaded only
in a separate process.

    hello     {"rate", "variants": [name], "voices": [{"name", "id", "languages": [[priority, tag]]}]}
    say       {"text", "voice", "wpm"} -> {"events": n, "marks": [name of each event that is a mark]},
              n bytes of events in the engine's structures, and int16 PCM
    phonemes  {"voice", "words"} -> {"phonemes": [[ipa, ...], ...]}
"""

import argparse
import contextlib
import ctypes
import os
from pathlib import Path
from typing import Any, ClassVar

MAX_PATH = 140  # bytes; espeak-ng appends names to its data path in a buffer of 160
CHUNK = 500  # ms of sound in each callback
MAX_SOUND = 1800  # s; longer texts are refused
SYNCHRONOUS, PHONEME_EVENTS, PHONEME_IPA, DONT_EXIT = 2, 1, 2, 0x8000
UTF8, SSML, END_PAUSE = 1, 0x10, 0x1000
RATE = 1  # parameter number: words a minute
MARK = 3  # type of an event; 0 follows the last one


class EventId(ctypes.Union):
    _fields_ = (("number", ctypes.c_int), ("name", ctypes.c_char_p), ("string", ctypes.c_char * 8))


class Event(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int),
        ("unique_identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_position", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("id", EventId),
    )


INTS = ctypes.POINTER(ctypes.c_int)
FIELDS = ctypes.sizeof(Event) // ctypes.sizeof(ctypes.c_int)


class VoiceEntry(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p),
        ("languages", ctypes.c_void_p),
        ("identifier", ctypes.c_char_p),
        ("gender", ctypes.c_ubyte),
        ("age", ctypes.c_ubyte),
        ("variant", ctypes.c_ubyte),
        ("reserved", ctypes.c_ubyte),
        ("score", ctypes.c_int),
        ("spare", ctypes.c_void_p),
    )


SynthCallback = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(Event)
)


class Engine:
    """The loaded library, with a folder of data or its own; RuntimeError if one of them cannot be loaded."""

    drifts = True
    # Spoken before the first request, because a fork of an engine that has spoken takes half the time.
    first: ClassVar[dict[str, Any]] = {"text": "<speak>One, two.</speak>", "wpm": 175}

    def __init__(self, data: str | None) -> None:
        path, own_data = find_library()
        data = data or own_data
        self.lib = lib = ctypes.CDLL(path)
        lib.espeak_Initialize.argtypes = [ctypes.c_int, ctypes.c_int, ctypes.c_char_p, ctypes.c_int]
        lib.espeak_SetVoiceByName.argtypes = [ctypes.c_char_p]
        lib.espeak_SetSynthCallback.argtypes = [SynthCallback]
        lib.espeak_ListVoices.argtypes = [ctypes.c_void_p]
        lib.espeak_ListVoices.restype = ctypes.POINTER(ctypes.POINTER(VoiceEntry))
        lib.espeak_TextToPhonemes.argtypes = [ctypes.POINTER(ctypes.c_void_p), ctypes.c_int, ctypes.c_int]
        lib.espeak_TextToPhonemes.restype = ctypes.c_char_p
        lib.espeak_Synth.argtypes = [
            ctypes.c_void_p, ctypes.c_size_t, ctypes.c_uint, ctypes.c_int,
            ctypes.c_uint, ctypes.c_uint, ctypes.POINTER(ctypes.c_uint), ctypes.c_void_p,
        ]  # fmt: skip
        self.variants: list[str] = []
        if data is not None:
            self.variants = sorted(p.name for p in Path(data, "voices", "!v").glob("*"))
            if len(os.fsencode(data)) > MAX_PATH:
                # From inside the data folder the path is one character long.
                os.chdir(data)
                data = "."
        flags = PHONEME_EVENTS | PHONEME_IPA | DONT_EXIT
        folder = None if data is None else os.fsencode(data)
        self.rate = lib.espeak_Initialize(SYNCHRONOUS, CHUNK, folder, flags)
        if self.rate <= 0:
            raise RuntimeError(f"espeak-ng found no data in {data!r}")

        self.voice = ""
        self.voices = self._voices()
        self.sound: list[bytes] = []
        self.sample_count = 0
        self.events: list[bytes] = []
        self.marks: list[str] = []
        # Created here, because a fork pays for each page of memory that it touches first.
        self.callback = SynthCallback(self._collect)
        lib.espeak_SetSynthCallback(self.callback)
        # The most common voice; an installation may lack English.
        english = (v["id"] for v in self.voices if any(tag == "en-us" for _, tag in v["languages"]))
        with contextlib.suppress(StopIteration, RuntimeError):
            self.say({**self.first, "voice": next(english)})
        self.operations = {"say": self.say, "phonemes": self.phonemes}

    def hello(self) -> dict[str, Any]:
        return {"rate": self.rate, "voices": self.voices, "variants": self.variants}

    def _voices(self) -> list[dict[str, Any]]:
        found = []
        entries = self.lib.espeak_ListVoices(None)
        index = 0
        while entries[index]:
            entry = entries[index].contents
            at, tags = entry.languages, []
            # A list of priority byte, tag, 0; a priority of 0 ends it.
            while (priority := ctypes.c_ubyte.from_address(at).value) != 0:
                tag = ctypes.string_at(at + 1)
                tags.append([priority, tag.decode("ascii", "replace")])
                at += len(tag) + 2
            found.append({"name": text(entry.name), "id": text(entry.identifier), "languages": tags})
            index += 1
        return found

    def say(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        self.sound, self.sample_count, self.events, self.marks = [], 0, [], []
        self._choose(request["voice"])
        self.lib.espeak_SetParameter(RATE, request["wpm"], 0)
        document = request["text"].encode() + b"\0"
        self.lib.espeak_Synth(document, len(document), 0, 1, 0, UTF8 | SSML | END_PAUSE, None, None)
        if self.sample_count > MAX_SOUND * self.rate:
            raise RuntimeError(f"the text lasts longer than {MAX_SOUND} s")
        events = b"".join(self.events)
        return {"events": len(events), "marks": self.marks}, [events, *self.sound]

    def _collect(self, wave: Any, count: int, event: Any) -> int:
        """Store a chunk of sound and its events; return 1 to stop the engine, otherwise 0."""
        if wave and count > 0:
            self.sound.append(ctypes.string_at(wave, 2 * count))
            self.sample_count += count
        fields, at = ctypes.cast(event, INTS), 0
        while (kind := fields[at]) != 0:
            if kind == MARK:  # its id is a pointer to its name
                self.marks.append(text(event[at // FIELDS].id.name or b""))
            at += FIELDS
        self.events.append(ctypes.string_at(event, at * ctypes.sizeof(ctypes.c_int)))
        return int(self.sample_count > MAX_SOUND * self.rate)

    def phonemes(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        self._choose(request["voice"])
        answers = []
        for word in request["words"]:
            buffer = ctypes.create_string_buffer(word.encode())
            place = ctypes.c_void_p(ctypes.addressof(buffer))
            ipa = ""
            while place.value:  # a clause at a time
                clause = self.lib.espeak_TextToPhonemes(
                    ctypes.byref(place), UTF8, PHONEME_IPA | ord("_") << 8
                )
                ipa += "_" + text(clause or b"")
            answers.append([part for part in ipa.replace(" ", "_").split("_") if part])
        return {"phonemes": answers}, []

    def _choose(self, voice: str) -> None:
        if voice == self.voice:  # loading it again takes a tenth of the time of a sentence
            return
        if self.lib.espeak_SetVoiceByName(voice.encode()) != 0:
            raise RuntimeError(f"espeak-ng has no voice {voice!r}")
        self.voice = voice


def find_library() -> tuple[str, str | None]:
    """Return (library, data folder or None for its own) of the pip package, or else of the system."""
    try:
        import espeakng_loader
    except ImportError:
        import ctypes.util  # imported only here, because it makes forks 50 % slower

        path = ctypes.util.find_library("espeak-ng")
        if path is None:
            raise RuntimeError("espeak-ng is not installed") from None
        return path, None
    return str(espeakng_loader.get_library_path()), str(espeakng_loader.get_data_path())


def text(raw: bytes) -> str:
    return raw.decode("utf-8", "replace")


def load(arguments: list[str]) -> Engine:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", help="folder of espeak-ng's data")
    return Engine(parser.parse_args(arguments).data)
