"""Batches: resumed, idempotent, and with the same bytes on any workers."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest

from realizer_studio.batch.process_pool import ProcessPool
from realizer_studio.batch.run import DocumentsError, batch, find
from realizer_studio.batch.task import Options, Task
from realizer_studio.batch.worker import Outcome, Worker


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


class Here:
    """A crew that does the work itself, the last document first."""

    def __init__(self, options: Options) -> None:
        self._worker = Worker(options)

    def perform(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        for task in reversed(list(tasks)):
            yield self._worker.perform(task)

    def close(self) -> None:
        self._worker.close()


def play(talks: Path, out: Path, options: Options, most: int | None = None) -> list[tuple[str, bool]]:
    """(document, whether it was known) in the order they came; at most so many, then it is interrupted."""
    rows = batch(find([str(talks)]), out, options, Here(options))
    got = [(row["document"], known) for row, known in islice(rows, most)]
    rows.close()
    return got


def contents(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


@pytest.mark.slow
def test_batch_gives_the_same_bytes_with_any_workers_in_any_order(
    talks: Path, options: Options, tmp_path: Path
) -> None:
    play(talks, tmp_path / "here", options)
    crew = ProcessPool(options, 2)
    assert len(list(batch(find([str(talks)]), tmp_path / "there", options, crew))) == 6
    assert contents(tmp_path / "here") == contents(tmp_path / "there")
    assert {"more/said.fap", "more/said.vtt", "manifest.jsonl"} <= contents(tmp_path / "here").keys()


@pytest.mark.espeak
@pytest.mark.slow
def test_batch_gives_the_same_sound_with_any_workers_in_any_order(talks: Path, tmp_path: Path) -> None:
    """The output of espeak-ng depends on earlier texts, but for the measures of our engine."""
    aloud = Options(formats=(".fap", ".wav"), voice="espeak")
    for k, words in enumerate(["Oh, hello!", "Who was that?", "Nobody at all."]):
        (talks / f"said{k}.bml").write_text(f'<bml id="b"><speech id="s"><text>{words}</text></speech></bml>')
    play(talks, tmp_path / "here", aloud)
    crew = ProcessPool(aloud, 2)
    assert len(list(batch(find([str(talks)]), tmp_path / "there", aloud, crew))) == 9
    assert contents(tmp_path / "here") == contents(tmp_path / "there")
    assert len({contents(tmp_path / "here")[f"said{k}.wav"] for k in range(3)}) == 3


def test_batch_that_was_interrupted_resumes(talks: Path, options: Options, tmp_path: Path) -> None:
    play(talks, tmp_path / "whole", options)
    assert len(play(talks, tmp_path / "cut", options, most=2)) == 2
    again = dict(play(talks, tmp_path / "cut", options))
    assert sorted(again.values()) == [False] * 4 + [True] * 2
    assert contents(tmp_path / "cut") == contents(tmp_path / "whole")


def test_batch_run_again_plays_and_changes_nothing(talks: Path, options: Options, tmp_path: Path) -> None:
    play(talks, tmp_path / "out", options)
    before = contents(tmp_path / "out")
    assert all(known for _, known in play(talks, tmp_path / "out", options))
    assert contents(tmp_path / "out") == before


def test_batch_plays_again_only_what_has_changed(talks: Path, options: Options, tmp_path: Path) -> None:
    play(talks, tmp_path / "out", options)
    (talks / "2.bml").write_text('<bml id="b2"><head id="n" lexeme="SHAKE"/></bml>')
    (tmp_path / "out" / "3.fap").write_text("scribbled over")
    played = {name for name, known in play(talks, tmp_path / "out", options) if not known}
    assert played == {"2", "3"}
    assert not any(known for _, known in play(talks, tmp_path / "out", replace(options, seed=7)))


def test_batch_has_a_row_for_a_document_that_cannot_be_read(
    talks: Path, options: Options, tmp_path: Path
) -> None:
    (talks / "gone.bml").symlink_to(tmp_path / "nowhere")
    documents = find([str(talks)])
    (talks / "2.bml").unlink()
    rows = [row for row, _ in batch(documents, tmp_path / "out", options, Here(options))]
    failed = {row["document"]: row["error"] for row in rows if row["status"] == "failed"}
    assert failed == {name: f"{talks / name}.bml: No such file or directory" for name in ("2", "gone")}
    assert len(rows) == len(documents) == 7
    (talks / "2.bml").write_text('<bml id="b"><wait id="w"/></bml>')
    again = {
        row["document"]: known for row, known in batch(documents, tmp_path / "out", options, Here(options))
    }
    assert [name for name, known in again.items() if not known] == ["2", "gone"]
