"""Tests of `realizer.server.session.ticker`."""

from __future__ import annotations

import pytest

from tests.realizer.server.conftest import NOD

CALM = """<bml id="{id}" composition="REPLACE"><head id="n" lexeme="NOD" start="0.3"/>
<faceLexeme id="f" lexeme="SMILE" start="n:stroke" end="1.1"/><gaze id="g" target="cup" end="0.9"/></bml>"""


def test_next_due_wakes_a_session_at_every_event(drive) -> None:
    def play(step: float | None) -> list[str | bytes]:
        driver = drive()
        for message in (
            {"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}},
            {"type": "subscribe", "stream": "fap", "fps": 30},
            {"type": "subscribe", "stream": "au", "fps": 12.5, "encoding": "json"},
        ):
            driver.send(message)
        for k, at in enumerate((0.2, 0.9, 4.0)):
            while step is not None and driver.now + step < at:
                driver.run(driver.now + step)
                driver.session.tick(driver.opened + driver.now)
                driver.collect()
            driver.run(at)
            driver.send(CALM.format(id=f"b{k}"))
        driver.run(9.0)
        return driver.clients[1].messages

    assert play(None) == play(0.007)


def test_next_due_is_at_once_while_documents_wait(driver) -> None:
    assert driver.session.next_due() == float("inf")
    driver.session.receive(1, NOD.format("b"), driver.opened)
    assert driver.session.has_documents
    driver.run(0.0)
    assert not driver.session.has_documents
    assert driver.opened < driver.session.next_due() < driver.opened + 1.0


def test_tick_sends_frames_while_documents_wait(driver) -> None:
    driver.send({"type": "subscribe", "stream": "fap", "fps": 25})
    now = driver.opened
    for k in range(3):
        driver.session.receive(1, CALM.format(id=f"b{k}"), now)
    driver.collect()
    assert driver.session.has_documents
    for frame in range(1, 6):
        assert driver.session.next_due() == pytest.approx(now + frame / 25)
        driver.session.tick(now + frame / 25, read_documents=False)
        driver.collect()
    assert [frame.frame for frame in driver.clients[1].frames] == list(range(6))
    assert driver.session.has_documents
    driver.run(0.3)
    assert not driver.session.has_documents
    assert driver.clients[1].ids[-1] != "prediction"
    assert {"b0:end", "b1:end", "b2:start"} <= set(driver.clients[1].ids)


def test_send_ready_sends_feedback_and_frames_until_a_document_comes(driver) -> None:
    driver.send({"type": "subscribe", "stream": "fap", "fps": 25, "ahead": 0.2})
    client = driver.send(NOD.format("b"))
    driver.run(0.1)
    known, frames, due = len(client.ids), len(client.frames), 0.1
    while due < 2.0:
        due = driver.session.ticker.send_ready(due)
        driver.collect()
    assert {"b:n:stroke", "b:end"} <= set(client.ids[known:])
    assert len(client.frames) > frames + 10
    driver.session.receive(1, NOD.format("c"), driver.opened + 2.0)
    assert driver.session.next_due() > driver.opened + 2.0
    assert driver.session.ticker.send_ready(2.0) is None
