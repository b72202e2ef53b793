"""The answers to the tab Label."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer.core.settings import Settings
from realizer_studio.corpus.recording import Annotation, Recording, read_recording, write_recording
from realizer_studio.editors.labelling import Labelling

EVA = Annotation(0.2, 0.6, "smile", "eva")


@pytest.fixture
def corpus(tmp_path: Path) -> Path:
    (tmp_path / "corpus.toml").write_text("version = 1\n")
    points = ("a", "b"), np.arange(60.0).reshape(10, 2, 3)
    write_recording(tmp_path / "anna", Recording("anna", {"fps": 10.0}, (EVA,), (), points=points))
    return tmp_path


def asked(page: Labelling, **question: Any) -> dict[str, Any]:
    answer = page.answer(json.dumps({"id": 7, **question}))
    if isinstance(answer, bytes):
        length = int.from_bytes(answer[:4], "little")
        found: dict[str, Any] = json.loads(answer[4 : 4 + length])
        kind, count, start = found["arrays"]["points"]
        return found | {"data": np.frombuffer(answer, f"<{kind}", count, start)}
    return json.loads(answer)  # type: ignore[no-any-return]


def saved(corpus: Path) -> list[tuple[str, float, float, str]]:
    return [(one.by, one.start, one.end, one.text) for one in read_recording(corpus / "anna").labels]


def test_labelling_lists_recordings_and_says_which_is_half_written(corpus: Path) -> None:
    (corpus / "ben").mkdir()
    (corpus / "ben" / "labels.csv").write_text("start,end,expression,annotator\n")
    anna, ben = asked(Labelling(Settings(corpus=corpus), True), type="list")["recordings"]
    assert anna == {"name": "anna", "annotators": ["eva"], "names": ["smile"]}
    assert ben["error"].startswith("ben: wanted meta.toml, got none")


def test_labelling_opens_a_recording_with_its_points(corpus: Path) -> None:
    found = asked(Labelling(Settings(corpus=corpus), True), type="open", recording="anna")
    assert (found["fps"], found["frames"], found["points"]) == (10, 10, 2)
    assert found["annotators"] == {"eva": [[0.2, 0.6, "smile"]]}
    assert found["data"].reshape(10, 2, 2)[1].tolist() == [[6, 7], [9, 10]]


def test_labelling_opens_the_film_of_a_recording(corpus: Path) -> None:
    (corpus / "anna" / "film.webm").write_bytes(b"a film")
    answer = Labelling(Settings(corpus=corpus), True).answer('{"type": "open", "recording": "anna"}')
    assert isinstance(answer, bytes)
    assert b'"media": "video/webm"' in answer
    assert answer.rstrip(b"\0").endswith(b"a film")


def test_labelling_saves_the_labels_of_one_annotator_only(corpus: Path) -> None:
    page = Labelling(Settings(corpus=corpus), True)
    none = asked(page, type="open", recording="anna")["none"]
    question = {"type": "save", "recording": "anna", "annotator": "tom", "labels": [[0.1, 0.4, "doubt"]]}
    answer = asked(page, **question, version=none)
    assert saved(corpus) == [("tom", 0.1, 0.4, "doubt"), ("eva", 0.2, 0.6, "smile")]
    assert asked(page, **question | {"labels": []}, version=answer["version"])["labels"] == []
    assert saved(corpus) == [("eva", 0.2, 0.6, "smile")]


def test_labelling_replaces_no_labels_that_somebody_else_saved(corpus: Path) -> None:
    page = Labelling(Settings(corpus=corpus), True)
    question = {"type": "save", "recording": "anna", "annotator": "eva", "labels": []}
    refused = asked(page, **question, version="an old one")
    assert "were changed since you opened them" in refused["error"]
    assert saved(corpus) == [("eva", 0.2, 0.6, "smile")]
    assert "error" not in asked(page, **question, version=refused["conflict"])
    assert saved(corpus) == []


def test_labelling_compares_labels_that_are_not_saved(corpus: Path) -> None:
    question = {"type": "compare", "recording": "anna", "annotator": "tom", "other": "eva"}
    page = Labelling(Settings(corpus=corpus), False)
    assert asked(page, **question, labels=[[0.2, 0.6, "smile"]])["agreement"] == [["all", 1], ["smile", 1]]
    assert asked(page, **question, labels=[])["agreement"] == []


@pytest.mark.parametrize(
    ("question", "words"),
    [
        ({"type": "paint"}, "type: wanted one of list, open, compare, save, got 'paint'"),
        ({"type": "open", "recording": "../x"}, "recording: wanted one of anna, got '../x'"),
        ({"type": "save", "recording": "anna", "labels": []}, "annotator: wanted a name"),
        ({"annotator": "a", "labels": [[1]]}, "labels: wanted a list of [start, end, expression]"),
        ({"annotator": "a", "labels": [[0.0, float("nan"), "x"]]}, "a text, a start and a later end"),
        ({"annotator": "a", "labels": [[0, 9, "x"]]}, "anna: wanted an end up to 1 s, got 9"),
        ({"annotator": "a", "labels": [[0, 1, "x"], [0.5, 1, "x"]]}, "wanted a segment beside that"),
    ],
)
def test_labelling_says_what_a_question_lacks(corpus: Path, question: dict[str, Any], words: str) -> None:
    page = Labelling(Settings(corpus=corpus), True)
    assert words in asked(page, **{"type": "save", "recording": "anna"} | question)["error"]
    assert saved(corpus) == [("eva", 0.2, 0.6, "smile")]


def test_labelling_without_a_corpus_or_a_token_says_so(corpus: Path) -> None:
    assert "--corpus DIR" in asked(Labelling(Settings(corpus=None), True), type="list")["error"]
    question = {"type": "save", "recording": "anna", "annotator": "eva", "labels": []}
    assert (
        "your token does not allow" in asked(Labelling(Settings(corpus=corpus), False), **question)["error"]
    )


def test_labelling_keeps_the_labels_when_the_folder_takes_none(corpus: Path) -> None:
    (corpus / "anna" / ".lock").mkdir()  # what refuses root, too
    page = Labelling(Settings(corpus=corpus), True)
    version = asked(page, type="open", recording="anna")["versions"]["eva"]
    question = {"type": "save", "recording": "anna", "annotator": "eva", "labels": [], "version": version}
    assert "labels.csv: cannot be saved" in asked(page, **question)["error"]
    assert saved(corpus) == [("eva", 0.2, 0.6, "smile")]
