"""The journal in Redis, which several hosts share."""

import contextlib
import re
import secrets
import time
from collections.abc import Collection, Iterator, Mapping
from typing import Any

from realizer.server.journal.entry import NOTE, RETENTION, Entry, JournalError, SavedSession, TakenOver

PATIENCE = 1.0  # s for an answer
# All sessions wait meanwhile: after a timeout the server is not asked again for this time.
PAUSE = 4.0  # s

# The named groups are what messages may show; the rest may contain passwords.
ADDRESS = re.compile(
    r"(?P<scheme>rediss?)://([^/?#]*@)?(?P<place>(\[[0-9a-fA-F:.]+\]|[^@:/?#\[\]]*)(:\d+)?(/\d*)?)(\?[^#]*)?"
    r"|(?P<unix>unix)://([^/?#]*@)?(?P<path>/[^@?#]*)(\?[^#]*)?"
)
PLACE = re.compile(r" connecting to \S+\.(?= |$)")  # in an error

# KEYS: the head (owner, epoch), the list of entries, and the parts by name. A script is atomic: no other
# command runs between its check and its write, and a restarted server has all of its writes or none.
# An answer may get lost after its write. Its owner knows of ARGV[3] entries: those beyond were reported to
# clients as not written, and are deleted.
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
# ARGV: ..., the number of parts to delete, their names, then name and text of each new part.
COMPACT = """
if redis.call('HGET', KEYS[1], 'owner') ~= ARGV[1] then return 0 end
redis.call('DEL', KEYS[2])
for k = 4, 3 + ARGV[3] do redis.call('HDEL', KEYS[3], ARGV[k]) end
for k = 4 + ARGV[3], #ARGV, 2 do redis.call('HSET', KEYS[3], ARGV[k], ARGV[k + 1]) end
for _, key in ipairs(KEYS) do redis.call('EXPIRE', key, ARGV[2]) end
return 1
"""
# ARGV: the owner, the name of the part, and its text; "" to delete it.
SET_PART = """
if redis.call('HGET', KEYS[1], 'owner') ~= ARGV[1] then return 0 end
if ARGV[3] == '' then
    redis.call('HDEL', KEYS[3], ARGV[2])
else
    redis.call('HSET', KEYS[3], ARGV[2], ARGV[3])
end
return 1
"""
# ARGV: the owner, the name of the part to delete, the index of the entry, and its line.
REPLACE = """
if redis.call('HGET', KEYS[1], 'owner') ~= ARGV[1] then return 0 end
redis.call('LSET', KEYS[2], ARGV[3], ARGV[4])
redis.call('HDEL', KEYS[3], ARGV[2])
return 1
"""
END = """
if redis.call('HGET', KEYS[1], 'owner') == ARGV[1] then redis.call('DEL', unpack(KEYS)) end
"""


class RedisJournal:
    """A journal at a URL such as redis://HOST:6379/0. An entry takes one round trip.

    Raises:
        JournalError: the server cannot be reached, or its client is not installed.
    """

    def __init__(self, url: str) -> None:
        try:
            import redis
            from redis.backoff import NoBackoff
            from redis.retry import Retry
        except ImportError:
            raise JournalError("a journal in Redis: pip install 'bml-realizer[cluster]'") from None
        if (match := ADDRESS.fullmatch(url)) is None:
            raise JournalError(
                "the journal: wanted redis://USER:PASSWORD@HOST:PORT/NUMBER, or unix:///PATH, got another; "
                "in a password / ? # @ % are written as %2F %3F %23 %40 %25"
            )
        place = f"{match['scheme']}://{match['place']}" if match["scheme"] else f"unix://{match['path']}"
        self._owner = secrets.token_hex(8)
        self._counts: dict[str, int] = {}  # session -> number of its entries
        self._pause_ends = 0.0
        self._timeout: type[Exception] = redis.TimeoutError
        self._faults: tuple[type[Exception], ...] = (redis.RedisError, OSError)
        try:
            self._store: Any = redis.Redis.from_url(
                url,
                socket_timeout=PATIENCE,
                socket_connect_timeout=PATIENCE,
                decode_responses=True,
                # For a server that has restarted. Repeating a write is harmless: see ADD.
                retry=Retry(NoBackoff(), 1, (redis.ConnectionError,)),
            )
            self._store.connection_pool.make_connection()  # validates the query of the URL
        except (ValueError, TypeError) as error:
            raise JournalError(f"the journal {place}: {error}") from None
        scripts = map(self._store.register_script, (ADD, TAKE, COMPACT, SET_PART, REPLACE, END))
        self._add, self._take, self._compact, self._set_part, self._replace, self._end = scripts
        with self._translate_errors(f" {place}"):
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
        known = self._counts.get(session, 0)
        self._counts[session] = self._change(self._add, session, RETENTION, known, entry.line())

    def claim(self, session: str) -> SavedSession | None:
        with self._translate_errors():
            answer = self._take(_keys(session), [self._owner])
        if answer is None:
            return None
        epoch, lines, parts = answer
        self._counts[session] = len(lines)
        return SavedSession.read(
            float(epoch),
            lines,
            dict(zip(parts[::2], parts[1::2], strict=True)),
            place=f"the journal of session {session}, entry ",
        )

    def note(self, session: str, text: str | None) -> None:
        self._change(self._set_part, session, NOTE, text or "")

    def replace(self, session: str, index: int, entry: Entry) -> None:
        self._change(self._replace, session, NOTE, index, entry.line())

    def taken_over(self, sessions: Collection[str]) -> set[str]:
        with self._translate_errors():
            pipe = self._store.pipeline(transaction=False)
            for session in sessions:
                pipe.hget(_keys(session)[0], "owner")
            owners = dict(zip(sessions, pipe.execute(), strict=True))
        return {session for session, owner in owners.items() if owner not in (None, self._owner)}

    def compact(self, session: str, parts: Mapping[str, str | None]) -> None:
        deleted = [name for name, text in parts.items() if text is None]
        new = [word for name, text in parts.items() if text is not None for word in (name, text)]
        self._change(self._compact, session, RETENTION, len(deleted), *deleted, *new)
        self._counts[session] = 0

    def end(self, session: str) -> None:
        self._counts.pop(session, None)
        with contextlib.suppress(JournalError), self._translate_errors():
            self._end(_keys(session), [self._owner])

    def close(self) -> None:
        with contextlib.suppress(*self._faults):
            self._store.close()

    def _change(self, script: Any, session: str, *arguments: str | float) -> int:
        """Run a script that changes a session, unless another process has taken it over."""
        with self._translate_errors():
            done = int(script(_keys(session), [self._owner, *arguments]))
        if not done:
            raise TakenOver(session)
        return done

    @contextlib.contextmanager
    def _translate_errors(self, place: str = "") -> Iterator[None]:
        """Raise errors as JournalError, without the address: clients get the text."""
        if time.monotonic() < self._pause_ends:
            raise JournalError(f"the journal: it did not answer, and is asked again in {PAUSE:g} s")
        try:
            yield
        except self._faults as error:
            if isinstance(error, self._timeout):
                self._pause_ends = time.monotonic() + PAUSE
            raise JournalError(f"the journal{place}: {PLACE.sub(':', str(error))}") from None


def _keys(session: str) -> list[str]:
    head = f"realizer:{{{session}}}"  # a cluster stores keys with the same {...} on one node
    return [head, f"{head}:entries", f"{head}:parts"]
