"""Tests of the registry of behaviours, and of all behaviours by it."""

import subprocess
import sys
import textwrap
from dataclasses import replace
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import VOCABULARY as CORE
from bml_schema.behaviours import FaceLexeme
from bml_schema.node_schema import local
from realizer import behaviours
from realizer.animation.channel import Layer
from realizer.animation.curves import sample
from realizer.behaviours.kind import BehaviourKind, Fault
from realizer.behaviours.registry import ELEMENTS as FAMILY_ELEMENTS
from realizer.behaviours.registry import FAMILIES, KINDS, VOCABULARY, guarded
from realizer.playback.player import Player
from tests.realizer.behaviours.elements import ELEMENTS, check, expand, keys, node, timing


def test_kinds_cover_every_core_element() -> None:
    # Other behaviours have their class in their own module, or in a plug-in.
    assert {tag: VOCABULARY.get(tag) for tag in CORE} == dict(CORE)
    assert set(KINDS) == set(VOCABULARY)


def _is_kind(value: object) -> bool:
    return isinstance(value, BehaviourKind)


def test_families_are_all_modules_with_behaviours() -> None:
    modules = [import_module(f"{behaviours.__name__}.{m.name}") for m in iter_modules(behaviours.__path__)]
    families = {m.__name__: m.KINDS for m in modules if any(_is_kind(k) for k in getattr(m, "KINDS", ()))}
    assert families
    missing = [name for name, family in families.items() if family not in FAMILIES.values()]
    assert not missing, f"add rows to realizer/behaviours/registry.py for {', '.join(missing)}"
    elements = {name: " ".join(local(kind.tag) for kind in FAMILIES[name]) for name in FAMILY_ELEMENTS}
    assert elements == FAMILY_ELEMENTS, "name the elements of each module in realizer/behaviours/registry.py"


def test_kinds_import_a_family_on_first_use() -> None:
    code = """
        import sys
        from bml_schema import Blink, parse
        from realizer.behaviours.registry import FAMILIES, KINDS, VOCABULARY
        parse('<bml id="b"><blink id="x" xmlns="urn:bml-realizer:1"/></bml>', VOCABULARY)
        assert len(KINDS) == len(VOCABULARY) == len(list(KINDS))
        assert Blink.tag in KINDS
        assert "realizer.behaviours.face" not in sys.modules
        assert KINDS[Blink.tag].node is Blink
        assert "realizer.behaviours.face" in sys.modules
        assert "realizer.behaviours.emotion" not in sys.modules
        assert KINDS.get("x") is None
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(code)], check=True)


def test_wanted_type_exists() -> None:
    module, _, name = FAMILIES._wanted.rpartition(" ")[2].rpartition(".")
    assert getattr(import_module(module), name) is BehaviourKind


@pytest.mark.parametrize("element", ELEMENTS)
def test_kinds_have_the_sync_points_of_the_standard_and_positive_gaps(element: str) -> None:
    one, wanted = node(element), timing(element)
    assert [p for p in wanted.points if ":" not in p] == list(one.sync_points)
    assert np.all(wanted.preferred >= wanted.least)
    assert np.all(wanted.least >= 0)
    assert np.all(wanted.stiffness > 0)
    assert not check(element)


@pytest.mark.parametrize("element", ELEMENTS)
def test_kinds_expand_to_channels_that_start_at_rest_and_end_there_or_hold(element: str) -> None:
    times = keys(timing(element))
    for channel in expand(element):
        assert channel.source == "x"
        assert channel.times[0] >= times[0]
        assert channel.times[-1] == times[-1]
        assert channel.values[0] == 0
        assert channel.keeps_last == (KINDS[node(element).tag].region is not None)
        assert channel.values[-1] == 0 or channel.keeps_last
        assert (channel.layer is Layer.BASE) == channel.keeps_last


@pytest.mark.parametrize("element", ELEMENTS)
@given(gaps=st.lists(st.sampled_from([0.0, 0.001, 0.3, 5.0]), min_size=12, max_size=12))
def test_kinds_expand_any_rising_times_to_finite_keys(element: str, gaps: list[float]) -> None:
    count = len(timing(element).points)
    for channel in expand(element, np.cumsum(gaps[:count]).tolist()):
        assert np.all(np.diff(channel.times) >= 0)
        assert np.all(np.isfinite(channel.values))
        assert np.all(np.isfinite(sample([channel], np.linspace(0, 60, 100))))


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


def test_guarded_behaviour_that_fails_later_rests_and_is_logged_once(caplog) -> None:
    kind = guarded(replace(KIND, expand=fail), "later")
    for _ in range(2):
        assert kind.expand(SMILE, None, None) == ()
    assert [record.getMessage() for record in caplog.records] == [
        "the plug-in later failed: ValueError: boom"
    ]
