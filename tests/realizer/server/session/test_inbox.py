"""Tests of the messages that clients send to a session."""

from __future__ import annotations

import pytest

from bml_schema.feedback import WarningFeedback
from realizer.protocol.wire import unpack
from tests.realizer.server.conftest import NOD

FAP = {"type": "subscribe", "stream": "fap"}


def warnings(client):
    return [f for f in client.feedback if isinstance(f, WarningFeedback)]


def test_session_answers_an_invalid_binary_message_with_an_error(driver) -> None:
    client = driver.send(b"\x04\x01 sound")
    assert client.of("error")[0]["code"] == "unsupported"


def test_session_refuses_documents_while_the_service_ends(driver) -> None:
    driver.session.inbox.ending = True
    (warning,) = warnings(driver.send(NOD.format("b")))
    assert "ending" in warning.text
    assert warning.seq is None, "another service, that goes on with the session, would not count it"


@pytest.mark.parametrize("message", ["ping", "state", "stop", "unsubscribe"])
def test_receive_sends_what_is_due_before_it_handles_a_late_message(driver, message) -> None:
    driver.send(FAP | {"fps": 25})
    driver.send('<bml id="b"><wait id="w" duration="0.5"/></bml>')
    client = driver.run(0.49)
    before, driver.now = len(client.messages), 0.53  # nobody has woken it at 0.5 and at 0.52
    driver.send({"type": message, "stream": "fap"} if message == "unsubscribe" else {"type": message})
    point, end, frame = client.messages[before : before + 3]
    assert 'id="b:w:end"' in point
    assert 'status="DONE"' in end
    assert unpack(frame).frame == 13
