"""Access control: tokens, origins, memory, TLS and rate limits."""

from __future__ import annotations

import builtins
import json
import logging
import time
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import jwt
import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
    PublicFormat,
)

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings, SettingsError
from realizer.protocol.messages.common import MAX_CONTROL
from realizer.server.http import access as jwt_tokens
from realizer.server.http.access import AccessControl, Grant, TokenError, TokenVerifier
from realizer.server.runtime.session_registry import JoinError

TOKEN = "Xk-secret-7"
SECRET = "a secret that is long enough to be one"


def guard(**settings) -> AccessControl:
    return AccessControl(Settings(**settings))


@pytest.mark.parametrize(
    ("target", "headers"),
    [
        (f"/ws?session=a&token={TOKEN}", {}),
        ("/ws", {"authorization": f"Bearer {TOKEN}"}),
        ("/ws", {"authorization": f"bearer  {TOKEN} "}),
    ],
)
def test_access_accepts_a_token_in_the_address_or_a_header(target: str, headers: dict[str, str]) -> None:
    assert guard(token=TOKEN).request(target, headers)


@pytest.mark.parametrize(
    ("target", "headers"),
    [
        ("/ws?token=another", {}),
        ("/ws?token=", {"authorization": "Bearer another"}),
        ("/ws", {"authorization": "Bearer " + TOKEN + "x"}),
        ("/ws", {"authorization": "Bearer é\udcff"}),
    ],
)
@pytest.mark.parametrize("later", [True, False])
def test_access_refuses_a_wrong_token_without_repeating_it(
    target: str, headers: dict[str, str], later: bool
) -> None:
    with pytest.raises(JoinError, match="wanted that of this service") as refused:
        guard(token=TOKEN).request(target, headers, later=later)
    assert refused.value.status == 401
    assert TOKEN not in str(refused.value)
    assert "another" not in str(refused.value).replace("got another one", "")


def test_access_without_a_token_waits_for_a_hello() -> None:
    g = guard(token=TOKEN)
    assert g.request("/ws", {}, later=True) is None
    assert g.check_hello(json.dumps({"type": "hello", "token": TOKEN})) == Grant()
    with pytest.raises(JoinError, match="got none"):
        g.request("/metrics", {})


@pytest.mark.parametrize(
    "message",
    [
        "",
        "{",
        "[]",
        b"\x00",
        '<bml id="b"/>',
        '{"type": "hello"}',
        '{"type": "hello", "token": "x"}',
        '{"type": "hello", "token": ["' + TOKEN + '"]}',
        '{"type": "state", "token": "' + TOKEN + '"}',
    ],
)
def test_check_hello_refuses_other_first_messages(message: str | bytes) -> None:
    with pytest.raises(JoinError, match="token: wanted") as refused:
        guard(token=TOKEN).check_hello(message)
    assert refused.value.status == 401
    assert TOKEN not in str(refused.value)


def test_check_hello_does_not_parse_a_large_message() -> None:
    large = json.dumps({"type": "hello", "token": TOKEN, "session": "x" * MAX_CONTROL})
    with pytest.raises(JoinError, match="a first hello"):
        guard(token=TOKEN).check_hello(large)


@pytest.mark.parametrize("both", [{}, {"token": TOKEN}])
def test_access_accepts_a_signed_token_in_the_same_places(both: dict[str, str]) -> None:
    g = guard(jwt_key=SECRET, **both)
    signed = jwt.encode({"session": "show"}, SECRET, "HS256")
    bound = Grant(frozenset({"show"}))
    assert g.request(f"/ws?session=show&token={signed}", {}) == bound
    assert g.request("/ws", {"authorization": f"Bearer {signed}"}) == bound
    assert g.request("/ws", {}, later=True) is None
    assert g.check_hello(json.dumps({"type": "hello", "token": signed})) == bound


def test_access_by_the_service_token_is_unlimited_beside_a_key() -> None:
    g = guard(jwt_key=SECRET, token=TOKEN)
    assert g.request(f"/ws?token={TOKEN}", {}) == Grant()
    with pytest.raises(
        JoinError, match=r"that of this service .* or a JWT of this service's key .*, got another one"
    ):
        g.request("/ws?token=another", {})


def test_access_says_why_a_signed_token_is_refused() -> None:
    old = jwt.encode({"exp": 1}, SECRET, "HS256")
    with pytest.raises(JoinError, match=r"REALIZER_JWT_KEY\), got one that has expired") as refused:
        guard(jwt_key=SECRET).request(f"/ws?token={old}", {}, later=True)
    assert refused.value.status == 401
    assert old not in str(refused.value)


def test_access_without_a_token_setting_is_open() -> None:
    assert guard().request("/ws?token=anything", {})


