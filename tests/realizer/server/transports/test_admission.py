"""Admission at the real transport: tokens, origins, TLS, rates, metrics and logs."""

from __future__ import annotations

import asyncio
import json
import logging
import re
import socket
import ssl
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import jwt
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidMessage, InvalidStatus

from realizer.core.settings import Settings, SettingsError
from realizer.server.documents import limits
from realizer.server.http import access
from realizer.server.http.access import Grant
from realizer.server.runtime import session_loop
from realizer.server.serve import Server
from tests.waiting import LIMIT

TOKEN = "Xk-secret-7"
SECRET = "a secret that is long enough to be one"
NOD = '<bml id="{}"><head id="n" lexeme="NOD"/></bml>'


def serving(test: Callable[[Server], Awaitable[None]], **settings: Any) -> None:
    async def run() -> None:
        async with asyncio.timeout(LIMIT), Server(Settings(port=0, voice="silent", **settings)) as server:
            await test(server)

    asyncio.run(run())


def signed(**claims: Any) -> str:
    return jwt.encode(claims, SECRET, "HS256")


async def read(url: str, headers: dict[str, str] | None = None) -> str:
    request = urllib.request.Request(url, headers=headers or {})

    def get() -> str:
        with urllib.request.urlopen(request) as answer:
            return str(answer.read().decode())

    return await asyncio.get_running_loop().run_in_executor(None, get)


async def welcomed(url: str, hello: dict[str, Any] | None = None, **options: Any) -> dict[str, Any]:
    """Return the answer of the service to a hello."""
    async with connect(url, **options) as socket:
        await socket.send(json.dumps({"type": "hello", **(hello or {})}))
        reply: dict[str, Any] = json.loads(await socket.recv())
        return reply


def test_admission_accepts_a_token_in_each_of_its_three_places() -> None:
    async def test(server: Server) -> None:
        ways: list[dict[str, Any]] = [
            {"url": f"{server.url}?token={TOKEN}"},
            {"url": server.url, "additional_headers": {"Authorization": f"Bearer {TOKEN}"}},
            {"url": server.url, "hello": {"token": TOKEN}},
        ]
        for way in ways:
            assert (await welcomed(**way))["type"] == "welcome"

    serving(test, token=TOKEN)


def test_admission_refuses_a_wrong_token_before_a_session_is_created() -> None:
    async def test(server: Server) -> None:
        for target in (f"{server.url}?token=x", server.url.replace("/ws", "/check")):
            with pytest.raises(InvalidStatus) as refused:
                await connect(target)
            assert refused.value.response.status_code == 401
            assert b"REALIZER_TOKEN" in refused.value.response.body
        reply = await welcomed(server.url, {"token": "x"})
        assert (reply["type"], reply["code"], reply["where"]) == ("error", "token", "hello.token")
        async with connect(server.url) as socket:
            await socket.send(NOD.format("b"))
            assert json.loads(await socket.recv())["code"] == "token"
            with pytest.raises(ConnectionClosed) as closed:
                await socket.recv()
            assert closed.value.rcvd is not None
            assert closed.value.rcvd.code == 1008
        assert json.loads(await read(f"{server.page}healthz"))["sessions"] == 0

    serving(test, token=TOKEN)


@pytest.mark.parametrize(
    ("query", "code", "says"),
    [
        ("?token=x", "token", "REALIZER_TOKEN"),
        (f"?session=a%20b&token={TOKEN}", "invalid", "session: wanted"),
    ],
)
def test_admission_tells_a_page_why_it_is_refused(query: str, code: str, says: str) -> None:
    """Browsers do not show the answer to a refused handshake."""

    async def test(server: Server) -> None:
        async with connect(server.url + query, origin="http://localhost:3000") as socket:  # type: ignore[arg-type]
            error = json.loads(await socket.recv())
            assert (error["type"], error["code"]) == ("error", code)
            assert says in error["message"]
            with pytest.raises(ConnectionClosed) as closed:
                await socket.recv()
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1008

    serving(test, token=TOKEN)


def test_admission_warns_once_of_wrong_tokens(caplog: pytest.LogCaptureFixture) -> None:
    async def test(server: Server) -> None:
        for _ in range(3):
            await welcomed(server.url, {"token": "x"})
            with pytest.raises(InvalidStatus):
                await connect(f"{server.url}?token=x")

    serving(test, token=TOKEN)
    (warning,) = [record.message for record in caplog.records if record.levelno == logging.WARNING]
    assert "REALIZER_TOKEN" in warning
    assert "127.0.0.1" in warning


