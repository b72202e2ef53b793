"""The journal in Redis, which several nodes share."""

from __future__ import annotations

import contextlib
import re
import secrets
import time
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from realizer.server.journal.entry import RETENTION, Entry, JournalError, SavedSession, TakenOver

PATIENCE = 1.0  # s for an answer
# Everybody waits for it meanwhile: who has not answered in that time is not asked again before so long.
PAUSE = 4.0  # s

# What may stand before it, and after it, is nobody's business: passwords.
ADDRESS = re.compile(
    r"(?P<scheme>rediss?)://([^/?#]*@)?(?P<place>(\[[0-9a-fA-F:.]+\]|[^@:/?#\[\]]*)(:\d+)?(/\d*)?)(\?[^#]*)?"
    r"|(?P<unix>unix)://([^/?#]*@)?(?P<path>/[^@?#]*)(\?[^#]*)?"
)

# KEYS: of the head (owner, epoch), of the list of entries, and of the parts by name. Nobody comes between
# the look and the write, and who restarts the store finds all of a script's writes in its log, or none.
# An answer may be lost after its write: what is there beyond the entries that its owner knows of, ARGV[3] of
# them, is what somebody was told could not be kept, and goes.
ADD = """
if redis.call('HGET', KEYS[1], 'owner') ~= ARGV[1] then return 0 end
local known = tonumber(ARGV[3])
while redis.call('LLEN', KEYS[2]) > known do redis.call('RPOP', KEYS[2]) end
local count = redis.call('RPUSH', KEYS[2], ARGV[4])
for _, key in ipairs(KEYS) do redis.call('EXPIRE', key, ARGV[2]) end
return count
"""
TAKE = """
if redis.call('EXISTS', KEYS[1]) == 0 then return false end
redis.call('HSET', KEYS[1], 'owner', ARGV[1])
return {
    redis.call('HGET', KEYS[1], 'epoch'), redis.call('LRANGE', KEYS[2], 0, -1), redis.call('HGETALL', KEYS[3])
}
"""
# ARGV: ..., how many parts are gone, their names, and then name and text of each that is new.
COMPACT = """
if redis.call('HGET', KEYS[1], 'owner') ~= ARGV[1] then return 0 end
redis.call('DEL', KEYS[2])
for k = 4, 3 + ARGV[3] do redis.call('HDEL', KEYS[3], ARGV[k]) end
for k = 4 + ARGV[3], #ARGV, 2 do redis.call('HSET', KEYS[3], ARGV[k], ARGV[k + 1]) end
for _, key in ipairs(KEYS) do redis.call('EXPIRE', key, ARGV[2]) end
return 1
"""
END = """
if redis.call('HGET', KEYS[1], 'owner') == ARGV[1] then redis.call('DEL', unpack(KEYS)) end
"""


class RedisJournal:
    """The store at a URL such as redis://HOST:6379/0. An entry is one round trip.

    Raises:
        JournalError: it cannot be reached, or its client is not installed.
    """

    def __init__(self, url: str) -> None:
        try:
            import redis
            from redis.backoff import NoBackoff
            from redis.retry import Retry
        except ImportError:
            raise JournalError("a journal in Redis: pip install 'bml-realizer[cluster]'") from None
        if (found := ADDRESS.fullmatch(url)) is None:
            raise JournalError(
                "the journal: wanted redis://USER:PASSWORD@HOST:PORT/NUMBER, or unix:///PATH, got another; "
                "in a password / ? # @ % are written as %2F %3F %23 %40 %25"
            )
        self._url = (
            "{scheme}://{place}".format_map(found.groupdict())
            if found["scheme"]
            else f"unix://{found['path']}"
        )
        self._owner = secrets.token_hex(8)
        self._counts: dict[str, int] = {}  # session -> how many entries it has
        self._pause_ends = 0.0
        self._late: type[Exception] = redis.TimeoutError
        self._faults: tuple[type[Exception], ...] = (redis.RedisError, OSError)
        try:
            self._store: Any = redis.Redis.from_url(
                url,
                socket_timeout=PATIENCE,
                socket_connect_timeout=PATIENCE,
                decode_responses=True,
                # One that restarts is there again at once, or not at all; a write twice is as one.
                retry=Retry(NoBackoff(), 1, (redis.ConnectionError,)),
            )
            self._store.connection_pool.make_connection()  # which knows what may stand behind the "?"
        except (ValueError, TypeError) as error:
            raise JournalError(f"the journal {self._url}: {error}") from None
        scripts = map(self._store.register_script, (ADD, TAKE, COMPACT, END))
        self._add, self._take, self._compact, self._end = scripts
        with self._translate_errors():
            self._store.ping()

    def begin(self, session: str, epoch: float) -> None:
        head, *rest = _keys(session)
        with self._translate_errors():
            pipe = self._store.pipeline()
            pipe.delete(*rest)
            pipe.hset(head, mapping={"owner": self._owner, "epoch": repr(epoch)})
            pipe.expire(head, RETENTION)
            pipe.execute()
        self._counts[session] = 0

    def add(self, session: str, entry: Entry) -> None:
        with self._translate_errors():
            known = self._counts.get(session, 0)
            count = self._add(_keys(session), [self._owner, RETENTION, known, entry.line()])
        if not count:
            raise _taken_over_error(session)
        self._counts[session] = count

    def claim(self, session: str) -> SavedSession | None:
        with self._translate_errors():
            there = self._take(_keys(session), [self._owner])
        if there is None:
            return None
        epoch, lines, parts = there
        texts = dict(zip(parts[::2], parts[1::2], strict=True))
        self._counts[session] = len(lines)
        return SavedSession(float(epoch), [Entry.read(line) for line in lines], texts)

    def taken_over(self, sessions: Collection[str]) -> set[str]:
        with self._translate_errors():
            pipe = self._store.pipeline(transaction=False)
            for session in sessions:
                pipe.hget(_keys(session)[0], "owner")
            owners = dict(zip(sessions, pipe.execute(), strict=True))
        return {session for session, owner in owners.items() if owner not in (None, self._owner)}

    def compact(self, session: str, parts: Mapping[str, str | None]) -> None:
        gone = [name for name, text in parts.items() if text is None]
        new = [word for name, text in parts.items() if text is not None for word in (name, text)]
        with self._translate_errors():
            done = self._compact(_keys(session), [self._owner, RETENTION, len(gone), *gone, *new])
        if not done:
            raise _taken_over_error(session)
        self._counts[session] = 0

    def end(self, session: str) -> None:
        self._counts.pop(session, None)
        with contextlib.suppress(JournalError), self._translate_errors():
            self._end(_keys(session), [self._owner])

    def close(self) -> None:
        with contextlib.suppress(*self._faults):
            self._store.close()

    @contextlib.contextmanager
    def _translate_errors(self) -> Iterator[None]:
        if time.monotonic() < self._pause_ends:
            raise JournalError(f"the journal {self._url}: it did not answer, and is asked again in a moment")
        try:
            yield
        except self._late as error:
            self._pause_ends = time.monotonic() + PAUSE
            raise JournalError(f"the journal {self._url}: {error}") from None
        except self._faults as error:
            raise JournalError(f"the journal {self._url}: {error}") from None


def _keys(session: str) -> list[str]:
    """The braces keep them in one place of a cluster."""
    head = f"realizer:{{{session}}}"
    return [head, f"{head}:entries", f"{head}:parts"]


def _taken_over_error(session: str) -> TakenOver:
    return TakenOver(f"session {session} is another node's now")
