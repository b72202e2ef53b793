"""A film of a face that speaks a text, with expressions where people show them.

python examples/film_from_text.py "Are you sure? Nonsense! It is over there." film.mp4
"""

from __future__ import annotations

import sys

import realizer


def main(text: str, path: str) -> None:
    bml = realizer.enrich(text, mood="angry")  # BML: speech with expressions, each with its reason
    film = realizer.realize(bml, face="omar", seed=1)
    for warning in film.warnings:
        print(warning.text, file=sys.stderr)
    print(film.save(path, camera="three-quarter", light="evening", size=(640, 640)))


if __name__ == "__main__":
    if len(sys.argv) <= 2:
        sys.exit(__doc__)
    main(*sys.argv[1:3])
