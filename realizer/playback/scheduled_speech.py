"""Utterances on the session clock, and their samples, cut off and faded as heard."""

from dataclasses import dataclass

import numpy as np

from bml_schema import SpeechText
from realizer.animation.channel import Gain
from realizer.animation.curves import gain_at
from realizer.core.array_types import Float32, Int16
from realizer.speech.utterance import Utterance

# Sound and lips stop faster than a face relaxes, so that an interruption is heard at once.
SPEECH_FADE = 0.12  # s
# A word that lacks no more than this was heard completely.
HEARD = 1e-4  # s


@dataclass(frozen=True, eq=False)
class ScheduledSpeech:
    """An utterance from `start` on, cut off (with a short fade) at `until` if that is sooner.

    It is not heard if it is cut off before it starts; then only its lips may have begun to move.
    """

    start: float
    until: float
    utterance: Utterance
    character: int
    gains: tuple[Gain, ...] = ()
    text: SpeechText | None = None  # as it is written in the document

    @property
    def is_heard(self) -> bool:
        return self.until > self.start

    def is_complete(self, now: float) -> bool:
        return min(self.until, now) >= self.start + self.utterance.duration - HEARD

    def words(self, now: float) -> list[str]:
        until = min(self.until, now) - self.start + HEARD
        return [word.text for word in self.utterance.words if word.end <= until]


# Duration of the fade of cut-off speech, which avoids a click; with half a packet it is over in 50 ms.
CUT = 0.04  # s


def render_utterance(speaking: ScheduledSpeech, rate: int) -> Float32:
    """Return (n,) float32 samples of an utterance with sound, cut off and faded if it was stopped."""
    utterance = speaking.utterance
    assert utterance.pcm is not None
    pcm = resample(utterance.pcm, utterance.sample_rate, rate)
    if speaking.until < speaking.start + utterance.duration:
        length = max(0, round((speaking.until + CUT - speaking.start) * rate))
        pcm = pcm[:length].copy()
        ramp = min(len(pcm), round(CUT * rate))
        pcm[len(pcm) - ramp :] *= np.linspace(1, 0, ramp, dtype=np.float32)
    if speaking.gains:
        times = speaking.start + np.arange(len(pcm)) / rate
        pcm = (pcm * gain_at(speaking.gains, times)).astype(np.float32)
    return pcm


def resample(pcm: Int16, rate: int, wanted: int) -> Float32:
    """Return PCM at another rate, (n,) float32: linear interpolation, box-filtered if the rate falls."""
    samples: Float32 = pcm.astype(np.float32)
    if rate == wanted or not len(pcm):
        return samples
    if wanted < rate:
        width = max(1, round(rate / wanted))
        samples = np.convolve(samples, np.full(width, 1 / width, np.float32), "same")
    count = round(len(pcm) * wanted / rate)
    at = np.arange(count) * (rate / wanted)
    out: Float32 = np.interp(at, np.arange(len(samples)), samples).astype(np.float32)
    return out
