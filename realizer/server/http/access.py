"""Access control: tokens, which may be JSON Web Tokens (RFC 7519), hosts, origins and TLS."""

import hashlib
import hmac
import ipaddress
import logging
import socket
import ssl
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, urlsplit

from realizer.core.errors import RealizerError
from realizer.core.json_reader import parse_json
from realizer.core.settings import Settings, SettingsError, is_loopback
from realizer.protocol.messages.common import MAX_CONTROL
from realizer.server.documents.limits import memory_error
from realizer.server.runtime.session_registry import JoinError

log = logging.getLogger(__name__)

LEEWAY = 10.0  # s; allows for different clocks of hosts
MIN_RSA_BITS = 2048  # shorter keys are insecure
# Elliptic curve -> the one algorithm that signs with it (RFC 7518, 3.4).
CURVES = {"secp256r1": "ES256", "secp384r1": "ES384", "secp521r1": "ES512"}


class TokenError(RealizerError):
    """A token is not accepted; the text says why, without its content."""


@dataclass(frozen=True, slots=True)
class Grant:
    """The rights of a connection."""

    sessions: frozenset[str] | None = None  # names of the sessions it may join; None: any
    until: float | None = None  # POSIX time at which it ends, or None

    @property
    def seconds_left(self) -> float | None:
        """Seconds until the grant ends, or None."""
        return None if self.until is None else max(0.0, self.until + LEEWAY - time.time())


class TokenVerifier:
    """A verifier of tokens signed with one key, by the algorithms of that key only.

    Args:
        key: a public key in PEM (RSA, an elliptic curve, Ed25519), or a secret (HS256).
        audience: required claim `aud` of tokens; None: they must not have one.

    Raises:
        RealizerError: the key is not one of these, or PyJWT is not installed.
    """

    def __init__(self, key: str, audience: str | None = None) -> None:
        try:
            import jwt
        except ImportError:
            raise _missing() from None
        self._jwt = jwt
        self._audience = audience
        read: tuple[Any, Sequence[str]] = _public(key) if "-----BEGIN" in key else (key, ["HS256"])
        self._key, self._algorithms = read

    def verify(self, token: str) -> Grant:
        """Return the grant of a token.

        Raises:
            TokenError: the token is not accepted.
        """
        jwt = self._jwt
        try:
            claims = jwt.decode(
                token, self._key, algorithms=self._algorithms, audience=self._audience, leeway=LEEWAY
            )
            until = claims.get("exp")
            return Grant(_sessions(claims), None if until is None else float(until))
        except jwt.ExpiredSignatureError:
            raise TokenError("one that has expired") from None
        except (jwt.ImmatureSignatureError, jwt.InvalidIssuedAtError):
            raise TokenError("one that is not valid yet") from None
        except (jwt.InvalidAudienceError, jwt.MissingRequiredClaimError):
            raise TokenError("one for somebody else (REALIZER_JWT_AUDIENCE)") from None
        except (jwt.InvalidSignatureError, jwt.InvalidAlgorithmError):
            raise TokenError("one that is not signed with it") from None
        except (jwt.InvalidTokenError, ValueError, TypeError, OverflowError):
            raise TokenError("another one") from None


def _sessions(claims: dict[str, Any]) -> frozenset[str] | None:
    """Return the sessions that the claim `session` names, a string or a list; None without the claim."""
    if "session" not in claims:
        return None
    claim = claims["session"]
    names = [claim] if isinstance(claim, str) else claim
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise TokenError("one whose claim session is no name, and no list of names")
    return frozenset(names)


def _public(text: str) -> tuple[Any, Sequence[str]]:
    """Return a public key, and the algorithms that may sign with it."""
    try:
        from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa
        from cryptography.hazmat.primitives.serialization import load_pem_public_key
    except ImportError:
        raise _missing() from None
    try:
        key = load_pem_public_key(text.encode())
    except ValueError:
        key = None
    if isinstance(key, rsa.RSAPublicKey) and key.key_size >= MIN_RSA_BITS:
        return key, ["RS256", "RS384", "RS512"]
    if isinstance(key, ec.EllipticCurvePublicKey) and key.curve.name in CURVES:
        return key, [CURVES[key.curve.name]]
    if isinstance(key, ed25519.Ed25519PublicKey):
        return key, ["EdDSA"]
    wanted = f"of RSA ({MIN_RSA_BITS} bits or more), of an elliptic curve ({', '.join(CURVES)}) or of Ed25519"
    raise RealizerError(f"setting jwt_key: wanted a public key in PEM (BEGIN PUBLIC KEY), {wanted}")


