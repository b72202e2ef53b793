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


@pytest.fixture
def hub() -> SessionRegistry:
    return limited(max_sessions=3)


def limited(**most: int) -> SessionRegistry:
    settings = Settings(keep=60.0, **most)
    return SessionRegistry(lambda id, now, named: Session(id, settings, now, named=named), settings)


def test_registry_shares_named_sessions_only(hub) -> None:
    shared = hub.open(1, "show", 0.0)
    assert hub.open(2, "show", 0.0) is shared
    assert hub.open(3, None, 0.0) is not shared
    assert hub.session_of(2) is shared


def test_registry_ends_an_unnamed_session_with_its_connection(hub) -> None:
    hub.open(1, None, 0.0)
    hub.leave(1, 1.0)
    assert not hub.sessions
    assert hub.session_of(1) is None


def test_registry_keeps_a_named_session_until_it_expires(hub) -> None:
    session = hub.open(1, "show", 0.0)
    hub.leave(1, 10.0)
    hub.remove_expired(69.0)
    assert hub.open(2, "show", 69.0) is session
    hub.leave(2, 70.0)
    hub.remove_expired(131.0)
    assert not hub.sessions


@pytest.mark.parametrize("name", ["", "a b", "x" * 65, "../etc", "é"])
def test_registry_refuses_a_bad_name(hub, name) -> None:
    with pytest.raises(JoinError, match=r"wanted 1\.\.64") as caught:
        hub.open(1, name, 0.0)
    assert caught.value.status == 400


def test_registry_refuses_too_many_sessions_but_not_joining(hub) -> None:
    for k in range(3):
        hub.open(k, f"s{k}", 0.0)
    with pytest.raises(JoinError) as caught:
        hub.open(9, "more", 0.0)
    assert caught.value.status == 503
    hub.open(10, "s0", 0.0)


def test_registry_replaces_the_session_abandoned_the_longest(hub) -> None:
    for k in range(3):
        hub.open(k, f"s{k}", 0.0)
    hub.leave(1, 1.0)
    hub.leave(0, 2.0)
    hub.check("more")
    hub.open(9, "more", 3.0)
    assert set(hub.sessions) == {"s0", "s2", "more"}
    hub.open(10, "s0", 3.0)
    with pytest.raises(JoinError, match="3 sessions are open"):
        hub.check("again")


def test_registry_refuses_a_hello_into_one_session_too_many(hub) -> None:
    for k in range(3):
        hub.open(k, f"s{k}", 0.0)
    here = hub.open(3, "s0", 0.0)
    here.receive(3, '{"type":"hello","session":"more"}', 0.5)
    (effect,) = hub.take_effects(here, 0.5)
    assert '"where":"hello.session"' in effect.data
    assert hub.session_of(3) is here


def test_registry_moves_a_connection_to_the_session_of_its_hello(hub) -> None:
    there = hub.open(1, "show", 0.0)
    here = hub.open(2, None, 0.0)
    here.receive(2, '{"type":"hello","session":"show","seen":0}', 0.5)
    effects = hub.take_effects(here, 0.5)
    assert hub.session_of(2) is there
    assert here.id not in hub.sessions
    assert '"session":"show"' in effects[0].data


def test_registry_sends_nothing_of_the_old_session_after_a_move(hub) -> None:
    hub.open(1, "show", 0.0)
    here = hub.open(2, "here", 0.0)
    here.receive(2, '<bml id="b"><wait id="w" duration="1"/></bml>', 0.0)
    hub.take_effects(here, 0.0)
    # Something of the old session is due in the very moment in which it goes.
    here.receive(2, '{"type":"hello","session":"show"}', 0.0)
    effects = hub.take_effects(here, 0.0)
    welcome = next(n for n, effect in enumerate(effects) if '"session":"show"' in effect.data)
    assert [effect.data for effect in effects[welcome + 1 :]] == []
    assert here.feedback_log.newest > 0


def test_registry_closes_a_connection_whose_new_session_cannot_be_stored() -> None:
    settings = Settings()

    def make(id: str, now: float, named: bool) -> Session:
        if id == "show":
            raise JoinError(503, "the journal has no room")
        return Session(id, settings, now, named=named)

    hub = SessionRegistry(make, settings)
    here = hub.open(1, "here", 0.0)
    here.receive(1, '{"type":"hello","session":"show"}', 0.5)
    assert hub.take_effects(here, 0.5) == [Close(1, 1013, "the journal has no room")]
    assert hub.session_of(1) is None


HERE, THERE = Visitor("10.0.0.1"), Visitor("10.0.0.2")


def test_registry_limits_the_sessions_of_an_address() -> None:
    hub = limited(max_address_sessions=2)
    for k in range(2):
        hub.open(k, f"s{k}", 0.0, visitor=HERE)
    for name in ("more", None):
        with pytest.raises(
            JoinError, match=r"2 sessions .* 10\.0\.0\.1 .*REALIZER_MAX_ADDRESS_SESSIONS"
        ) as caught:
            hub.check(name, HERE)
        assert caught.value.status == 429
    hub.open(5, "s0", 0.0, visitor=HERE)  # joining is not opening
    hub.open(6, "more", 0.0, visitor=THERE)
    hub.open(7, "more", 0.0, visitor=HERE)