def test_admission_does_not_wait_for_a_silent_client(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(access, "PATIENCE", 0.05)

    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            assert json.loads(await socket.recv())["code"] == "token"

    serving(test, token=TOKEN)


def test_admission_by_a_signed_token_is_for_its_sessions_only() -> None:
    async def test(server: Server) -> None:
        mine, all_ = signed(session=["show"]), signed()
        assert (await welcomed(f"{server.url}?session=show&token={mine}"))["session"] == "show"
        header = {"Authorization": f"Bearer {mine}"}
        assert (await welcomed(f"{server.url}?session=show", additional_headers=header))["session"] == "show"
        assert (await welcomed(f"{server.url}?session=show", {"token": mine}))["session"] == "show"
        assert (await welcomed(server.url, {"token": all_}))["type"] == "welcome"
        for target in (f"{server.url}?session=other&token={mine}", f"{server.url}?token={mine}"):
            with pytest.raises(InvalidStatus) as refused:
                await connect(target)
            assert refused.value.response.status_code == 403
            assert b"session: wanted one that the token is for (show)" in refused.value.response.body
        reply = await welcomed(f"{server.url}?session=other", {"token": mine})
        assert (reply["code"], reply["where"]) == ("token", "hello.session")
        async with connect(f"{server.url}?session=show&token={mine}") as socket:
            await socket.send(json.dumps({"type": "hello", "session": "other"}))
            error = json.loads(await socket.recv())
            assert (error["type"], error["where"]) == ("error", "hello.session")
        health = json.loads(await read(f"{server.page}healthz"))
        assert health["sessions"] <= 2  # show, and one without a name that may be ending

    serving(test, jwt_key=SECRET)


@pytest.mark.parametrize(
    ("claims", "says"),
    [({"exp": 1}, b"has expired"), ({"nbf": 10**10}, b"not valid yet"), ({"aud": "x"}, b"for somebody else")],
)
def test_admission_refuses_an_invalid_signed_token(claims: dict[str, Any], says: bytes) -> None:
    async def test(server: Server) -> None:
        with pytest.raises(InvalidStatus) as refused:
            await connect(f"{server.url}?token={signed(**claims)}")
        assert refused.value.response.status_code == 401
        assert says in refused.value.response.body

    serving(test, jwt_key=SECRET)


def test_admission_ends_with_the_token_of_one_client_only(monkeypatch: pytest.MonkeyPatch) -> None:
    async def test(server: Server) -> None:
        until = int(time.time()) + 1000
        async with connect(f"{server.url}?token={signed()}") as stays:
            monkeypatch.setattr(
                Grant, "seconds_left", property(lambda self: None if self.until is None else 0.0)
            )
            async with connect(f"{server.url}?token={signed(exp=until)}") as socket:
                with pytest.raises(ConnectionClosed) as closed:
                    await socket.recv()
            assert closed.value.rcvd is not None
            assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1008, "token: it has expired")
            await stays.send(json.dumps({"type": "hello"}))
            assert json.loads(await stays.recv())["type"] == "welcome"

    serving(test, jwt_key=SECRET)


def test_admission_to_metrics_is_not_for_the_token_of_a_session() -> None:
    async def test(server: Server) -> None:
        with pytest.raises(urllib.error.HTTPError, match="403"):
            await read(f"{server.page}metrics?token={signed(session='show')}")
        assert "realizer_sessions 0" in await read(f"{server.page}metrics?token={signed()}")

    serving(test, jwt_key=SECRET)


def test_admission_limits_the_sessions_of_an_address() -> None:
    async def test(server: Server) -> None:
        async with connect(f"{server.url}?session=a"), connect(f"{server.url}?session=b") as socket:
            with pytest.raises(InvalidStatus) as refused:
                await connect(f"{server.url}?session=c")
            assert refused.value.response.status_code == 429
            assert b"REALIZER_MAX_ADDRESS_SESSIONS" in refused.value.response.body
            async with connect(f"{server.url}?session=a"):  # to join is not to open
                pass
            await socket.send(json.dumps({"type": "hello"}))
            assert json.loads(await socket.recv())["type"] == "welcome"
        # Both sessions are named and stay; the one that was left first makes room.
        async with connect(f"{server.url}?session=c"):
            pass
        assert json.loads(await read(f"{server.page}healthz"))["sessions"] == 2

    serving(test, max_address_sessions=2)


