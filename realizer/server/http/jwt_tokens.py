"""Verification of JSON Web Tokens (RFC 7519)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from realizer.core.errors import RealizerError

LEEWAY = 10.0  # s; allows for different clocks of hosts
MIN_RSA_BITS = 2048  # shorter keys are insecure
# Elliptic curve -> the one algorithm that signs with it (RFC 7518, 3.4).
CURVES = {"secp256r1": "ES256", "secp384r1": "ES384", "secp521r1": "ES512"}


class TokenError(RealizerError):
    """A token is not accepted; the text says why, without its content."""


@dataclass(frozen=True, slots=True)
class Grant:
    """The rights of a connection.

    Attributes:
        sessions: names of the sessions it may join; None: any.
        until: POSIX time at which it ends, or None.
    """

    sessions: frozenset[str] | None = None
    until: float | None = None

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
