"""Access control: tokens, connection slots and rate limits."""

from __future__ import annotations

import hashlib
import hmac
import json
import logging
import ssl
from collections.abc import Iterable, Mapping
from http import HTTPStatus
from urllib.parse import parse_qs, urlsplit

from realizer.core.settings import Settings, SettingsError, raises
from realizer.protocol.messages.common import MAX_CONTROL
from realizer.server.documents.limits import memory_error
from realizer.server.http.jwt_tokens import Grant, TokenError, TokenVerifier
from realizer.server.runtime.session_registry import JoinError

# Names of this machine for itself.
LOOPBACK = {"localhost", "127.0.0.1", "::1"}
# A client that brings its token in `hello` must have said it by then.
PATIENCE = 10.0  # s
# Where nobody is asked, and of who has the service's token.
ANY_GRANT = Grant()


class AccessControl:
    """What a service's settings say about who may come in.

    A token may come as `Authorization: Bearer TOKEN`, as `?token=TOKEN` (browsers can send no header with a
    WebSocket), or in a `hello` that is the first message. It is compared in constant time and never logged.
    A JWT that `settings.jwt_key` has signed may come in its place.

    A browser says which page opens a WebSocket. Pages of this machine may where the service listens to this
    machine alone; elsewhere pages of the service's own address may; and those of `settings.origins`.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._token = None if settings.token is None else _digest(settings.token)
        self._passes = (
            None if settings.jwt_key is None else TokenVerifier(settings.jwt_key, settings.jwt_audience)
        )
        if self.requires_token:
            # At its finest the library logs whole requests, with what is in them.
            logging.getLogger("websockets.server").setLevel(logging.WARNING)

    @property
    def requires_token(self) -> bool:
        """Whether a token is wanted."""
        return self._token is not None or self._passes is not None

    def _admit(self, token: str | None) -> Grant:
        """What a token lets its bearer do; all where none is wanted.

        Raises:
            HubError: 401, no token or a wrong one.
        """
        if not self.requires_token:
            return ANY_GRANT
        got = "none" if token is None else "another one"
        if token is not None:
            if self._token is not None and hmac.compare_digest(_digest(token), self._token):
                return ANY_GRANT
            try:
                if self._passes is not None:
                    return self._passes.verify(token)
            except TokenError as error:
                got = str(error)
        wanted = ["that of this service (REALIZER_TOKEN)"] if self._token is not None else []
        wanted += ["a JWT of this service's key (REALIZER_JWT_KEY)"] if self._passes is not None else []
        raise JoinError(HTTPStatus.UNAUTHORIZED, f"token: wanted {' or '.join(wanted)}, got {got}")

    def request(self, target: str, headers: Mapping[str, str], *, later: bool = False) -> Grant | None:
        """What the token of a request lets it do; None where it has none and may bring it `later`.

        Args:
            target: the request's path and query.
            headers: by their names in small letters.

        Raises:
            HubError: 403, a page of elsewhere; 401, no token or a wrong one.
        """
        self._check_origin(headers)
        scheme, _, credentials = headers.get("authorization", "").partition(" ")
        query = parse_qs(target.partition("?")[2]).get("token", [None])[-1]
        token = credentials.strip() if scheme.lower() == "bearer" else query
        return None if token is None and self.requires_token and later else self._admit(token)

    def check_hello(self, message: str | bytes) -> Grant:
        """What the token of a first message lets it do, which is a `hello`.

        Raises:
            HubError: 401, it is none, or has no token or a wrong one.
        """
        try:
            hello = json.loads(message) if isinstance(message, str) and len(message) < MAX_CONTROL else None
        except (ValueError, RecursionError):
            hello = None
        if not isinstance(hello, dict) or hello.get("type") != "hello":
            words = "token: wanted one in the address, a header or a first hello, got none"
            raise JoinError(HTTPStatus.UNAUTHORIZED, words)
        token = hello.get("token")
        return self._admit(token if isinstance(token, str) else None)

    def check_memory(self) -> None:
        """Whether there is memory for more.

        Raises:
            HubError: 503, there is none.
        """
        if (words := memory_error(self._settings)) is not None:
            raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, words)

    def tls(self) -> ssl.SSLContext | None:
        """What speaks TLS with the service's certificate; None where it has none.

        Raises:
            SettingsError: the files do not fit each other, are none, or want a pass phrase.
        """
        cert, key = self._settings.tls_cert, self._settings.tls_key
        if cert is None:
            return None

        def asked() -> str:
            raise ValueError("the key has one")  # or a service would wait for somebody at a keyboard

        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        try:
            context.load_cert_chain(cert, key, asked)
        except (OSError, ValueError) as error:
            raise SettingsError(
                "setting tls_cert: wanted certificates in PEM, and in tls_key the key of the first without a "
                f"pass phrase, got {cert} and {key or 'none'}: {getattr(error, 'reason', None) or error}"
            ) from None
        return context

    def _check_origin(self, headers: Mapping[str, str]) -> None:
        origin = headers.get("origin")
        if origin is None or "*" in self._settings.origins or _same(origin, self._settings.origins):
            return  # programs that are no browser say none
        try:
            parts = urlsplit(origin.lower())
        except ValueError:
            parts = urlsplit("")
        if self._settings.host in LOOPBACK:
            # Not whatever stands in Host: a name of the attacker's may point to this machine.
            welcome = parts.hostname in LOOPBACK
        else:
            welcome = parts.netloc != "" and parts.netloc == headers.get("host", "").lower()
        if not welcome:
            raise JoinError(
                HTTPStatus.FORBIDDEN,
                f"origin: wanted a page of this service, got one of {origin[:200]!r}; "
                "REALIZER_ORIGINS lets more in",
            )


class RateLimiter:
    """How long to wait before a client's next message is read, so that it has no more than its share.

    Args:
        rate: messages a second; twice as many may come at once after a pause.

    Attributes:
        notice: what the client is to be told of the last wait; None where it was told, or kept to the rate.
    """

    def __init__(self, rate: float) -> None:
        self.notice: str | None = None
        self._rate = rate
        self._was_limited = False
        self._free = float("-inf")  # when everything that came would have come at that rate

    def wait(self, now: float) -> float:
        """Seconds to wait after a message that came `now`; 0 for a client that keeps to the rate."""
        self._free = max(self._free, now) + 1.0 / self._rate
        pause = max(0.0, self._free - now - 2.0)
        words = f"wanted at most {self._rate:g} messages a second; more are read later {raises('max_rate')}"
        self.notice = words if pause and not self._was_limited else None
        self._was_limited = bool(pause)
        return pause


def _digest(token: str) -> bytes:
    """As long for every token, so that comparing tells nothing of its length."""
    return hashlib.sha256(token.encode("utf-8", "surrogateescape")).digest()


def _same(origin: str, known: Iterable[str]) -> bool:
    return origin.rstrip("/").lower() in {one.rstrip("/").lower() for one in known}
