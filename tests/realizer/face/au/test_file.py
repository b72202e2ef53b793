"""Tests of the files of models of action units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.au.file import read_model
from realizer.face.load import load_face
from realizer_studio.faces.au.model_file import write_model
from tests.shipped import FACES, FOLDERS


@pytest.mark.parametrize("form", ["published", "extended"])
@pytest.mark.parametrize("name", FACES)
def test_read_model_returns_what_write_model_wrote(name: str, form: str, tmp_path: Path) -> None:
    model = read_model(FOLDERS[name] / f"au_{form}.toml")
    write_model(tmp_path / "model.toml", model)
    again = read_model(tmp_path / "model.toml")
    face = load_face()
    skin = face.vertices[slice(*face.parts["skin"])][::5].astype(np.float64)
    for au in model.units:
        assert again.displacement(au, skin) == pytest.approx(model.displacement(au, skin), abs=3e-5)
    assert again.head.density(skin) == pytest.approx(model.head.density(skin), abs=1e-4)
    assert again.degrees == model.degrees


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("{ eta = ", "{ height = ", "eta: wanted a number"),
        ("A1 = [", 'A1 = ["x", ', "A1: wanted a list of 6 numbers"),
        ("[mouth]", "[maw]", r"wanted a table \[mouth\]"),
        ("# licence:", "# ", "licence"),
        ("B = [", "B = [-9e9, ", "B: wanted"),
        ("[AU12]", "[AUx]", "such as AU12"),
        ("gaussians = [", "bells = [", "gaussians: wanted a list"),
        ("tilt = ", "tilt = nan #", "neck.tilt: wanted a number"),
    ],
)
def test_read_model_names_the_place_of_a_fault(old: str, new: str, words: str, tmp_path: Path) -> None:
    text = (FOLDERS[load_face().name] / "au_published.toml").read_text()
    assert old in text
    path = tmp_path / "broken.toml"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(FaceError, match=words):
        read_model(path)
    with pytest.raises(FaceError, match=r"none\.toml"):
        read_model(tmp_path / "none.toml")
