"""Attributes of SSML's <prosody> as factors on rate, pitch and volume."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

# SSML 1.1 leaves the size of the named steps to the engine; these are our choice.
RATES = {"x-slow": 0.5, "slow": 0.75, "medium": 1.0, "default": 1.0, "fast": 1.4, "x-fast": 1.8}
PITCHES = {"x-low": 0.75, "low": 0.87, "medium": 1.0, "default": 1.0, "high": 1.15, "x-high": 1.33}
VOLUMES = {
    "silent": 0.0,
    "x-soft": 0.25,
    "soft": 0.5,
    "medium": 1.0,
    "default": 1.0,
    "loud": 1.4,
    "x-loud": 2.0,
}
MIN_RATE, MAX_RATE = 0.25, 4.0
MIN_PITCH, MAX_PITCH = 0.5, 2.0
MAX_VOLUME = 4.0
HERTZ = re.compile(r"\s*[+-]?(\d+(?:\.\d+)?|\.\d+)\s*Hz\s*", re.IGNORECASE)
NUMBER = re.compile(r"\s*([+-]?)(\d+(?:\.\d+)?|\.\d+)\s*(%|st|dB|)\s*", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Prosody:
    """Factors on the voice's own way of speaking; 1 is no change.

    Attributes:
        rate: 2 is twice as fast.
        pitch: 2 is an octave higher.
        volume: of the amplitude; 0 is silent.
    """

    rate: float = 1.0
    pitch: float = 1.0
    volume: float = 1.0

    def within(self, attributes: Mapping[str, str]) -> Prosody:
        """Return the prosody of a <prosody> element inside this one; unknown values change nothing."""
        return Prosody(
            self.rate * _bounded(_factor(attributes.get("rate", ""), RATES), MIN_RATE, MAX_RATE),
            self.pitch * _bounded(_factor(attributes.get("pitch", ""), PITCHES), MIN_PITCH, MAX_PITCH),
            self.volume * _bounded(_factor(attributes.get("volume", ""), VOLUMES), 0.0, MAX_VOLUME),
        )


PLAIN = Prosody()


def is_supported(attribute: str, value: str) -> bool:
    """Return whether the value of an attribute of <prosody> is valid; True except for rate, pitch, volume."""
    names = {"rate": RATES, "pitch": PITCHES, "volume": VOLUMES}.get(attribute)
    if names is None or value.strip() in names or NUMBER.fullmatch(value):
        return True
    return attribute == "pitch" and bool(HERTZ.fullmatch(value))


def _factor(text: str, names: Mapping[str, float]) -> float:
    """Return the factor of a name, a percentage ("80%", "+10%"), semitones ("-2st") or decibels ("+6dB")."""
    number = NUMBER.fullmatch(text)
    if not number:
        return names.get(text.strip(), 1.0)
    sign, digits, unit = number[1], float(number[2]), number[3].lower()
    signed = -digits if sign == "-" else digits
    if unit == "st":
        return float(2 ** (signed / 12))
    if unit == "db":
        return float(10 ** (signed / 20))
    if unit == "%":
        return 1.0 + signed / 100 if sign else digits / 100
    # A bare number is a factor of the rate, or a volume of 0..100, where 100 is the voice's own (SSML 1.0).
    if names is VOLUMES and not sign:
        return digits / 100
    return digits if names is RATES and not sign else 1.0


def _bounded(value: float, least: float, most: float) -> float:
    return min(most, max(least, value))
