"""The faces that ship, as parameters of tests: all but the default one are slow."""

from __future__ import annotations

import pytest

from realizer.face.load import list_faces, load_face

__all__ = ["DEFAULT", "FACES", "FOLDERS"]

DEFAULT = load_face().name
FOLDERS = {info.name: info.path for info in list_faces()}
FACES = [name if name == DEFAULT else pytest.param(name, marks=pytest.mark.slow) for name in FOLDERS]
