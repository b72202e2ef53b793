"""The hibari engine, run by `engine_worker`: text to readings, readings to PCM and durations.

    hello   {"rate", "durations": whether the model reports the durations of its signs}
    read    {"texts"} -> {"texts": [[[[word, phonemes, blank after], ...] a sentence, ...] a text, ...]}
    say     {"phonemes", "speed", "pitch"} -> {"lead", "signs": [one a character of `phonemes`], "tail"} in
            samples (null if the model does not report them), and float32 PCM

hibari (Apache-2.0) speaks English. Its model has a tensor of durations, which is declared as an output here.
The same request gives the same samples, because the noise of each sentence has a fixed seed.
"""

import argparse
import re
from pathlib import Path
from typing import Any

DURATIONS = "/Round_output_0"  # frames of each sign, in the models of hibari 0.2
SEED = 0
LONGEST = 400  # phonemes at once; time and memory of the model grow with the square
LINK = re.compile(r"\](?=\()")  # hibari interprets [word](/phonemes/); here brackets are text


class Speaker:
    """The loaded model and its reader; `durations` is the name of the tensor of durations."""

    drifts = False

    def __init__(self, voice: str, durations: str) -> None:
        from hibari import Hibari
        from hibari.voices import voice_path

        model = Path(voice_path(voice, download_missing=False)).read_bytes()
        try:
            self.hibari = Hibari(voice, with_output(model, durations))
            self.has_durations = True
        except Exception:  # onnxruntime's exceptions are not public; a damaged model fails again
            self.hibari = Hibari(voice, model)
            self.has_durations = False
        self.reader = self.hibari.g2p
        self.operations = {"read": self.read, "say": self.say}

    def hello(self) -> dict[str, Any]:
        self.reading("Hello.")  # load now what the first sentence would have to wait for
        self.say({"phonemes": "hi", "speed": 1.0, "pitch": 1.0})
        return {"rate": self.hibari.sample_rate, "durations": self.has_durations}

    def read(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        return {"texts": [self.reading(text) for text in request["texts"]]}, []

    def reading(self, text: str) -> list[list[tuple[str, str, bool]]]:
        from hibari.g2p.normalize import normalize

        sentences = []
        for sentence in self.hibari.split_sentences(LINK.sub("] ", text)):
            tokens = self.reader.phonemize_tokens(self.reader.tokenize(normalize(sentence)))
            words = [(token.text, token.phonemes or "", bool(token.whitespace)) for token in tokens]
            sentences += split(words)
        return sentences

    def say(self, request: dict[str, Any]) -> tuple[dict[str, Any], list[bytes]]:
        import numpy as np
        from hibari import dsp

        known = self.hibari.vocab
        signs = [sign for sign in request["phonemes"] if sign in known]
        inputs = {
            "ids": np.array([[0, *(known[sign] for sign in signs), 0]], np.int64),
            "speed": np.array([request["speed"]], np.float32),
        }
        heights, angles, noise, rest, phase, pitch, *durations = self.hibari.sess.run(None, inputs)
        random = np.random.default_rng(SEED)
        sound = dsp.synth(
            heights[0], angles[0], noise[0], rest[0], phase[0], pitch[0] * request["pitch"], random
        )
        head: dict[str, Any] = {"lead": 0, "signs": None, "tail": 0}
        if durations:
            frames = durations[0].ravel()
            hop = len(sound) / frames.sum()
            lengths = iter((frames * hop).round().astype(int).tolist())
            lead = next(lengths)
            each = [next(lengths) if sign in known else 0 for sign in request["phonemes"]]
            head = {"lead": lead, "signs": each, "tail": next(lengths)}
        return head, [sound.astype("<f4").tobytes()]


def split(words: list[tuple[str, str, bool]]) -> list[list[tuple[str, str, bool]]]:
    """Split a sentence into pieces of at most `LONGEST` phonemes at commas, else at blanks, else anywhere."""
    pieces: list[list[tuple[str, str, bool]]] = [[]]
    length = 0
    for text, phonemes, blank in words:
        while phonemes or text:
            if length + len(phonemes) > LONGEST and pieces[-1]:
                rest = pieces[-1]
                cut = next(
                    (k for k in range(len(rest), 0, -1) if rest[k - 1][1][-1:] in (",", ";", ":", "—")), 0
                )
                if sum(len(word[1]) for word in rest[:cut]) < LONGEST // 2:
                    cut = next((k for k in range(len(rest), 0, -1) if rest[k - 1][2]), len(rest))
                pieces[-1:] = [rest[:cut], rest[cut:]]
                length = sum(len(word[1]) for word in pieces[-1])
                continue
            pieces[-1].append((text, phonemes[:LONGEST], blank and len(phonemes) <= LONGEST))
            length += len(phonemes[:LONGEST])
            text, phonemes = "", phonemes[LONGEST:]
    return [piece for piece in pieces if piece]


def with_output(model: bytes, tensor: str) -> bytes:
    """Return an ONNX model with one more output.

    Protocol buffers merge repeated messages, so a second ModelProto.graph (7) that only has a
    GraphProto.output (12) with a ValueInfoProto.name (1) is appended to the model.
    """
    message = tensor.encode()
    for field in (1, 12, 7):
        message = bytes([field << 3 | 2, len(message)]) + message  # lengths below 128 take one byte
    return model + message


def load(arguments: list[str]) -> Speaker:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--voice", default="heart")
    parser.add_argument("--durations", default=DURATIONS, help="name of a tensor")
    options = parser.parse_args(arguments)
    return Speaker(options.voice, options.durations)