def _missing() -> RealizerError:
    return RealizerError("--jwt-key needs PyJWT: pip install 'bml-realizer[jwt]'")


MODULES = ("/realizer.js", "/bml-face.js")  # scripts that pages of all origins may load
# To listen on all addresses of the machine -> the one that it prints.
EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}
QUIET = 60.0  # s; not more often a refused token is a warning in the log
PATIENCE = 10.0  # s; a client whose token comes in `hello` must have sent it by then
# For a service without tokens, and for the service's own token.
ANY_GRANT = Grant()


class AccessControl:
    """The access rules of a service: tokens, hosts, origins and TLS.

    A token comes as `Authorization: Bearer TOKEN`, as `?token=TOKEN` (browsers can send no header with a
    WebSocket), or in a `hello` that is the first message. It is compared in constant time and never logged.
    A JWT signed with `settings.jwt_key` is accepted instead.

    A browser sends the host that its user, or a page, has asked for. Only names of this service are accepted,
    because the owner of another name may point it to this machine (DNS rebinding).

    A browser sends the origin of a page that opens a WebSocket or reads an answer. Accepted are those of
    `settings.origins`, and pages of the loopback address if the service listens there, or else of the
    service's own address.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self._token = None if settings.token is None else _digest(settings.token)
        self._verifier = (
            None if settings.jwt_key is None else TokenVerifier(settings.jwt_key, settings.jwt_audience)
        )
        self._quiet_until = 0.0
        self._hosts = {*settings.hosts, settings.host.lower(), socket.gethostname().lower()}
        if self.requires_token:
            # On the level DEBUG it logs whole requests, with their tokens.
            logging.getLogger("websockets.server").setLevel(logging.WARNING)

    @property
    def requires_token(self) -> bool:
        """Whether connections need a token."""
        return self._token is not None or self._verifier is not None

    def _admit(self, token: str | None) -> Grant:
        """Return the grant of a token; any, if none is required.

        Raises:
            JoinError: 401, no token or a wrong one.
        """
        if not self.requires_token:
            return ANY_GRANT
        got = "none" if token is None else "another one"
        if token is not None:
            if self._token is not None and hmac.compare_digest(_digest(token), self._token):
                return ANY_GRANT
            try:
                if self._verifier is not None:
                    return self._verifier.verify(token)
            except TokenError as error:
                got = str(error)
        wanted = ["that of this service (REALIZER_TOKEN)"] if self._token is not None else []
        wanted += ["a JWT of this service's key (REALIZER_JWT_KEY)"] if self._verifier is not None else []
        raise JoinError(HTTPStatus.UNAUTHORIZED, f"token: wanted {' or '.join(wanted)}, got {got}")

    def request(self, target: str, headers: Mapping[str, str], *, later: bool = False) -> Grant | None:
        """Return the grant of a request's token; None if it has none but may send one `later`.

        Args:
            headers: by lower-case names.

        Raises:
            JoinError: 403, a page of another origin; 401, no token or a wrong one.
        """
        if not self.allows_origin(headers):
            words = f"origin: wanted a page of this service, got one of {headers['origin'][:200]!r}"
            raise JoinError(HTTPStatus.FORBIDDEN, f"{words}; REALIZER_ORIGINS lets more in")
        scheme, _, credentials = headers.get("authorization", "").partition(" ")
        query = parse_qs(target.partition("?")[2]).get("token", [None])[-1]
        token = credentials.strip() if scheme.lower() == "bearer" else query
        return None if token is None and self.requires_token and later else self._admit(token)

    def check_host(self, headers: Mapping[str, str]) -> None:
        """Raise JoinError (403) if a request is for another host. One without a host is from no browser."""
        host = headers.get("host")
        try:
            name = "localhost" if host is None else (urlsplit(f"//{host}").hostname or "").rstrip(".")
        except ValueError:
            name = ""
        if name in self._hosts or is_loopback(name):
            return
        # Nobody can register a name without a dot; simple clients on this machine send any.
        if is_loopback(self._settings.host) and name and not set(".:") & set(name):
            return
        # No name server can make an address lead elsewhere.
        if self._settings.host in EVERYWHERE and _is_address(name):
            return
        words = f"host: wanted a name of this service, got {str(host)[:200]!r}; REALIZER_HOSTS adds names"
        raise JoinError(HTTPStatus.FORBIDDEN, words)

    def check_hello(self, message: str | bytes) -> Grant:
        """Return the grant of the token in a first message.

        Raises:
            JoinError: 401, it is not a `hello`, or has no token or a wrong one.
        """
        try:
            hello = parse_json(message) if isinstance(message, str) and len(message) < MAX_CONTROL else None
        except ValueError:
            hello = None
        if not isinstance(hello, dict) or hello.get("type") != "hello":
            words = "token: wanted one in the address, a header or a first hello, got none"
            raise JoinError(HTTPStatus.UNAUTHORIZED, words)
        token = hello.get("token")
        return self._admit(token if isinstance(token, str) else None)

    def log_refusal(self, error: JoinError, address: str) -> None:
        """Log a refusal, with the level WARNING that of a token, at most once in `QUIET` seconds."""
        is_loud = error.status == HTTPStatus.UNAUTHORIZED and time.monotonic() >= self._quiet_until
        if is_loud:
            self._quiet_until = time.monotonic() + QUIET
        level = logging.WARNING if is_loud else logging.INFO
        log.log(
            level, "refused: %s (from %s)", error, address, extra={"address": address, "status": error.status}
        )

    def check_memory(self) -> None:
        """Raise JoinError (503) if memory is used up."""
        if (words := memory_error(self._settings)) is not None:
            raise JoinError(HTTPStatus.SERVICE_UNAVAILABLE, words)

    def tls(self) -> ssl.SSLContext | None:
        """Return the TLS context of the service's certificate, or None without one.

        Raises:
            SettingsError: the files are no certificate and its key, or the key needs a pass phrase.
        """
        cert, key = self._settings.tls_cert, self._settings.tls_key
        if cert is None:
            return None

        def pass_phrase() -> str:
            raise ValueError("the key has one")  # instead of a prompt on the terminal

        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_2
        try:
            context.load_cert_chain(cert, key, pass_phrase)
        except (OSError, ValueError) as error:
            raise SettingsError(
                "setting tls_cert: wanted certificates in PEM, and in tls_key the key of the first without a "
                f"pass phrase, got {cert} and {key or 'none'}: {getattr(error, 'reason', None) or error}"
            ) from None
        return context

    def origin_of_reader(self, target: str, headers: Mapping[str, str]) -> str | None:
        """Return the origin whose pages may read an answer: * of scripts, which say why they fail."""
        if target.partition("?")[0] in MODULES:
            return "*"
        return headers.get("origin") if self.allows_origin(headers) else None

    def allows_origin(self, headers: Mapping[str, str]) -> bool:
        """Return whether a request is from a page that may use the service. One of no page has no origin."""
        origin = headers.get("origin")
        allowed = {known.rstrip("/").lower() for known in self._settings.origins}
        if origin is None or "*" in allowed or origin.rstrip("/").lower() in allowed:
            return True
        try:
            parts = urlsplit(origin.lower())
        except ValueError:
            return False
        if is_loopback(self._settings.host):
            return is_loopback(parts.hostname or "")
        return parts.netloc != "" and parts.netloc == headers.get("host", "").lower()


def _is_address(name: str) -> bool:
    try:
        return bool(ipaddress.ip_address(name))
    except ValueError:
        return False


def _digest(token: str) -> bytes:
    """Return a digest, whose comparison does not reveal the length of a token."""
    return hashlib.sha256(token.encode("utf-8", "surrogateescape")).digest()
