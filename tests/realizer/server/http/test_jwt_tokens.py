"""Signed tokens: their keys, claims, sessions and clocks."""

from __future__ import annotations

import builtins
import time
from collections.abc import Callable
from typing import Any

import jwt
import pytest
from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
)

from realizer.core.errors import RealizerError
from realizer.server.http import access as jwt_tokens
from realizer.server.http.access import Grant, TokenError, TokenVerifier

SECRET = "a secret that is long enough to be one"
LONG = 10**10  # s; POSIX, in three hundred years


def keys(kind: str) -> Any:
    """A new private key."""
    made: dict[str, Callable[[], Any]] = {
        "RS256": lambda: rsa.generate_private_key(65537, 2048),
        "ES256": lambda: ec.generate_private_key(ec.SECP256R1()),
        "ES384": lambda: ec.generate_private_key(ec.SECP384R1()),
        "EdDSA": ed25519.Ed25519PrivateKey.generate,
    }
    return made[kind]()


def pem(key: Any) -> str:
    """Its public half."""
    text: bytes = key.public_key().public_bytes(Encoding.PEM, PublicFormat.SubjectPublicKeyInfo)
    return text.decode()


@pytest.mark.parametrize("algorithm", ["RS256", "ES256", "ES384", "EdDSA"])
def test_verifier_accepts_tokens_of_its_private_key_only(algorithm: str) -> None:
    key, other = keys(algorithm), keys(algorithm)
    reader = TokenVerifier(pem(key))
    assert reader.verify(jwt.encode({"sub": "me"}, key, algorithm)) == Grant()
    with pytest.raises(TokenError, match="not signed with it"):
        reader.verify(jwt.encode({"sub": "me"}, other, algorithm))


def test_verifier_accepts_a_secret() -> None:
    reader = TokenVerifier(SECRET)
    assert reader.verify(jwt.encode({"exp": LONG}, SECRET, "HS256")) == Grant(None, LONG)
    with pytest.raises(TokenError, match="not signed with it"):
        reader.verify(jwt.encode({"exp": LONG}, SECRET[::-1], "HS256"))


@pytest.mark.parametrize("algorithm", ["HS256", "none", "HS512"])
def test_verifier_does_not_take_a_public_key_for_a_secret(algorithm: str) -> None:
    """A public key, which anybody may know, must not sign by another algorithm."""
    key = keys("RS256")
    head = {"alg": algorithm, "typ": "JWT"}
    signed = jwt.encode({"sub": "me"}, "x" * 64, "HS256").split(".")
    forged = _signed(head, {"sub": "me"}, pem(key))
    for token in (forged, ".".join([signed[0], signed[1], ""])):
        with pytest.raises(TokenError):
            TokenVerifier(pem(key)).verify(token)


def _signed(head: dict[str, str], claims: dict[str, Any], secret: str) -> str:
    """A token by hand, as the package refuses to make it."""
    import hashlib
    import hmac
    import json
    from base64 import urlsafe_b64encode

    def part(data: bytes) -> bytes:
        return urlsafe_b64encode(data).rstrip(b"=")

    body = part(json.dumps(head).encode()) + b"." + part(json.dumps(claims).encode())
    mac = b"" if head["alg"] == "none" else hmac.new(secret.encode(), body, hashlib.sha256).digest()
    return (body + b"." + part(mac)).decode()


@pytest.mark.parametrize(
    ("claims", "says"),
    [
        ({"exp": 1}, "has expired"),
        ({"nbf": LONG}, "not valid yet"),
        ({"iat": LONG}, "not valid yet"),
        ({"aud": "others"}, "for somebody else"),
        ({"exp": "soon"}, "another one"),
        ({"exp": float("inf")}, "another one"),
        ({"session": 7}, "no name, and no list of names"),
        ({"session": ["show", 7]}, "no name, and no list of names"),
        ({"session": None}, "no name, and no list of names"),
    ],
)
def test_verifier_names_invalid_claims_without_their_content(claims: dict[str, Any], says: str) -> None:
    token = _signed({"alg": "HS256", "typ": "JWT"}, {"sub": "who-is-it", **claims}, SECRET)
    with pytest.raises(TokenError, match=says) as refused:
        TokenVerifier(SECRET).verify(token)
    assert "who-is-it" not in str(refused.value)


@pytest.mark.parametrize(
    ("claims", "sessions"),
    [
        ({}, None),
        ({"session": "show"}, {"show"}),
        ({"session": ["show", "stage"]}, {"show", "stage"}),
        ({"session": []}, set()),
    ],
)
def test_verifier_returns_the_sessions_of_a_token(claims: dict[str, Any], sessions: set[str] | None) -> None:
    assert TokenVerifier(SECRET).verify(jwt.encode(claims, SECRET, "HS256")).sessions == sessions


def test_verifier_checks_the_audience() -> None:
    reader = TokenVerifier(SECRET, "faces")
    assert reader.verify(jwt.encode({"aud": ["others", "faces"]}, SECRET, "HS256")) == Grant()
    for claims in ({}, {"aud": "others"}):
        with pytest.raises(TokenError, match="REALIZER_JWT_AUDIENCE"):
            reader.verify(jwt.encode(claims, SECRET, "HS256"))


def test_verifier_tolerates_clocks_that_differ_by_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    now = int(time.time())
    claims = {"exp": now + 60, "nbf": now + 3}
    until = TokenVerifier(SECRET).verify(jwt.encode(claims, SECRET, "HS256"))
    monkeypatch.setattr(jwt_tokens.time, "time", lambda: now + 60.0)
    assert until.seconds_left == jwt_tokens.LEEWAY
    monkeypatch.setattr(jwt_tokens.time, "time", lambda: now + 600.0)
    assert until.seconds_left == 0
    assert Grant().seconds_left is None


@pytest.mark.parametrize("token", ["", ".", "..", "a.b.c", "é" * 100, "\udcff", "x" * 100_000, "\0"])
def test_verifier_refuses_what_is_no_token(token: str) -> None:
    for key in (SECRET, pem(keys("EdDSA"))):
        with pytest.raises(TokenError):
            TokenVerifier(key).verify(token)


def test_verifier_refuses_keys_that_cannot_be_used() -> None:
    weak = rsa.generate_private_key(65537, 1024)
    private = keys("ES256").private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption()).decode()
    odd = pem(ec.generate_private_key(ec.SECP256K1()))
    for key in (pem(weak), private, odd, "-----BEGIN PUBLIC KEY-----\nnone\n-----END PUBLIC KEY-----"):
        with pytest.raises(RealizerError, match="setting jwt_key: wanted a public key in PEM") as refused:
            TokenVerifier(key)
        assert "none" not in str(refused.value)
        assert "MI" not in str(refused.value)


@pytest.mark.parametrize("without", ["jwt", "cryptography"])
def test_verifier_without_pyjwt_says_what_to_install(without: str, monkeypatch: pytest.MonkeyPatch) -> None:
    there = builtins.__import__

    def find(name: str, *rest: Any, **more: Any) -> Any:
        if name.partition(".")[0] == without:
            raise ImportError(name)
        return there(name, *rest, **more)

    key = pem(keys("EdDSA"))
    monkeypatch.setattr(builtins, "__import__", find)
    with pytest.raises(RealizerError, match=r"pip install 'bml-realizer\[jwt\]'"):
        TokenVerifier(key)
