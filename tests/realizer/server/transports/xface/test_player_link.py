"""The protocol of a player on a fake clock: one task after the other, and the least interval of frames."""

from __future__ import annotations

import pytest

from realizer.animation.fap.fap_reader import read_fap
from realizer.server.transports.xface.player import NUMBERS, PATIENCE, PlayerLink, State
from realizer.server.transports.xface.wire import Task, TaskReader, pack_note


def frame(**faps: int) -> list[int]:
    values = [0] * 68
    for name, value in faps.items():
        values[int(name[3:]) - 1] = value
    return values


def note(task: Task, *statuses: int) -> bytes:
    return b"".join(pack_note(task.name, task.owner, task.id, status) for status in statuses)


def due(link: PlayerLink, now: float) -> Task | None:
    """The one task that is due."""
    data = link.due(now)
    if data is None:
        return None
    (task,) = TaskReader(10_000).feed(data)
    assert isinstance(task, Task)
    assert data.endswith(b"</task>\0")
    return task


@pytest.fixture
def link() -> PlayerLink:
    """Connected, greeted as client 3, with Paul's interval."""
    link = PlayerLink(0.25)
    link.on_connect()
    link.receive(pack_note("CONNECTION_OK", 3, 0, 0))
    return link


def shown(link: PlayerLink, now: float) -> dict[int, int]:
    """Play the player: take the upload and the stop, and say that they are done."""
    upload = due(link, now)
    assert upload is not None
    assert upload.name == "UPLOAD_FAP"
    link.receive(note(upload, 1, 2, 3))
    stop = due(link, now)
    assert stop is not None
    assert (stop.name, stop.params) == ("STOP_PLAYBACK", ())
    link.receive(note(stop, 1, 3))
    clip = read_fap(upload.params[0])
    assert clip.notes == ()
    assert len(clip.values) == 1
    return {fap: int(clip.values[0, fap - 1]) for fap in range(1, 69) if clip.mask[fap - 1]}


def test_player_link_sends_nothing_before_the_greeting() -> None:
    link = PlayerLink(0.25)
    link.show(frame(fap3=100))
    assert link.due(0.0) is None
    link.on_connect()
    assert (link.state, link.due(0.0), link.next_deadline()) == (State.GREETING, None, None)
    link.receive(pack_note("CONNECTION_OK", 3, 0, 0)[:30])
    assert link.due(0.0) is None
    link.receive(pack_note("CONNECTION_OK", 3, 0, 0)[30:])
    assert due(link, 0.0) is not None


def test_player_link_sends_a_frame_as_an_upload_and_a_stop(link: PlayerLink) -> None:
    link.show(frame(fap3=500, fap48=-4000))
    upload = due(link, 0.0)
    assert upload is not None
    assert (upload.name, upload.owner, upload.id) == ("UPLOAD_FAP", 3, 3 * NUMBERS + 1)
    assert upload.params[0].startswith("2.1 realizer 25 1\n")
    assert due(link, 0.0) is None, "the player takes two tasks in one read for one"
    link.receive(note(upload, 1, 2))
    assert (due(link, 0.0), link.state) == (None, State.UPLOADING)
    link.receive(note(upload, 3))
    stop = due(link, 0.0)
    assert stop == Task("STOP_PLAYBACK", 3, 3 * NUMBERS + 2)
    link.receive(note(stop, 1))
    assert link.state is State.STOPPING
    link.receive(note(stop, 3))
    assert link.state.name == "READY"


def test_player_link_leaves_out_zeros_and_compound_faps(link: PlayerLink) -> None:
    link.show(frame(fap1=3, fap2=1, fap3=500, fap48=-4000))
    assert shown(link, 0.0) == {3: 500, 48: -4000}
    link.show(frame())
    assert shown(link, 1.0) == {}


def test_player_link_waits_for_the_interval_and_sends_the_newest(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    assert shown(link, 10.0) == {3: 1}
    link.show(frame(fap3=2))
    link.show(frame(fap3=3))
    assert due(link, 10.2) is None
    assert link.next_deadline() == 10.25
    assert shown(link, 10.25) == {3: 3}


def test_player_link_without_an_interval_waits_for_notes_only() -> None:
    link = PlayerLink(0.0)
    link.on_connect()
    link.receive(pack_note("CONNECTION_OK", 1, 0, 0))
    for value in (1, 2, 3):
        link.show(frame(fap3=value))
        assert shown(link, 5.0) == {3: value}


def test_player_link_sends_an_unchanged_face_once(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    shown(link, 0.0)
    link.show(frame(fap3=1))
    assert (link.due(9.0), link.next_deadline()) == (None, None)


def test_player_link_goes_on_after_a_task_without_a_note(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    assert due(link, 0.0) is not None
    link.show(frame(fap3=2))
    assert link.next_deadline() == PATIENCE
    assert due(link, PATIENCE - 0.1) is None
    stop = due(link, PATIENCE)
    assert stop is not None
    assert stop.name == "STOP_PLAYBACK"
    assert link.next_deadline() == 2 * PATIENCE
    upload = due(link, 2 * PATIENCE)
    assert upload is not None
    assert upload.name == "UPLOAD_FAP"


def test_player_link_logs_a_failed_task_once_and_goes_on(
    link: PlayerLink, caplog: pytest.LogCaptureFixture
) -> None:
    for time, value in ((0.0, 1), (1.0, 2)):
        link.show(frame(fap3=value))
        upload = due(link, time)
        assert upload is not None
        link.receive(note(upload, 1, 7, 3))
        stop = due(link, time)
        assert stop is not None
        link.receive(note(stop, 1, 3))
    assert [record.getMessage() for record in caplog.records] == ["xface player: it cannot do UPLOAD_FAP"]


def test_player_link_ignores_notes_about_old_tasks(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    upload = due(link, 0.0)
    assert upload is not None
    link.receive(note(Task("UPLOAD_FAP", 3, 77), 3) + note(Task("STOP_PLAYBACK", 3, upload.id - 1), 3))
    assert link.state is State.UPLOADING


def test_player_link_begins_anew_with_a_connection(link: PlayerLink) -> None:
    link.show(frame(fap3=1))
    shown(link, 0.0)
    link.on_disconnect()
    assert (link.due(9.0), link.next_deadline()) == (None, None)
    link.on_connect()
    link.receive(pack_note("CONNECTION_OK", 8, 0, 0))
    upload = due(link, 0.1)
    assert upload is not None
    assert (upload.owner, upload.id) == (8, 8 * NUMBERS + 1)


def test_player_link_refuses_a_second_connection(link: PlayerLink) -> None:
    with pytest.raises(AssertionError, match="connected already"):
        link.on_connect()
