"""The faces that ship, as parameters of tests: all but the default one are slow, and CI leaves out most."""

from __future__ import annotations

import pytest

from realizer.face.load import list_faces, load_face

__all__ = ["DEFAULT", "FACES", "FOLDERS"]

DEFAULT = load_face().name
FOLDERS = {info.name: info.path for info in list_faces()}
ODDEST = "omar"  # beard, glasses, and the thickest lips


def _marks(name: str) -> list[pytest.MarkDecorator]:
    """Return the marks of a face: all are tested after a change of faces, two by CI."""
    if name == DEFAULT:
        return []
    return [pytest.mark.slow] if name == ODDEST else [pytest.mark.slow, pytest.mark.long]


FACES = [pytest.param(name, marks=_marks(name)) for name in FOLDERS]
