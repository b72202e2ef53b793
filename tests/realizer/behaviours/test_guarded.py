"""Behaviours of plug-ins that fail."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from bml_schema.behaviours import FaceLexeme
from realizer.behaviours.guarded import guarded
from realizer.behaviours.kind import Fault
from realizer.behaviours.registry import KINDS
from realizer.playback.player import Player

KIND = KINDS[FaceLexeme.tag]
SMILE = FaceLexeme(id="f", lexeme="SMILE")


def fail(*_: Any) -> Any:
    raise ValueError("boom")


def checked(**changed: Any) -> tuple[Fault, ...]:
    return guarded(replace(KIND, **changed), "sneer").check(SMILE, Player().context)


def test_guarded_behaviour_that_works_has_no_faults() -> None:
    assert checked() == ()


@pytest.mark.parametrize("name", ["check", "timing", "claims", "expand"])
def test_guarded_behaviour_that_fails_is_one_fault(name) -> None:
    (fault,) = checked(**{name: fail})
    assert (fault.type, fault.fatal) == ("CANNOT_CREATE_BEHAVIOR", True)
    assert fault.text == "the plug-in sneer failed: ValueError: boom"


def test_guarded_behaviour_keeps_its_own_faults() -> None:
    own = Fault("NO_SUCH_TARGET", "nobody there", fatal=False)
    assert checked(check=lambda node, context: (own,)) == (own,)


def test_guarded_behaviour_that_fails_later_does_not_move_and_is_logged_once(caplog) -> None:
    kind = guarded(replace(KIND, expand=fail), "later")
    for _ in range(2):
        assert kind.expand(SMILE, None, None) == ()
    assert [record.getMessage() for record in caplog.records] == [
        "the plug-in later failed: ValueError: boom"
    ]