def test_admission_without_memory_leaves_playing_sessions_alone(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    pages = tmp_path / "statm"
    pages.write_text("2 1 0")
    monkeypatch.setattr(limits, "MEMORY", pages)

    async def test(server: Server) -> None:
        async with connect(f"{server.url}?session=show") as socket:
            pages.write_text("2000000 1000000 0")
            for target in (server.url, server.url.replace("/ws", "/check")):
                with pytest.raises(InvalidStatus) as refused:
                    await connect(target)
                assert refused.value.response.status_code == 503
                assert b"REALIZER_MAX_MEMORY" in refused.value.response.body
            await socket.send(NOD.format("b"))
            while 'id="b:end"' not in str(await socket.recv()):
                pass
            async with connect(f"{server.url}?session=show&seen=1") as back:
                assert 'seq="2"' in str(await back.recv())

    serving(test, max_memory=64)


@pytest.mark.parametrize("seen", ["abc", "-1", "1.5", "9" * 16, "%C2%B2"])
def test_admission_refuses_a_bad_number_in_seen(seen: str) -> None:
    async def test(server: Server) -> None:
        with pytest.raises(InvalidStatus) as refused:
            await connect(f"{server.url}?session=show&seen={seen}")
        assert refused.value.response.status_code == 400
        assert b"seen: wanted the number of the last feedback that came" in refused.value.response.body

    serving(test)


def test_admission_logs_no_token_at_any_level(caplog: pytest.LogCaptureFixture) -> None:
    async def test(server: Server) -> None:
        quiet = logging.getLogger("websockets.client")
        quiet.setLevel(logging.INFO)  # this side is the client's own
        await welcomed(f"{server.url}?token={TOKEN}")
        await welcomed(server.url, additional_headers={"Authorization": f"Bearer {TOKEN}"})
        await welcomed(server.url, {"token": TOKEN})
        with pytest.raises(InvalidStatus):
            await connect(f"{server.url}?token=other-secret")
        await welcomed(f"{server.url}?token={mine}")
        await welcomed(server.url, {"token": mine})
        with pytest.raises(InvalidStatus):
            await connect(f"{server.url}?token={old}")
        quiet.setLevel(logging.NOTSET)

    mine, old = signed(), signed(exp=1)
    with caplog.at_level(logging.DEBUG):
        serving(test, token=TOKEN, jwt_key=SECRET)
    lines = [*caplog.messages, *map(str, (vars(record) for record in caplog.records))]
    assert any("joined" in line for line in lines)
    secrets = (TOKEN, SECRET, "other-secret", mine, old)
    assert not [line for line in lines if any(secret in line for secret in secrets)]


def test_admission_refuses_pages_of_other_origins() -> None:
    async def test(server: Server) -> None:
        with pytest.raises(InvalidStatus) as refused:
            await connect(server.url, origin="https://evil.example")  # type: ignore[arg-type]
        assert refused.value.response.status_code == 403
        assert b"REALIZER_ORIGINS" in refused.value.response.body
        for origin in ("http://localhost:3000", "https://app.example"):
            assert (await welcomed(server.url, origin=origin))["type"] == "welcome"

    serving(test, origins=("https://app.example",))


@pytest.mark.parametrize("host", ["127.0.0.1", "127.0.0.2", "0.0.0.0", "::"])
def test_admission_by_a_name_that_is_not_the_service_is_refused(host: str) -> None:
    """The name of an attacker may point to this machine: its pages have the service's own origin."""

    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
        try:
            probe.bind((host, 0))
        except OSError as error:
            pytest.skip(f"this machine has no {host}: {error}")

    async def test(server: Server) -> None:
        address = urlsplit(server.page).hostname
        ours = f"localhost:{server.port}"
        for name in ("evil.example", "127.0.0.1.evil.example", "localhost.evil.example", "[", ""):
            theirs = f"{name}:{server.port}"
            headers = {"Host": theirs, "Origin": f"http://{theirs}"}
            for path in ("", "healthz", "metrics", "faces/ada", "check"):
                with pytest.raises(urllib.error.HTTPError, match="403") as refused:
                    await read(server.page + path, headers)
                assert b"REALIZER_HOSTS" in refused.value.read()
            if name.endswith("example"):
                with pytest.raises(InvalidStatus) as closed:
                    await connect(f"ws://{theirs}/ws", host=address, port=server.port)
                assert closed.value.response.status_code == 403
        for name in (ours, f"{socket.gethostname()}:{server.port}", "face.example", "LOCALHOST", "[::1]:80"):
            assert json.loads(await read(f"{server.page}healthz", {"Host": name}))["status"] == "ok"
        assert (await welcomed(server.url))["type"] == "welcome"

    serving(test, host=host, hosts=("face.example",), insecure=True)


def test_admission_by_any_address_needs_a_service_on_all_of_them() -> None:
    async def test(server: Server) -> None:
        assert "ok" in await read(f"{server.page}healthz", {"Host": "192.0.2.1:8765"})

    async def local(server: Server) -> None:
        with pytest.raises(urllib.error.HTTPError, match="403"):
            await read(f"{server.page}healthz", {"Host": "192.0.2.1:8765"})

    serving(test, host="0.0.0.0", insecure=True)
    serving(local)


def test_admission_reads_a_flood_slowly_and_loses_nothing(all_at_once) -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            for k in range(8):
                await socket.send(json.dumps({"type": "ping", "id": str(k)}))
            replies = []
            while len([r for r in replies if r["type"] == "pong"]) < 8:
                replies.append(json.loads(await socket.recv()))
        assert [r["id"] for r in replies if r["type"] == "pong"] == [str(k) for k in range(8)]
        errors = [r for r in replies if r["type"] == "error"]
        assert {error["code"] for error in errors} == {"rate"}
        assert "REALIZER_MAX_RATE" in errors[0]["message"]

    serving(test, max_rate=2)


def test_admission_metrics_count_what_happened() -> None:
    async def test(server: Server) -> None:
        async with connect(server.url) as socket:
            await socket.send(NOD.format("b"))
            while 'id="b:end"' not in str(await socket.recv()):
                pass
            text = await read(f"{server.page}metrics")
        values = {name: float(n) for name, n in re.findall(r"^realizer_(\S+) (\S+)$", text, re.M)}
        assert values["sessions"] == values["connections"] == values["messages_total"] == 1
        assert values["blocks_playing"] == values["refused_total"] == values["failures_total"] == 0
        assert values["planning_seconds_count"] >= 1
        assert values["lateness_seconds_count"] >= 2
        assert 2**20 < values["memory_bytes"] < 2**40

    serving(test)


def test_admission_metrics_count_slow_steps_and_the_log_names_them(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(session_loop, "SLOW_STEP", 0.0)

    async def test(server: Server) -> None:
        async with connect(f"{server.url}?session=show") as socket:
            await socket.send(NOD.format("b"))
            while 'id="b:end"' not in str(await socket.recv()):
                pass
            steps = re.search(r"realizer_slow_step_seconds_count (\d+)", await read(f"{server.page}metrics"))
        assert steps is not None
        assert int(steps[1]) >= 3

    with caplog.at_level(logging.INFO):
        serving(test)
    records = [record for record in caplog.records if record.message.startswith("slow step: ")]
    size = len(NOD.format("b"))
    actions = {f"a message of {size} characters", "a document", "frames and feedback"}
    assert actions == {record.action for record in records}  # type: ignore[attr-defined]
    assert all(record.session == "show" for record in records)  # type: ignore[attr-defined]
    assert re.fullmatch(
        r"slow step: \d+ ms for a message .* \(session show, connections \d+\)", records[0].message
    )


def test_admission_to_metrics_needs_the_token() -> None:
    async def test(server: Server) -> None:
        with pytest.raises(urllib.error.HTTPError, match="401"):
            await read(f"{server.page}metrics")
        assert "refused_total 1" in await read(f"{server.page}metrics", {"Authorization": f"Bearer {TOKEN}"})

    serving(test, token=TOKEN)


def test_admission_to_what_computes_or_lists_needs_the_token() -> None:
    async def test(server: Server) -> None:
        asked = (
            *("faces/ada", "look.json", "vocabulary.json", "asyncapi.json", "examples.json", "nothing"),
            "pose.fap?set=%7B%22type%22:%22set%22%7D",
            "feeling.json?of=%7B%22name%22:%22joy%22%7D",
        )
        for path in asked:
            with pytest.raises(urllib.error.HTTPError, match="401") as refused:
                await read(server.page + path)
            assert refused.value.headers["WWW-Authenticate"] == "Bearer"
        header = {"Authorization": f"Bearer {TOKEN}"}
        assert json.loads(await read(f"{server.page}vocabulary.json", header))["elements"]
        assert json.loads(await read(f"{server.page}asyncapi.json?token={TOKEN}"))["asyncapi"]
        assert json.loads(await read(f"{server.page}healthz"))["status"] == "ok"

    serving(test, token=TOKEN)


def test_admission_lets_pages_of_allowed_origins_read_answers() -> None:
    async def test(server: Server) -> None:
        async def headers(path: str, **sent: str) -> Any:
            request = urllib.request.Request(server.page + path, headers=sent)
            get = asyncio.get_running_loop().run_in_executor
            with await get(None, urllib.request.urlopen, request) as answer:
                return answer.headers

        for origin in ("https://app.example", "http://localhost:3000"):
            for path in ("faces/ada", "healthz"):
                assert (await headers(path, Origin=origin))["Access-Control-Allow-Origin"] == origin
        module = await headers("bml-face.js", Origin="null")  # of a page that was opened as a file
        assert module["Access-Control-Allow-Origin"] == "*"
        for response in (await headers("healthz"), await headers("healthz", Origin="https://evil.example")):
            assert response["Access-Control-Allow-Origin"] is None
            assert response["Vary"] == "Origin"
            assert "frame-ancestors 'self'" in response["Content-Security-Policy"]
        with pytest.raises(urllib.error.HTTPError, match="403"):
            await read(f"{server.page}faces/ada", {"Origin": "https://evil.example"})

    serving(test, origins=("https://app.example",))


@pytest.fixture(scope="module")
def certificate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    folder = tmp_path_factory.mktemp("tls")
    cert, key = folder / "cert.pem", folder / "key.pem"
    command = (
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days 2 -subj /CN=localhost"
    )
    names = ["-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1"]
    try:
        subprocess.run(
            [*command.split(), *names, "-keyout", str(key), "-out", str(cert)],
            check=True,
            capture_output=True,
        )
    except FileNotFoundError:
        pytest.skip("needs openssl to make a certificate")
    return cert, key


def test_admission_with_a_certificate_uses_tls_for_everything(certificate: tuple[Path, Path]) -> None:
    cert, key = certificate

    async def test(server: Server) -> None:
        assert server.url.startswith("wss://")
        assert server.page.startswith("https://")
        assert server.transports[0].startup_lines[0] == f"listening on {server.url}"
        context = ssl.create_default_context(cafile=str(cert))
        assert (await welcomed(server.url, ssl=context))["type"] == "welcome"
        with pytest.raises(InvalidMessage):
            await welcomed(server.url.replace("wss", "ws"))

    serving(test, tls_cert=cert, tls_key=key)


def test_admission_names_a_certificate_without_key_before_it_opens(certificate: tuple[Path, Path]) -> None:
    async def test(server: Server) -> None:
        raise AssertionError("it opened")

    with pytest.raises(SettingsError, match=r"wanted certificates in PEM, .* got .*cert\.pem and none"):
        serving(test, tls_cert=certificate[0])


def test_admission_to_save_needs_a_token_for_all_sessions(tmp_path: Path) -> None:
    async def test(server: Server) -> None:
        save = {"type": "save", "kind": "expression", "name": "smirk", "content": "aus = { 12L = 1 }"}
        some, all_ = signed(session="show"), signed()
        replies = [
            await answer(f"{server.url}?session=show&token={token}", save) for token in (some, all_, all_)
        ]
        assert [reply.get("code", reply["type"]) for reply in replies] == ["edit", "saved", "conflict"]
        with pytest.raises(InvalidStatus):
            await answer(f"{server.url}?token=x", save)

    async def answer(url: str, message: dict[str, Any]) -> dict[str, Any]:
        async with connect(url) as socket:
            await socket.send(json.dumps(message))
            reply: dict[str, Any] = json.loads(await socket.recv())
            return reply

    serving(test, jwt_key=SECRET, edit=tmp_path)
