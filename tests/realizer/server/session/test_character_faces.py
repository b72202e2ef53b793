"""The faces of characters."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from realizer.core.errors import FaceError
from realizer.core.settings import Settings
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import VARIABLE, folder_of
from realizer.server.session.character_faces import CharacterFaces


@pytest.mark.parametrize("name", ["nobody", "../ada", "", "/etc"])
def test_check_names_the_known_faces_and_no_folders(name: str) -> None:
    with pytest.raises(FaceError) as error:
        CharacterFaces(Settings()).check(name)
    assert str(error.value) == f"wanted one of ada, ben, ida, leo, nia, omar, got {name!r}"


def test_name_is_that_of_the_settings_until_one_is_assigned() -> None:
    faces = CharacterFaces(Settings(face="ben"))
    assert [faces.name(0), faces.name(1)] == ["ben", "ben"]
    faces.assigned[1] = "ida"
    assert [faces.name(0), faces.name(1)] == ["ben", "ida"]
    assert [faces.of(index).name for index in (0, 1)] == ["ben", "ida"]
    assert faces.mapping(1) is mapping_of("ida")


def test_check_refuses_a_mapping_that_cannot_be_used(tmp_path: Path) -> None:
    broken = tmp_path / "mapping.csv"
    broken.write_text("nonsense")
    CharacterFaces(Settings()).check("ada")
    with pytest.raises(FaceError, match=r"^wanted a face that can be loaded, got 'ada'"):
        CharacterFaces(Settings(mapping=broken)).check("ada")


@pytest.mark.parametrize(("file", "content"), [("mesh.npz", "x"), ("au_to_fap.csv", "au,fap\n")])
def test_check_refuses_a_damaged_face_and_only_the_log_has_its_path(
    file: str,
    content: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path))
    shutil.copytree(folder_of("ada"), tmp_path / "eve")
    (tmp_path / "eve" / file).write_text(content)
    with pytest.raises(FaceError, match="got 'eve': it is damaged") as refused:
        CharacterFaces(Settings()).check("eve")
    assert str(tmp_path) not in str(refused.value)
    assert str(tmp_path / "eve") in caplog.text
