"""Finding documents, and their names."""

from __future__ import annotations

from pathlib import Path

import pytest

from realizer.batch.documents import DocumentsError, find


def names(*places: object) -> list[str]:
    return [document.name for document in find(map(str, places))]


def test_find_names_the_documents_of_a_folder_by_their_path_in_it(talks: Path) -> None:
    assert names(talks) == ["0", "1", "2", "3", "broken", "more/said"]


def test_find_names_documents_of_a_pattern_from_where_it_begins(talks: Path) -> None:
    assert names(talks / "**" / "*.xml") == ["more/said"]
    assert names(talks / "mo*" / "*") == ["more/said"]


def test_find_names_a_file_from_the_current_folder(talks: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(talks)
    assert names("more/said.xml", talks / "0.bml") == ["0", "more/said"]


def test_find_names_a_file_of_another_folder_by_its_last_part(talks: Path) -> None:
    assert names(talks / "more" / "said.xml") == ["said"]


def test_find_returns_a_document_of_two_places_once(talks: Path) -> None:
    assert names(talks, talks / "*.bml") == names(talks)


def test_find_refuses_two_documents_of_one_name(talks: Path) -> None:
    (talks / "0.xml").write_text("<bml/>")
    with pytest.raises(DocumentsError, match=r"0\.xml: wanted documents with different names, but .*0\.bml"):
        find([str(talks)])


@pytest.mark.parametrize("place", ["nowhere", "no*where", "empty"])
def test_find_refuses_a_place_without_documents(place: str, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(DocumentsError, match="wanted a document, a folder or a pattern"):
        find([str(tmp_path / place)])


def test_find_refuses_an_empty_place_among_documents(talks: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(talks)  # an empty path is the current folder otherwise
    with pytest.raises(DocumentsError, match=r"'': wanted a document, a folder or a pattern"):
        find([""])
