"""Tests of the builder of a face folder from a recipe."""

from pathlib import Path

import pytest

from realizer.core.errors import FaceError
from realizer.facebuild.person.build import build_face
from realizer.facebuild.person.makehuman import OBJ


def test_build_face_names_missing_data_and_recipes(tmp_path: Path) -> None:
    with pytest.raises(FaceError, match="wanted the unpacked wheel"):
        build_face("x", tmp_path, tmp_path / "x")
    (tmp_path / OBJ).parent.mkdir(parents=True)
    (tmp_path / OBJ).touch()
    with pytest.raises(FaceError, match=r"recipe\.toml: wanted a recipe"):
        build_face("x", tmp_path, tmp_path / "x")
