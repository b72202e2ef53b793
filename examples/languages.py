"""One sentence in several languages: the times of its words and sounds, and how far the mouth opens.

  python examples/languages.py de ru pt-BR

The voice espeak speaks over 100 languages: `pip install 'bml-realizer[speech]'`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import realizer

SENTENCES = {
    "de": "Guten Tag, ich bin ein Gesicht.",
    "en": "Hello, I am a face.",
    "fr": "Bonjour, je suis un visage.",
    "ru": "Здравствуйте, я лицо.",
    "pt-BR": "Olá, eu sou um rosto.",
}


def main(*languages: str) -> None:
    for language in languages or SENTENCES:
        speech = f'<speech id="s" xml:lang="{language}"><text>{SENTENCES[language]}</text></speech>'
        r = realizer.realize(f'<bml id="b">{speech}</bml>')
        for warning in r.warnings:
            print(warning.text, file=sys.stderr)
        path = r.save(Path(f"{language}.TextGrid"))
        jaw = r.faps.values[:, 2].max() / 1024
        print(f"{path}: {r.duration:.2f} s, the jaw opens by {jaw:.2f} of the way from nose to mouth")


if __name__ == "__main__":
    main(*sys.argv[1:])
