"""Fixtures that play documents offline, and files for them to name."""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from realizer.offline import realize
from realizer.realization import Realization
from realizer.speech.silent import SilentVoice

NAMESPACES = " ".join(
    (
        'xmlns:ext="http://www.bml-initiative.org/bml/coreextensions-1.0"',
        'xmlns:bmla="http://www.asap-project.org/bmla"',
        'xmlns:bmlt="http://hmi.ewi.utwente.nl/bmlt"',
        'xmlns:own="urn:bml-realizer:1"',
    )
)
FPS = 100


@dataclass(frozen=True)
class Played:
    """A played document, with access to its first block."""

    realization: Realization

    def times(self, behaviour: str) -> dict[str, float]:
        """Return sync point -> seconds."""
        return self.realization.schedules[0][behaviour]

    def aus(self, time: float) -> dict[str, float]:
        """Return AU -> 0..1 of the visible ones."""
        names = self.realization.to_json()["au"]["names"]
        values = self.realization.aus.aus[round(time * FPS)]
        return {name: round(float(v), 4) for name, v in zip(names, values, strict=True) if v > 1e-6}

    def fap(self, number: int, time: float) -> float:
        return float(self.realization.faps.values[round(time * FPS), number - 1])

    @property
    def warnings(self) -> list[tuple[str, str]]:
        return [(w.id, w.type) for w in self.realization.warnings]

    @property
    def warnings_text(self) -> str:
        """The text of the one warning."""
        (warning,) = self.realization.warnings
        return warning.text


@pytest.fixture(scope="session")
def play() -> Callable[..., Played]:
    """Return a function that plays one block with some elements, without idle motion."""

    def run(
        body: str, *, media: Path | None = None, idle: bool = False, deformer: str | None = None
    ) -> Played:
        document = f'<bml id="b" {NAMESPACES}>{body}</bml>'
        return Played(
            realize(document, deformer=deformer, fps=FPS, voice=SilentVoice(), media=media, idle=idle)
        )

    return run


def wav(data: bytes, *, rate: int = 8000, channels: int = 1, bits: int = 16, coding: int = 1) -> bytes:
    """Return a WAV file with these samples; coding 1 is integers, 3 floats."""
    block = channels * bits // 8
    form = struct.pack("<HHIIHH", coding, channels, rate, rate * block, block, bits)
    chunks = b"fmt " + struct.pack("<I", len(form)) + form + b"data" + struct.pack("<I", len(data)) + data
    return b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks


def tone(seconds: float, rate: int = 8000, loud: float = 0.5) -> np.ndarray:
    """Return (n,) float, a tone of 440 Hz."""
    return loud * np.sin(2 * np.pi * 440 * np.arange(round(seconds * rate)) / rate)


@pytest.fixture
def media(tmp_path: Path) -> Path:
    """Return a media folder with half a second of a tone, hello.wav, and a smile, smile.fap."""
    folder = tmp_path / "media"
    (folder / "sounds").mkdir(parents=True)
    (folder / "hello.wav").write_bytes(wav((tone(0.5) * 32767).astype("<i2").tobytes()))
    (folder / "sounds" / "bell.wav").write_bytes(wav((tone(0.25) * 32767).astype("<i2").tobytes()))
    mask = " ".join("1" if fap in (12, 13) else "0" for fap in range(1, 69))
    rows = [f"{mask}\n{k} {value} {value}" for k, value in enumerate((0, 100, 200, 100, 0))]
    (folder / "smile.fap").write_text("\n".join(["2.1 smile 10 5", *rows]) + "\n", "utf-8")
    return folder
