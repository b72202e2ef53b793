"""A worker: the bytes of `realize`, and a row for each outcome."""

import hashlib
import os
import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from realizer.offline import realize
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.speech.engine_voice import EngineVoice
from realizer_studio.batch.task import Options, Task
from realizer_studio.batch.worker import Worker, perform


@pytest.fixture
def worker(options: Options) -> Iterator[Worker]:
    worker = Worker(options)
    yield worker
    worker.close()


def test_worker_gives_the_bytes_of_a_single_realization(
    worker: Worker, tasks: list[Task], tmp_path: Path
) -> None:
    for task in tasks:
        outcome = worker.perform(task)
        for suffix, output in outcome.row["outputs"].items():
            path = tmp_path / f"alone{suffix}"
            OUTPUTS[suffix].write(realize(task.text, voice="silent"), path, RenderSettings())
            content = outcome.files[output["file"]]
            assert content == path.read_bytes()
            assert output["bytes"] == len(content)
            assert output["sha256"] == hashlib.sha256(content).hexdigest()


def test_worker_row_has_the_result(worker: Worker, tasks: list[Task]) -> None:
    rows = {task.name: worker.perform(task).row for task in tasks}
    assert {name: row["status"] for name, row in rows.items()} == {
        **dict.fromkeys(["0", "1", "2", "3", "said"], "done"),
        "broken": "refused",
    }
    assert "not well-formed" in rows["broken"]["warnings"][0]["text"]
    assert rows["broken"]["outputs"] == {}
    assert rows["0"]["frames"] == int(rows["0"]["duration"] * 25) + 1
    assert set(rows["0"]["outputs"]) == {".fap", ".vtt"}
    assert rows["0"]["dropped"] == []


def test_worker_row_names_dropped_behaviours(worker: Worker, tasks: list[Task]) -> None:
    text = b'<bml id="b"><head id="n" lexeme="NOD"/><faceLexeme id="f" lexeme="NOPE"/></bml>'
    row = worker.perform(replace(tasks[0], text=text)).row
    assert (row["status"], row["dropped"]) == ("done", ["b:f"])


@pytest.mark.parametrize("text", [b"", b"\xef\xbb\xbf", b"<!-- later -->", b"<bml/>"])
def test_worker_writes_nothing_if_no_block_was_accepted(
    text: bytes, worker: Worker, tasks: list[Task]
) -> None:
    outcome = worker.perform(replace(tasks[0], text=text))
    assert (outcome.row["status"], outcome.row["outputs"], outcome.files) == ("refused", {}, {})


def test_worker_row_has_the_error_of_a_document_that_cannot_be_played(
    tasks: list[Task], options: Options
) -> None:
    outcome = Worker(replace(options, face="nobody")).perform(tasks[0])
    assert outcome.row["status"] == "failed"
    assert "nobody" in outcome.row["error"]
    assert not outcome.files


@pytest.mark.espeak
def test_worker_survives_a_voice_that_is_killed_between_documents(
    tasks: list[Task], options: Options
) -> None:
    spoken = replace(options, voice="espeak", formats=(".wav",))
    said = next(task for task in tasks if task.name == "said")
    worker = Worker(spoken)
    try:
        first = worker.perform(said)
        assert any(first.files["said.wav"][44:])
        another = replace(said, text=said.text.replace(b"hello", b"goodbye"))
        voice = worker._speaker._voice
        assert isinstance(voice, EngineVoice)
        os.kill(voice.pid or 0, signal.SIGKILL)
        undisturbed = Worker(spoken)
        assert worker.perform(another) == undisturbed.perform(another)
        undisturbed.close()
    finally:
        worker.close()


def drawing_pids(worker: Worker) -> list[int]:
    return [renderer.pid for renderer in worker._renderers.values() if renderer.pid is not None]


@pytest.mark.gl("onboard")
@pytest.mark.long
@pytest.mark.slow
def test_worker_keeps_renderers_that_draw_the_same_in_any_order(
    tasks: list[Task], options: Options, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("av")
    monkeypatch.setenv("REALIZER_DRAW", "onboard")
    drawn = replace(options, formats=(".mp4",), size=(64, 64))
    forwards, backwards = Worker(drawn), Worker(drawn)
    try:
        first = [forwards.perform(tasks[0])]
        drawing = drawing_pids(forwards)
        first.append(forwards.perform(tasks[1]))
        assert drawing_pids(forwards) == drawing != []
        assert [backwards.perform(task) for task in reversed(tasks[:2])] == first[::-1]
    finally:
        forwards.close()
        backwards.close()


def test_perform_refuses_a_task_of_another_program_or_table(tasks: list[Task], options: Options) -> None:
    assert perform(options, tasks[0]).row["status"] == "done"
    outcome = perform(options, replace(tasks[0], fingerprint="0" * 64))
    assert outcome.row["status"] == "failed"
    assert "wanted 000000000000; install the same there" in outcome.row["error"]
