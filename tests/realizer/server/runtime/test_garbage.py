"""Tests of `realizer.server.runtime.garbage`."""

from __future__ import annotations

import weakref

import pytest

from realizer.server.runtime import garbage
from realizer.server.runtime.garbage import ENDED, GcPolicy


class Knot:
    """Holds itself."""

    def __init__(self) -> None:
        self.itself = self


def knot() -> weakref.ref[Knot]:
    return weakref.ref(Knot())


@pytest.mark.usefixtures("no_automatic_gc")
def test_gc_policy_collects_when_as_many_have_ended_as_are_alive() -> None:
    known, tied = GcPolicy(), knot()
    for ended, alive, looked in (
        (ENDED - 1, 0, False),
        (ENDED, 300, False),
        (299, 300, False),
        (300, 300, True),
    ):
        known.ended_connections = ended
        assert tied() is not None
        assert known.collect_if_needed(alive) is looked
    assert tied() is None
    assert known.ended_connections == 0
    assert not known.collect_if_needed(0)


@pytest.mark.usefixtures("no_automatic_gc")
def test_gc_policy_collects_when_the_process_has_grown(monkeypatch: pytest.MonkeyPatch) -> None:
    used = 200e6
    monkeypatch.setattr(garbage, "memory", lambda: used)
    known, tied = GcPolicy(), knot()
    used = 390e6
    assert not known.collect_if_needed(1000)
    used = 410e6
    assert not known.collect_if_needed(1000, 1000)  # what plays needs memory too
    assert known.collect_if_needed(1000)
    assert tied() is None
    assert not known.collect_if_needed(1000)  # that is how large it is now
