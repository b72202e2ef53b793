"""Tests of the mapping that applies to a face: the table, the face's file, the user's file."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from realizer.animation.fap.conversion import FapMapping, standard
from realizer.core.errors import FaceError, TableError
from realizer.core.settings import Settings, SettingsError
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import folder_of, input_names
from realizer.offline import realize
from realizer.server.session.session import Session
from realizer_studio.faces.check import check_face


@pytest.fixture
def own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of a face named "own"."""
    folder = tmp_path / "own"
    folder.mkdir()
    shutil.copy(folder_of("default") / "face.toml", folder)
    monkeypatch.setenv("REALIZER_FACES", str(tmp_path))
    return folder


def most(mapping: FapMapping, au: int, fap: int) -> list[float]:
    return [row.fap_to for row in mapping.rows if (row.au, row.fap) == (au, fap)]


def test_mapping_of_a_face_without_a_file_is_the_table() -> None:
    assert mapping_of("default").rows == standard().rows
    assert mapping_of("default") is mapping_of("default")


@pytest.mark.parametrize("form", ["txt", "csv"])
def test_mapping_of_prefers_the_user_s_file_then_the_face_s(own: Path, form: str) -> None:
    if form == "txt":
        words = "26\n3 0 1 0 111\n27\n3 0 1 0 222\n"
    else:
        words = "# source: x\n# units: x\n# licence: x\nau,side,fap,au_from,au_to,fap_from,fap_to\n"
        words += "26,,3,0,1,0,111\n27,,3,0,1,0,222\n"
    (own / f"au_to_fap.{form}").write_text(words, "utf-8")
    (own / "mine").write_text("27\n3 0 1 0 333\n", "utf-8")
    assert (most(mapping_of("own"), 26, 3), most(mapping_of("own"), 27, 3)) == ([111], [222])
    both = mapping_of("own", own / "mine")
    assert (most(both, 26, 3), most(both, 27, 3)) == ([111], [333])
    assert both.sources == ("au_to_fap.csv", str(own / f"au_to_fap.{form}"), str(own / "mine"))


def test_mapping_of_refuses_two_files(own: Path) -> None:
    for form in ("txt", "csv"):
        (own / f"au_to_fap.{form}").write_text("26\n", "utf-8")
    with pytest.raises(FaceError, match=r"own: wanted one of au_to_fap.txt and au_to_fap.csv, got both"):
        mapping_of("own")


def test_mapping_of_names_the_line_of_a_fault(own: Path) -> None:
    (own / "au_to_fap.txt").write_text("26\n3 0 1 0 jaw\n", "utf-8")
    with pytest.raises(FaceError, match=r"own/au_to_fap.txt, line 2: FAP-end"):
        mapping_of("own")
    assert any("own/au_to_fap.txt, line 2: FAP-end" in fault for fault in check_face("own"))
    with pytest.raises(TableError, match=r"own/au_to_fap.txt, line 2: FAP-end"):
        mapping_of("default", own / "au_to_fap.txt")


def test_mapping_of_refuses_an_unknown_face() -> None:
    with pytest.raises(FaceError, match=r"face: wanted one of .* got 'nobody'"):
        mapping_of("nobody")


SMILE = '<bml id="b"><faceLexeme id="s" lexeme="RAISE_MOUTH_CORNERS" amount="1" start="0" end="2"/></bml>'


def test_mapping_of_a_user_reaches_what_is_realized(tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("12\n61 0 1 0 50\n62 0 1 0 50\n", "utf-8")
    plain = realize(SMILE, idle=False, voice="silent")
    mine = realize(SMILE, idle=False, voice="silent", mapping=tmp_path / "mine.txt")
    assert plain.faps.values[:, 11].max() > 0 == plain.faps.values[:, 60].max()
    assert mine.faps.values[:, 60].max() == pytest.approx(50)
    assert not mine.faps.values[:, 11].any()
    names = list(input_names("default"))
    assert mine.poses[:, names.index("stretch_l_nose")].max() == pytest.approx(50)


def test_mapping_of_a_user_reaches_every_character_of_a_session(own: Path) -> None:
    (own / "au_to_fap.txt").write_text("26\n3 0 1 0 111\n", "utf-8")
    (own / "mine.txt").write_text("27\n3 0 1 0 333\n", "utf-8")
    session = Session("s", Settings(mapping=own / "mine.txt"), 0.0)
    assert (most(session.faces.mapping(0), 26, 3), most(session.faces.mapping(0), 27, 3)) != ([111], [333])
    session.faces.assigned[0] = "own"
    assert (most(session.faces.mapping(0), 26, 3), most(session.faces.mapping(0), 27, 3)) == ([111], [333])


def test_mapping_setting_needs_an_existing_file() -> None:
    with pytest.raises(SettingsError, match="mapping: wanted an existing file"):
        Settings.read({}, environment={"REALIZER_MAPPING": "nowhere.txt"})
