"""The output .wav: the sound of a realization (16 bit, mono)."""

import io
import wave

from realizer.core.array_types import Int16
from realizer.outputs.output import Output

RATE = 22050  # Hz; the rate of espeak-ng, whose sound is not resampled


def encode_wav(pcm: Int16, rate: int) -> bytes:
    """Return (n,) int16 mono as a RIFF file."""
    buffer = io.BytesIO()
    with wave.open(buffer, "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(rate)
        file.writeframes(pcm.astype("<i2").tobytes())
    return buffer.getvalue()


WAV = Output(
    ".wav",
    "audio/wav",
    "the sound, 16 bit mono, 22,050 Hz",
    lambda realization, _: encode_wav(realization.sound(RATE), RATE),
    all_characters=True,
)