@pytest.mark.parametrize(
    ("host", "headers", "origins", "welcome"),
    [
        ("127.0.0.1", {}, (), True),
        ("127.0.0.1", {"origin": "http://localhost:3000"}, (), True),
        ("127.0.0.1", {"origin": "http://[::1]:8765"}, (), True),
        ("127.0.0.1", {"origin": "https://evil.example"}, (), False),
        ("127.0.0.1", {"origin": "null"}, (), False),
        ("127.0.0.1", {"origin": "null"}, ("null",), True),
        # A name of the attacker's that points to this machine.
        ("127.0.0.1", {"origin": "http://evil.example:8765", "host": "evil.example:8765"}, (), False),
        ("127.0.0.1", {"origin": "http://localhost.evil.example"}, (), False),
        ("127.0.0.2", {"origin": "http://127.0.0.2:8765"}, (), True),
        ("127.0.0.2", {"origin": "http://evil.example:8765", "host": "evil.example:8765"}, (), False),
        ("0.0.0.0", {"origin": "http://face.example:8765", "host": "face.example:8765"}, (), True),
        ("0.0.0.0", {"origin": "http://evil.example", "host": "face.example:8765"}, (), False),
        ("0.0.0.0", {"origin": "http://localhost", "host": "face.example"}, (), False),
        ("0.0.0.0", {"origin": "https://evil.example"}, ("https://app.example/",), False),
        ("0.0.0.0", {"origin": "https://app.example"}, ("https://app.example/",), True),
        ("0.0.0.0", {"origin": "https://evil.example"}, ("*",), True),
        ("0.0.0.0", {"origin": "http://["}, (), False),
    ],
)
def test_access_refuses_pages_of_other_origins(
    host: str, headers: dict[str, str], origins: tuple[str, ...], welcome: bool
) -> None:
    g = guard(host=host, origins=origins, insecure=True)
    if welcome:
        assert g.request("/ws", headers)
        return
    with pytest.raises(JoinError, match="REALIZER_ORIGINS lets more in") as refused:
        g.request("/ws", headers)
    assert refused.value.status == 403


@pytest.mark.parametrize(
    ("host", "named", "welcome"),
    [
        ("127.0.0.1", None, True),
        ("127.0.0.1", "localhost.:8765", True),
        ("127.0.0.1", "192.0.2.1", False),
        ("127.0.0.1", "here:8765", True),
        ("127.0.0.2", "evil.example", False),
        ("0.0.0.0", "here:8765", False),
        ("0.0.0.0", "192.0.2.1:8765", True),
        ("::", "[2001:db8::1]:8765", True),
        ("192.0.2.1", "192.0.2.1:8765", True),
        ("192.0.2.1", "192.0.2.2:8765", False),
        ("face.example", "FACE.example", True),
        ("0.0.0.0", "face.example.evil.example", False),
        ("0.0.0.0", "", False),
        ("0.0.0.0", "[x", False),
    ],
)
def test_access_check_host_knows_the_names_of_the_service(
    host: str, named: str | None, welcome: bool
) -> None:
    g, headers = guard(host=host, insecure=True), {} if named is None else {"host": named}
    if welcome:
        g.check_host(headers)
        return
    with pytest.raises(JoinError, match="REALIZER_HOSTS adds names") as refused:
        g.check_host(headers)
    assert refused.value.status == 403


def test_access_check_memory_refuses_when_memory_is_used_up() -> None:
    guard(max_memory=10**7).check_memory()
    full = guard(max_memory=64)
    with pytest.raises(JoinError, match=r"wanted at most 64 \(REALIZER_MAX_MEMORY sets it\)") as refused:
        full.check_memory()
    assert refused.value.status == 503


def test_access_settings_do_not_show_their_secrets() -> None:
    settings = Settings(
        token=TOKEN, stomp_password=TOKEN, jwt_key=SECRET, journal=f"redis://:{TOKEN}@127.0.0.1:6379/0"
    )
    assert TOKEN not in repr(settings)
    assert SECRET not in repr(settings)
    with pytest.raises(SettingsError, match=r"jwt_key: wanted an existing PEM file, .*, got something else"):
        Settings(jwt_key=SECRET[:31])
    with pytest.raises(SettingsError, match="setting token: wanted a word, got something else"):
        Settings(token=[TOKEN])  # type: ignore[arg-type]


@pytest.mark.parametrize("flaw", ["another key", "no key", "a pass phrase", "no certificate"])
def test_access_tls_names_the_files_of_a_bad_certificate(flaw: str, tmp_path: Path) -> None:
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    name = x509.Name([x509.NameAttribute(x509.NameOID.COMMON_NAME, "localhost")])
    private, other = ec.generate_private_key(ec.SECP256R1()), ec.generate_private_key(ec.SECP256R1())
    start = datetime(2020, 1, 1)
    made = x509.CertificateBuilder(name, name, private.public_key(), 1, start, start + timedelta(days=1))
    pem, lock = serialization.Encoding.PEM, serialization.BestAvailableEncryption(b"opensesame")
    kept = lock if flaw == "a pass phrase" else serialization.NoEncryption()
    written = (other if flaw == "another key" else private).private_bytes(
        pem, serialization.PrivateFormat.PKCS8, kept
    )
    cert.write_bytes(b"none" if flaw == "no certificate" else made.sign(private, SHA256()).public_bytes(pem))
    key.write_bytes(written)
    chosen = guard(tls_cert=cert, tls_key=None if flaw == "no key" else key)
    with pytest.raises(SettingsError, match=r"setting tls_cert: wanted .*cert\.pem and "):
        chosen.tls()


def test_access_with_a_token_disables_logging_of_requests() -> None:
    logger = logging.getLogger("websockets.server")
    before = logger.level
    try:
        guard(token=TOKEN)
        assert not logger.isEnabledFor(logging.DEBUG)
    finally:
        logger.setLevel(before)


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