def test_registry_replaces_only_sessions_of_the_same_address() -> None:
    hub = limited(max_address_sessions=2, max_sessions=4)
    hub.open(100, "yours", 0.0, visitor=THERE)
    hub.leave(100, 0.0)
    for k in range(50):
        hub.open(k, f"s{k}", k + 1.0, visitor=HERE)
        hub.leave(k, k + 1.5)
    assert set(hub.sessions) == {"yours", "s48", "s49"}
    hub.open(101, "yours", 60.0, visitor=THERE)
    hub.open(102, "new", 60.0, visitor=THERE)


def test_registry_does_not_count_sessions_that_have_ended() -> None:
    hub = limited(max_address_sessions=1)
    for k in range(3):
        hub.open(k, None, 0.0, visitor=HERE)
        hub.leave(k, 1.0)
    failed = hub.open(3, "show", 2.0, visitor=HERE)
    failed.close()
    hub.remove(failed)
    kept = hub.open(4, "show", 3.0, visitor=HERE)
    hub.leave(4, 4.0)
    hub.remove_expired(4.0 + 60.0)
    assert kept.closed
    hub.open(5, "show", 70.0, visitor=HERE)


def test_registry_does_not_limit_other_transports() -> None:
    hub = limited(max_address_sessions=1)
    for k in range(3):
        hub.open(k, f"s{k}", 0.0)


def test_registry_counts_a_restored_session_for_its_first_client() -> None:
    hub = limited(max_address_sessions=1)
    hub.open(1, "one", 0.0, visitor=HERE)
    hub.sessions["two"] = Session("two", Settings(), 0.0, named=True)
    with pytest.raises(JoinError, match="wanted fewer"):
        hub.check("two", HERE)
    hub.open(2, "two", 0.0, visitor=THERE)


def test_registry_counts_both_sessions_of_a_move() -> None:
    hub = limited(max_address_sessions=1)
    here = hub.open(1, None, 0.0, visitor=HERE)
    here.receive(1, '{"type":"hello","session":"show"}', 0.5)
    hub.take_effects(here, 0.5)
    there = hub.session_of(1)
    assert there is not None
    assert there.id == "show"
    there.receive(1, '{"type":"hello","session":"another"}', 0.6)
    (effect,) = hub.take_effects(there, 0.6)
    assert "REALIZER_MAX_ADDRESS_SESSIONS" in effect.data


def test_registry_restricts_a_visitor_to_its_sessions() -> None:
    hub = limited()
    bound = Visitor("10.0.0.1", frozenset({"show", "stage"}))
    for name in ("other", None):
        with pytest.raises(JoinError, match=r"the token is for \(show, stage\)") as caught:
            hub.open(1, name, 0.0, visitor=bound)
        assert caught.value.status == 403
    here = hub.open(1, "show", 0.0, visitor=bound)
    here.receive(1, '{"type":"hello","session":"other"}', 0.5)
    (effect,) = hub.take_effects(here, 0.5)
    assert "hello.session" in effect.data
    assert hub.session_of(1) is here
    here.receive(1, '{"type":"hello","session":"stage"}', 0.5)
    hub.take_effects(here, 0.5)
    there = hub.session_of(1)
    assert there is not None
    assert there.id == "stage"


def test_registry_without_memory_opens_no_session_but_lets_join(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pages = tmp_path / "statm"
    monkeypatch.setattr(limits, "MEMORY", pages)
    hub = limited(max_memory=64)
    pages.write_text("2 1 0")
    hub.open(1, "show", 0.0)
    pages.write_text("2000000 1000000 0")
    hub.open(2, "show", 0.0)
    with pytest.raises(JoinError, match="REALIZER_MAX_MEMORY") as caught:
        hub.open(3, "more", 0.0)
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
    hub = limited(max_sessions=4, max_address_sessions=2)
    opened: dict[Session, str] = {}
    who: dict[int, str] = {}
    for now, (move, connection, name, address) in enumerate(moves):
        session = hub.session_of(connection)
        if move == "open" and session is None:
            share: bool | None
            try:
                joined = hub.open(connection, name, now, visitor=Visitor(address))
                who[connection] = address
                opened.setdefault(joined, address)
            except JoinError as full:
                share = full.status == 429
            else:
                share = None
            if share is not None:
                # Only if all sessions that could make room have connections.
                mine = [s for s in hub.sessions.values() if not share or opened[s] == address]
                assert all(s.empty_since is None for s in mine)
                assert len(mine) == (2 if share else 4)
        elif move == "leave":
            hub.leave(connection, now)
        elif move == "hello" and session is not None and name is not None:
            session.receive(connection, f'{{"type":"hello","session":"{name}"}}', now)
            hub.take_effects(session, now)
            there = hub.session_of(connection)
            assert there is not None
            opened.setdefault(there, who[connection])
        elif move == "sweep":
            hub.remove_expired(now + 40)
        elif move == "fail" and session is not None:
            session.close()
            hub.remove(session)
        opened = {s: a for s, a in opened.items() if hub.sessions.get(s.id) is s}
        shares = Counter(opened.values())
        assert len(hub.sessions) <= 4
        assert max(shares["10.0.0.1"], shares["10.0.0.2"]) <= 2
    for connection in range(8):
        hub.leave(connection, 1000)
    hub.remove_expired(2000)
    assert not hub.sessions
    assert not hub._opened_by
    assert not hub._opened_count


def test_worker_of_is_the_first_one_for_other_transports() -> None:
    for name in ("asap-127.0.0.1", "xface-127.0.0.1", "stomp-json", "xface-player"):
        assert worker_of(name, 7, Settings()) == 0
    assert {worker_of(f"session-{k}", 7, Settings()) for k in range(100)} == set(range(7))
