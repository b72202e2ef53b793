"""The player as one client sees it: tasks and feedback in, notes and messages to the session out."""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np
import pytest

from bml_schema import BlockProgress, WarningFeedback
from realizer.animation.fap.fap_clip import FAPClip
from realizer.core.errors import RealizerError
from realizer.server.transports.message_formats import Disconnect, Inbound
from realizer.server.transports.xface.attachments import Attachment, MissingAttachment, Script
from realizer.server.transports.xface.tasks import ABLE, UNABLE, Answer, TaskRunner
from realizer.server.transports.xface.wire import Task, read_notes


def clip(*jaw: int, fps: float = 25) -> FAPClip:
    values = np.zeros((len(jaw), 68), np.int32)
    values[:, 2] = jaw
    count = len(jaw)
    return FAPClip(
        "x", fps, values, np.arange(68) == 2, np.zeros((count, 4), np.int32), np.zeros((count, 6), np.int32)
    )


class Talk:
    """A task runner with short answers: ("NAME", id, status) for notes, text for the session."""

    def __init__(self) -> None:
        self.runner = TaskRunner(1)
        self.count = 0
        self.now = 0.0

    def ask(self, name: str, brought: Attachment = None) -> list[object]:
        self.count += 1
        task = Task(name, 1, self.count)
        return self._short([*self.runner.accept(task), *self.runner.run(task, brought, self.now)])

    def tell(self, id: str, *, warning: bool = False) -> list[object]:
        feedback = (
            WarningFeedback(id=id, type="IMPOSSIBLE_TO_SCHEDULE", text="no")
            if warning
            else BlockProgress(id=id, global_time=self.now)
        )
        return self._short(self.runner.on_feedback(feedback.to_xml(), self.now))

    def _short(self, answers: Iterable[Answer]) -> list[object]:
        out: list[object] = []
        for answer in answers:
            match answer:
                case bytes():
                    out += [(note.name, note.id, note.status) for note in read_notes(bytearray(answer))]
                case Inbound(text):
                    out.append(_short(text))
                case Disconnect():
                    out.append("leave")
        return out


def _short(text: str) -> object:
    if text.startswith("<"):
        return "document"
    message = json.loads(text)
    if message["type"] == "set":
        assert len(message["faps"]) == 66, "every FAP is held or let go of"
        return {name: value for name, value in message["faps"].items() if value is not None}
    return {"stop": message["blocks"]}


def notes(name: str, id: int, *statuses: int) -> list[object]:
    return [(name, id, status) for status in statuses]


def test_task_runner_queues_starts_and_finishes_a_file() -> None:
    assert Talk().ask("UPLOAD_FAP", clip(1, 2)) == notes("UPLOAD_FAP", 1, 1, 2, 3)


def test_task_runner_shows_a_file_of_one_frame_at_once() -> None:
    answers = Talk().ask("UPLOAD_FAP", clip(7))
    assert answers == [*notes("UPLOAD_FAP", 1, 1, 2), {"open_jaw": 7}, ("UPLOAD_FAP", 1, 3)]


def test_task_runner_sets_a_missing_fap_to_0_and_then_releases_it() -> None:
    talk = Talk()
    poses = [talk.ask("UPLOAD_FAP", clip(value))[2] for value in (7, 0, 0, 9)]
    assert poses == [{"open_jaw": 7}, {"open_jaw": 0}, {}, {"open_jaw": 9}]


def test_task_runner_limits_a_value_to_its_range() -> None:
    assert {"open_jaw": 4320} in Talk().ask("UPLOAD_FAP", clip(9999))


def test_task_runner_starts_and_finishes_playback_with_its_block() -> None:
    talk = Talk()
    talk.ask("UPLOAD_FAP", clip(1, 2))
    assert talk.ask("RESUME_PLAYBACK") == [("RESUME_PLAYBACK", 2, 1), {}, "document"]
    assert talk.tell("xface-1-1:start") == notes("RESUME_PLAYBACK", 2, 2)
    assert talk.tell("xface-1-1:end") == notes("RESUME_PLAYBACK", 2, 3)
    assert talk.tell("xface-1-1:end") == []


def test_task_runner_stop_finishes_playback_and_shows_the_first_frame() -> None:
    talk = Talk()
    talk.ask("UPLOAD_FAP", clip(1, 2))
    talk.ask("RESUME_PLAYBACK")
    talk.tell("xface-1-1:start")
    assert talk.ask("STOP_PLAYBACK") == [
        ("STOP_PLAYBACK", 3, 1),
        {"stop": ["xface-1-1"]},
        ("RESUME_PLAYBACK", 2, 3),
        {"open_jaw": 1},
        ("STOP_PLAYBACK", 3, 3),
    ]


def test_task_runner_resume_waits_for_the_end_of_playback() -> None:
    talk = Talk()
    talk.ask("UPLOAD_FAP", clip(1, 2))
    talk.ask("RESUME_PLAYBACK")
    assert talk.ask("RESUME_PLAYBACK") == notes("RESUME_PLAYBACK", 3, 1)
    talk.tell("xface-1-1:start")
    assert talk.tell("xface-1-1:end") == [("RESUME_PLAYBACK", 2, 3), {}, "document"]
    assert talk.tell("xface-1-2:start") == notes("RESUME_PLAYBACK", 3, 2)


def test_task_runner_stop_finishes_waiting_tasks() -> None:
    talk = Talk()
    talk.ask("UPLOAD_FAP", clip(1, 2))
    talk.ask("RESUME_PLAYBACK")
    talk.ask("RESUME_PLAYBACK")
    answers = talk.ask("STOP_PLAYBACK")
    assert [a for a in answers if isinstance(a, tuple) and a[2] == 3] == [
        ("RESUME_PLAYBACK", 2, 3),
        ("RESUME_PLAYBACK", 3, 3),
        ("STOP_PLAYBACK", 4, 3),
    ]


