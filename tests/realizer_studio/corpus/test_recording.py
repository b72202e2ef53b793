"""Tests of `realizer_studio.corpus.recording`."""

from pathlib import Path

import numpy as np
import pytest

from realizer_studio.corpus.recording import (
    Annotation,
    CorpusError,
    Recording,
    Segment,
    change,
    read_annotations,
    read_corpus,
    read_faps,
    read_recording,
    write_recording,
)

FAPS = np.round(np.random.default_rng(0).normal(0, 100, (10, 68)), 2)
POINTS = np.random.default_rng(1).normal(0, 1, (10, 2, 3)).astype(np.float32).astype(float)


def full() -> Recording:
    return Recording(
        "anna",
        {"person": "anna", "mood": 'so "so"', "fps": 25.0, "frames": 12},
        (Annotation(0.04, 0.2, "anger", "eva"), Annotation(0.2, 0.4, "grief", "otto")),
        (Annotation(0.0, 0.16, "hm", "anna"), Annotation(0.2, 0.28, "ja", "bob")),
        FAPS,
        (("4.1", "4.2"), POINTS),
    )


def test_write_recording_is_read_back(tmp_path: Path) -> None:
    write_recording(tmp_path / "anna", full())
    back = read_recording(tmp_path / "anna")
    assert (back.meta, back.labels, back.words) == (full().meta, full().labels, full().words)
    assert np.allclose(back.faps, FAPS)
    assert back.points is not None
    assert np.allclose(back.points[1], POINTS)
    assert back.frames == 12


def test_segments_are_frames_of_one_annotator() -> None:
    assert full().segments() == [Segment(1, 4, "anger", "eva")]
    assert full().segments("otto") == [Segment(5, 9, "grief", "otto")]
    assert len(full().segments()[0]) == 4
    assert full().segments()[0].annotation(25.0) == full().labels[0]
    assert [word.by for word in full().spoken] == ["subject", "other"]


def test_read_corpus_returns_recordings_by_name(tmp_path: Path) -> None:
    (tmp_path / "corpus.toml").write_text("version = 1\n")
    for name in ("b", "a"):
        write_recording(tmp_path / name, full())
    assert [one.name for one in read_corpus(tmp_path)] == ["a", "b"]


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("meta.toml", None, r"anna: wanted meta\.toml, got none; it is half written: add it, or track"),
        ("meta.toml", "fps = ", r"meta\.toml: wanted .*; add it again"),
        ("meta.toml", "fps = 0", r"meta\.toml: .*fps up to 1000"),
        ("meta.toml", "fps = 'x'", r"meta\.toml: wanted"),
        ("meta.toml", "mod = 'sad'", r"meta\.toml: .*mod is none of person, mood"),
        ("labels.csv", "a,b\n", r"labels\.csv: .*columns a,b, not start,end,expression,annotator"),
        ("labels.csv", "start,end,expression,annotator\n2,1,x,y\n", r"labels\.csv: .*line 2: .*later end"),
        ("words.csv", "start,end,word,speaker\n1,nan,x,y\n", r"words\.csv: .*line 2"),
        ("faps.csv", "time\n1\n", r"faps\.csv: .*no columns named as FAPs"),
        ("faps.csv", "time,open_jaw\n0,nan\n", r"faps\.csv: .*not finite"),
        ("faps.csv", "time,open_jaw\n0\n", r"faps\.csv: wanted"),
        ("points.npz", "no archive", r"points\.npz: wanted .*add it again"),
    ],
)
def test_read_recording_names_a_damaged_file(
    tmp_path: Path, name: str, content: str | None, said: str
) -> None:
    write_recording(tmp_path / "anna", full())
    path = tmp_path / "anna" / name
    if content is None:
        path.unlink()
    else:
        path.write_text(content)
    with pytest.raises(CorpusError, match=said):
        read_recording(tmp_path / "anna")


def test_read_corpus_refuses_other_folders(tmp_path: Path) -> None:
    with pytest.raises(CorpusError, match=r"wanted a corpus, got no corpus\.toml"):
        read_corpus(tmp_path)
    (tmp_path / "corpus.toml").write_text("")
    with pytest.raises(CorpusError, match="wanted a recording or more, got none"):
        read_corpus(tmp_path)


def test_read_faps_measures_the_rate() -> None:
    values, fps = read_faps("time,open_jaw\n0,5\n0.02,6\n0.04,7\n")
    assert (fps, values[:, 2].tolist()) == (50.0, [5, 6, 7])


def test_read_annotations_keeps_quoted_text() -> None:
    text = 'start,end,word,speaker\n0,1,"so, so",bob\n'
    assert read_annotations(text) == (Annotation(0.0, 1.0, "so, so", "bob"),)


KNOWN = Recording("one", {}, (Annotation(1, 2, "anger", "eva"),), faps=np.zeros((100, 68)))


def test_change_adds_and_removes_segments_in_order() -> None:
    added = change(KNOWN, "eva", [(3, 3.5, "grief"), (0, 0.5, "anger")])
    assert [(one.start, one.text) for one in added.labels] == [(0, "anger"), (1, "anger"), (3, "grief")]
    gone = change(added, "eva", removed=[(1.01, 1.99, "anger")])
    assert [one.start for one in gone.labels] == [0, 3]
    assert change(KNOWN, "bob", [(1, 2, "anger")]).annotators == ["bob", "eva"]
    assert len(change(KNOWN, "eva", [(1.5, 3, "anger")], [(1, 2, "anger")]).labels) == 1


@pytest.mark.parametrize(
    ("added", "removed", "said"),
    [
        ([(2.5, 2, "anger")], [], "one: a text, a start and a later end"),
        ([(float("nan"), 2, "anger")], [], "a later end"),
        ([(1, 2, " ")], [], "a text"),
        ([(3, 4.2, "anger")], [], "wanted an end up to 4 s, got 4.2"),
        ([(1.5, 3, "anger")], [], "beside that of 1 to 2, got 1.5 to 3; remove that one first"),
        ([], [(5, 6, "anger")], "to remove, got 5 to 6; there are 1 to 2"),
        ([], [(1, 2, "grief")], "there are none"),
    ],
)
def test_change_says_what_is_wrong(
    added: list[tuple[float, float, str]], removed: list[tuple[float, float, str]], said: str
) -> None:
    with pytest.raises(CorpusError, match=said):
        change(KNOWN, "eva", added, removed)
