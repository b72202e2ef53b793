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
# Level of <emphasis> -> attributes of <prosody> that stand for it in voices without emphasis; our choice.
EMPHASIS = {
    "strong": (("rate", "80%"), ("volume", "+3dB")),
    "moderate": (("rate", "90%"), ("volume", "+1.5dB")),
    "none": (),
    "reduced": (("rate", "110%"), ("volume", "-1.5dB")),
}
# Attribute -> named steps, least and greatest factor.
SCALES = {"rate": (RATES, 0.25, 4.0), "pitch": (PITCHES, 0.5, 2.0), "volume": (VOLUMES, 0.0, 4.0)}
HERTZ = re.compile(r"\s*[+-]?(\d+(?:\.\d+)?|\.\d+)\s*Hz\s*", re.IGNORECASE)
NUMBER = re.compile(r"\s*([+-]?)(\d+(?:\.\d+)?|\.\d+)\s*(%|st|dB|)\s*", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Prosody:
    """Factors on the voice's own way of speaking; 1 is no change."""

    rate: float = 1.0  # 2 is twice as fast
    pitch: float = 1.0  # 2 is an octave higher
    volume: float = 1.0  # of the amplitude; 0 is silent

    def within(self, attributes: Mapping[str, str]) -> Prosody:
        """Return the prosody of a <prosody> element inside this one; unknown values change nothing."""
        factors = {
            name: min(most, max(least, _factor(attributes.get(name, ""), steps)))
            for name, (steps, least, most) in SCALES.items()
        }
        return Prosody(**{name: getattr(self, name) * factor for name, factor in factors.items()})


PLAIN = Prosody()


def is_supported(attribute: str, value: str) -> bool:
    """Return whether the value of an attribute of <prosody> is valid; True except for rate, pitch, volume."""
    if attribute not in SCALES or value.strip() in SCALES[attribute][0] or NUMBER.fullmatch(value):
        return True
    return attribute == "pitch" and bool(HERTZ.fullmatch(value))


def _factor(text: str, steps: Mapping[str, float]) -> float:
    """Return the factor of a name, a percentage ("80%", "+10%"), semitones ("-2st") or decibels ("+6dB")."""
    number = NUMBER.fullmatch(text)
    if not number:
        return steps.get(text.strip(), 1.0)
    sign, digits, unit = number[1], float(number[2]), number[3].lower()
    signed = -digits if sign == "-" else digits
    if unit == "st":
        return float(2 ** (signed / 12))
    if unit == "db":
        return float(10 ** (signed / 20))
    if unit == "%":
        return 1.0 + signed / 100 if sign else digits / 100
    # A bare number is a factor of the rate, or a volume of 0..100, where 100 is the voice's own (SSML 1.0).
    if steps is VOLUMES and not sign:
        return digits / 100
    return digits if steps is RATES and not sign else 1.0
