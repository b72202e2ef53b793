"""The registry of sessions: names, limits, moves and expiry."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.settings import Settings
from realizer.server.documents import limits
from realizer.server.runtime.session_registry import JoinError, SessionRegistry, Visitor, worker_of
from realizer.server.session.effects import Close
from realizer.server.session.session import Session
from realizer.server.streams.broadcast import Overload


@pytest.fixture
def registry() -> SessionRegistry:
    return limited(max_sessions=3)


def limited(**most: int) -> SessionRegistry:
    settings = Settings(keep=60.0, **most)
    return SessionRegistry(lambda id, now, named: Session(id, settings, now, named=named), settings)


def test_registry_shares_named_sessions_only(registry) -> None:
    shared = registry.open(1, "show", 0.0)
    assert registry.open(2, "show", 0.0) is shared
    assert registry.open(3, None, 0.0) is not shared
    assert registry.session_of.get(2) is shared


def test_registry_ends_an_unnamed_session_with_its_connection(registry) -> None:
    registry.open(1, None, 0.0)
    registry.leave(1, 1.0)
    assert not registry.sessions
    assert registry.session_of.get(1) is None


def test_registry_keeps_a_named_session_until_it_expires(registry) -> None:
    session = registry.open(1, "show", 0.0)
    registry.leave(1, 10.0)
    registry.remove_expired(69.0)
    assert registry.open(2, "show", 69.0) is session
    registry.leave(2, 70.0)
    registry.remove_expired(131.0)
    assert not registry.sessions


@pytest.mark.parametrize("name", ["", "a b", "x" * 65, "../etc", "é"])
def test_registry_refuses_a_bad_name(registry, name) -> None:
    with pytest.raises(JoinError, match=r"wanted 1\.\.64") as caught:
        registry.open(1, name, 0.0)
    assert caught.value.status == 400


def test_registry_opens_no_session_while_overloaded_but_lets_join() -> None:
    overload = Overload()
    registry = SessionRegistry(
        lambda id, now, named: Session(id, Settings(), now, named=named), Settings(), overload=overload
    )
    session = registry.open(1, "show", 0.0)
    overload.is_active = True
    with pytest.raises(JoinError, match="the service is overloaded") as caught:
        registry.open(2, None, 0.0)
    assert caught.value.status == 503
    assert registry.open(3, "show", 0.0) is session


def test_registry_refuses_too_many_sessions_but_not_joining(registry) -> None:
    for k in range(3):
        registry.open(k, f"s{k}", 0.0)
    with pytest.raises(JoinError) as caught:
        registry.open(9, "more", 0.0)
    assert caught.value.status == 503
    registry.open(10, "s0", 0.0)


def test_registry_replaces_the_session_abandoned_the_longest(registry) -> None:
    for k in range(3):
        registry.open(k, f"s{k}", 0.0)
    registry.leave(1, 1.0)
    registry.leave(0, 2.0)
    registry.check("more")
    registry.open(9, "more", 3.0)
    assert set(registry.sessions) == {"s0", "s2", "more"}
    registry.open(10, "s0", 3.0)
    with pytest.raises(JoinError, match="3 sessions are open"):
        registry.check("again")


def test_registry_refuses_a_hello_into_one_session_too_many(registry) -> None:
    for k in range(3):
        registry.open(k, f"s{k}", 0.0)
    here = registry.open(3, "s0", 0.0)
    here.receive(3, '{"type":"hello","session":"more"}', 0.5)
    (effect,) = registry.move_connections(here, here.take_effects(), 0.5)
    assert '"where":"hello.session"' in effect.data
    assert registry.session_of.get(3) is here


def test_registry_moves_a_connection_to_the_session_of_its_hello(registry) -> None:
    there = registry.open(1, "show", 0.0)
    here = registry.open(2, None, 0.0)
    here.receive(2, '{"type":"hello","session":"show","seen":0}', 0.5)
    effects = registry.move_connections(here, here.take_effects(), 0.5)
    assert registry.session_of.get(2) is there
    assert here.id not in registry.sessions
    assert '"session":"show"' in effects[0].data


def test_registry_sends_nothing_of_the_old_session_after_a_move(registry) -> None:
    registry.open(1, "show", 0.0)
    here = registry.open(2, "here", 0.0)
    here.receive(2, '<bml id="b"><wait id="w" duration="1"/></bml>', 0.0)
    registry.move_connections(here, here.take_effects(), 0.0)
    # Something of the old session is due in the very moment in which it goes.
    here.receive(2, '{"type":"hello","session":"show"}', 0.0)
    effects = registry.move_connections(here, here.take_effects(), 0.0)
    welcome = next(n for n, effect in enumerate(effects) if '"session":"show"' in effect.data)
    assert [effect.data for effect in effects[welcome + 1 :]] == []
    assert here.feedback_log.newest > 0


def test_registry_closes_a_connection_whose_new_session_cannot_be_stored() -> None:
    settings = Settings()

    def make(id: str, now: float, named: bool) -> Session:
        if id == "show":
            raise JoinError(503, "the journal has no room")
        return Session(id, settings, now, named=named)

    registry = SessionRegistry(make, settings)
    here = registry.open(1, "here", 0.0)
    here.receive(1, '{"type":"hello","session":"show"}', 0.5)
    assert registry.move_connections(here, here.take_effects(), 0.5) == [
        Close(1, 1013, "the journal has no room")
    ]
    assert registry.session_of.get(1) is None


HERE, THERE = Visitor("10.0.0.1"), Visitor("10.0.0.2")


def test_registry_limits_the_sessions_of_an_address() -> None:
    registry = limited(max_address_sessions=2)
    for k in range(2):
        registry.open(k, f"s{k}", 0.0, visitor=HERE)
    for name in ("more", None):
        with pytest.raises(
            JoinError, match=r"2 sessions .* 10\.0\.0\.1 .*REALIZER_MAX_ADDRESS_SESSIONS"
        ) as caught:
            registry.check(name, HERE)
        assert caught.value.status == 429
    registry.open(5, "s0", 0.0, visitor=HERE)  # joining is not opening
    registry.open(6, "more", 0.0, visitor=THERE)
    registry.open(7, "more", 0.0, visitor=HERE)


def test_registry_replaces_only_sessions_of_the_same_address() -> None:
    registry = limited(max_address_sessions=2, max_sessions=4)
    registry.open(100, "yours", 0.0, visitor=THERE)
    registry.leave(100, 0.0)
    for k in range(50):
        registry.open(k, f"s{k}", k + 1.0, visitor=HERE)
        registry.leave(k, k + 1.5)
    assert set(registry.sessions) == {"yours", "s48", "s49"}
    registry.open(101, "yours", 60.0, visitor=THERE)
    registry.open(102, "new", 60.0, visitor=THERE)


def test_registry_does_not_count_sessions_that_have_ended() -> None:
    registry = limited(max_address_sessions=1)
    for k in range(3):
        registry.open(k, None, 0.0, visitor=HERE)
        registry.leave(k, 1.0)
    failed = registry.open(3, "show", 2.0, visitor=HERE)
    failed.close()
    registry.remove(failed)
    kept = registry.open(4, "show", 3.0, visitor=HERE)
    registry.leave(4, 4.0)
    registry.remove_expired(4.0 + 60.0)
    assert kept.closed
    registry.open(5, "show", 70.0, visitor=HERE)


def test_registry_does_not_limit_other_transports() -> None:
    registry = limited(max_address_sessions=1)
    for k in range(3):
        registry.open(k, f"s{k}", 0.0)


def test_registry_counts_a_restored_session_for_its_first_client() -> None:
    registry = limited(max_address_sessions=1)
    registry.open(1, "one", 0.0, visitor=HERE)
    registry.sessions["two"] = Session("two", Settings(), 0.0, named=True)
    with pytest.raises(JoinError, match="wanted fewer"):
        registry.check("two", HERE)
    registry.open(2, "two", 0.0, visitor=THERE)


def test_registry_counts_both_sessions_of_a_move() -> None:
    registry = limited(max_address_sessions=1)
    here = registry.open(1, None, 0.0, visitor=HERE)
    here.receive(1, '{"type":"hello","session":"show"}', 0.5)
    registry.move_connections(here, here.take_effects(), 0.5)
    there = registry.session_of.get(1)
    assert there is not None
    assert there.id == "show"
    there.receive(1, '{"type":"hello","session":"another"}', 0.6)
    (effect,) = registry.move_connections(there, there.take_effects(), 0.6)
    assert "REALIZER_MAX_ADDRESS_SESSIONS" in effect.data


def test_registry_restricts_a_visitor_to_its_sessions() -> None:
    registry = limited()
    bound = Visitor("10.0.0.1", frozenset({"show", "stage"}))
    for name in ("other", None):
        with pytest.raises(JoinError, match=r"the token is for \(show, stage\)") as caught:
            registry.open(1, name, 0.0, visitor=bound)
        assert caught.value.status == 403
    here = registry.open(1, "show", 0.0, visitor=bound)
    here.receive(1, '{"type":"hello","session":"other"}', 0.5)
    (effect,) = registry.move_connections(here, here.take_effects(), 0.5)
    assert "hello.session" in effect.data
    assert registry.session_of.get(1) is here
    here.receive(1, '{"type":"hello","session":"stage"}', 0.5)
    registry.move_connections(here, here.take_effects(), 0.5)
    there = registry.session_of.get(1)
    assert there is not None
    assert there.id == "stage"


def test_registry_without_memory_opens_no_session_but_lets_join(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pages = tmp_path / "statm"
    monkeypatch.setattr(limits, "MEMORY", pages)
    registry = limited(max_memory=64)
    pages.write_text("2 1 0")
    registry.open(1, "show", 0.0)
    pages.write_text("2000000 1000000 0")
    registry.open(2, "show", 0.0)
    with pytest.raises(JoinError, match="REALIZER_MAX_MEMORY") as caught:
        registry.open(3, "more", 0.0)
    assert caught.value.status == 503


MOVES = st.tuples(
    st.sampled_from(["open", "leave", "hello", "sweep", "fail"]),
    st.integers(0, 7),  # connection
    st.sampled_from([None, "a", "b", "c", "d", "e"]),
    st.sampled_from(["10.0.0.1", "10.0.0.2", ""]),
)


@given(st.lists(MOVES, max_size=60))
def test_registry_never_exceeds_the_limit_of_an_address(
    moves: list[tuple[str, int, str | None, str]],
) -> None:
    registry = limited(max_sessions=4, max_address_sessions=2)
    opened: dict[Session, str] = {}
    who: dict[int, str] = {}
    for now, (move, connection, name, address) in enumerate(moves):
        session = registry.session_of.get(connection)
        if move == "open" and session is None:
            share: bool | None
            try:
                joined = registry.open(connection, name, now, visitor=Visitor(address))
                who[connection] = address
                opened.setdefault(joined, address)
            except JoinError as full:
                share = full.status == 429
            else:
                share = None
            if share is not None:
                # Only if all sessions that could make room have connections.
                mine = [s for s in registry.sessions.values() if not share or opened[s] == address]
                assert all(s.empty_since is None for s in mine)
                assert len(mine) == (2 if share else 4)
        elif move == "leave":
            registry.leave(connection, now)
        elif move == "hello" and session is not None and name is not None:
            session.receive(connection, f'{{"type":"hello","session":"{name}"}}', now)
            registry.move_connections(session, session.take_effects(), now)
            there = registry.session_of.get(connection)
            assert there is not None
            opened.setdefault(there, who[connection])
        elif move == "sweep":
            registry.remove_expired(now + 40)
        elif move == "fail" and session is not None:
            session.close()
            registry.remove(session)
        opened = {s: a for s, a in opened.items() if registry.sessions.get(s.id) is s}
        shares = Counter(opened.values())
        assert len(registry.sessions) <= 4
        assert max(shares["10.0.0.1"], shares["10.0.0.2"]) <= 2
    for connection in range(8):
        registry.leave(connection, 1000)
    registry.remove_expired(2000)
    assert not registry.sessions
    assert not registry._opened_by


def test_worker_of_is_the_first_one_for_other_transports() -> None:
    for name in ("asap-127.0.0.1", "xface-127.0.0.1", "stomp-json", "xface-player"):
        assert worker_of(name, 7, Settings()) == 0
    assert {worker_of(f"session-{k}", 7, Settings()) for k in range(100)} == set(range(7))