def test_task_runner_pause_keeps_the_frame_that_was_reached() -> None:
    talk = Talk()
    talk.ask("UPLOAD_FAP", clip(*range(1, 101)))
    talk.ask("RESUME_PLAYBACK")
    talk.tell("xface-1-1:start")
    talk.now = 1.0
    assert {"open_jaw": 26} in talk.ask("PAUSE_PLAYBACK")
    assert {"open_jaw": 27} in talk.ask("ADVANCE_FRAME")
    assert {"open_jaw": 1} in talk.ask("REWIND_PLAYBACK")


def test_task_runner_pause_begins_another_file_at_its_first_frame() -> None:
    talk = Talk()
    talk.ask("UPLOAD_FAP", clip(*range(1, 101)))
    talk.ask("RESUME_PLAYBACK")
    talk.tell("xface-1-1:start")
    talk.ask("UPLOAD_FAP", clip(*range(500, 600)))
    talk.now = 1.0
    assert {"open_jaw": 500} in talk.ask("PAUSE_PLAYBACK")


def test_task_runner_advance_stays_at_the_last_frame() -> None:
    talk = Talk()
    talk.ask("UPLOAD_FAP", clip(1, 2))
    answers = [talk.ask("ADVANCE_FRAME")[-1] for _ in range(3)]
    assert answers == [{"open_jaw": 2}] * 3


def test_task_runner_without_a_file_fails_to_play_but_stops() -> None:
    talk = Talk()
    assert talk.ask("RESUME_PLAYBACK") == notes("RESUME_PLAYBACK", 1, 1, 7)
    assert talk.ask("STOP_PLAYBACK") == notes("STOP_PLAYBACK", 2, 1, 3)
    assert talk.ask("ADVANCE_FRAME") == notes("ADVANCE_FRAME", 3, 1)


def test_task_runner_starts_and_finishes_a_script_with_its_blocks() -> None:
    talk = Talk()
    assert talk.ask("UPLOAD_SCRIPT", Script("<bml/>", ("a", "b"))) == [("UPLOAD_SCRIPT", 1, 1), "document"]
    assert talk.tell("a:start") == notes("UPLOAD_SCRIPT", 1, 2)
    assert talk.tell("b:start") == []
    assert talk.tell("b:end") == []
    assert talk.tell("a:end") == notes("UPLOAD_SCRIPT", 1, 3)


def test_task_runner_stop_ends_scripts_but_pause_does_not() -> None:
    talk = Talk()
    talk.ask("UPLOAD_SCRIPT", Script("<bml/>", ("a", "b")))
    talk.tell("a:start")
    talk.ask("UPLOAD_SCRIPT", Script("<bml/>", ("c",)))
    assert talk.ask("PAUSE_PLAYBACK") == notes("PAUSE_PLAYBACK", 3, 1, 3)
    assert talk.ask("STOP_PLAYBACK") == [
        ("STOP_PLAYBACK", 4, 1),
        {"stop": ["a", "b", "c"]},
        ("UPLOAD_SCRIPT", 1, 3),
        ("UPLOAD_SCRIPT", 2, 2),
        ("UPLOAD_SCRIPT", 2, 3),
        ("STOP_PLAYBACK", 4, 3),
    ]
    assert talk.tell("b:end") == []


def test_task_runner_fails_a_script_whose_blocks_are_all_refused() -> None:
    talk = Talk()
    talk.ask("UPLOAD_SCRIPT", Script("<bml/>", ("a", "b")))
    assert talk.tell("a", warning=True) == []
    assert talk.tell("b", warning=True) == notes("UPLOAD_SCRIPT", 1, 7)


@pytest.mark.parametrize(
    ("name", "brought", "statuses"),
    [
        ("UPLOAD_FAP", RealizerError("no"), (1, 7, 3)),
        ("LOAD_FAP", RealizerError("no"), (1, 7, 3)),
        ("UPLOAD_FAP", MissingAttachment("none"), (1, 7)),
        ("UPLOAD_SCRIPT", RealizerError("no"), (1, 7)),
    ],
)
def test_task_runner_answers_bad_attachments_as_clients_expect(
    name: str, brought: RealizerError, statuses: tuple[int, ...]
) -> None:
    assert Talk().ask(name, brought) == notes(name, 1, *statuses)


@pytest.mark.parametrize("name", sorted(UNABLE))
def test_task_runner_fails_tasks_of_xface_s_own_player(name: str) -> None:
    assert Talk().ask(name) == notes(name, 1, 1, 7)


def test_task_runner_answers_an_unknown_task_with_its_ids() -> None:
    talk = Talk()
    assert talk._short(talk.runner.accept(Task("DANCE", 1, 5))) == [("ERROR", 5, 7)]
    assert talk._short(talk.runner.refuse(Task("", 1, 5))) == [("ERROR", 5, 7)]
    assert talk._short(talk.runner.refuse(Task("UPLOAD_FAP", 1, 5))) == [("UPLOAD_FAP", 5, 7)]


@pytest.mark.parametrize("name", sorted(ABLE + UNABLE))
def test_task_runner_sends_no_notes_to_owner_0(name: str) -> None:
    runner, task = TaskRunner(1), Task(name, 0, 5)
    assert not [a for a in (*runner.accept(task), *runner.run(task, None, 0.0)) if isinstance(a, bytes)]


def test_task_runner_kill_app_finishes_and_disconnects() -> None:
    assert Talk().ask("KILL_APP") == [("KILL_APP", 1, 3), "leave"]
