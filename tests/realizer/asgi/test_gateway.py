"""Tests of the access to the ASGI application, and of the application in another one."""

from __future__ import annotations

from typing import Any

import pytest

from realizer import asgi
from realizer.asgi import create_app
from realizer.client import ClientError, connect
from realizer.core.settings import Settings
from tests.realizer.asgi.served import LIMIT, NOD, httpx, serving


@pytest.mark.parametrize(
    ("headers", "status"),
    [({}, 401), ({"Authorization": "Bearer no"}, 401), ({"Authorization": "Bearer secret"}, 200)],
)
def test_token_is_required_if_there_is_one(headers: dict[str, str], status: int) -> None:
    with serving(create_app(Settings(voice="silent", token="secret"))) as place:
        for path in ("/check", "/realize"):
            answer = httpx.post(
                f"http://{place}{path}", content=NOD.format("b"), headers=headers, timeout=LIMIT
            )
            assert answer.status_code == status
        assert httpx.get(f"http://{place}/openapi.json").status_code == 200
        token = headers.get("Authorization", "Bearer no").removeprefix("Bearer ")
        if status == 200:
            with connect(f"ws://{place}/ws", token=token) as client:
                assert client.play(NOD.format("b")).status == "DONE"
        else:
            with pytest.raises(ClientError, match="token: wanted"), connect(f"ws://{place}/ws", token=token):
                pass


@pytest.mark.parametrize("headers", [{"Host": "evil.example"}, {"Origin": "https://evil.example"}])
def test_other_hosts_and_origins_are_refused(http: Any, headers: dict[str, str]) -> None:
    assert http.post("/check", content="Hi", headers=headers).status_code == 403


def test_application_can_be_mounted_in_fastapi() -> None:
    fastapi = pytest.importorskip("fastapi", reason="needs the extra test")
    outer = fastapi.FastAPI()
    outer.mount("/face", create_app(Settings(voice="silent")))

    @outer.get("/own")
    def own() -> dict[str, str]:
        return {"mine": "yes"}

    with serving(outer) as place, httpx.Client(base_url=f"http://{place}", timeout=LIMIT) as http:
        assert http.get("/own").json() == {"mine": "yes"}
        assert http.get("/face/healthz").json()["status"] == "ok"
        assert http.post("/face/realize", content=NOD.format("b")).json()["frames"] == 8
        with connect(f"ws://{place}/face/ws?session=s") as client:
            assert client.play(NOD.format("b")).status == "DONE"
            assert http.delete("/face/sessions/s").status_code == 204


def test_application_has_the_settings_of_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REALIZER_TOKEN", "from a variable")
    monkeypatch.setenv("REALIZER_VOICE", "silent")
    monkeypatch.delitem(vars(asgi), "app", raising=False)
    with serving(asgi.app) as place:
        assert httpx.post(f"http://{place}/check", content="Hi").status_code == 401
    monkeypatch.delitem(vars(asgi), "app")
    with pytest.raises(AttributeError, match="no attribute 'apps'"):
        _ = asgi.apps  # type: ignore[attr-defined]


def test_connections_of_an_address_are_limited() -> None:
    app = create_app(Settings(voice="silent", max_connections=1))
    with serving(app) as place, connect(f"ws://{place}/ws"):
        answer = httpx.post(f"http://{place}/sessions/s/bml", content=NOD.format("b"), timeout=LIMIT)
        assert answer.status_code == 429
        assert "REALIZER_MAX_CONNECTIONS" in answer.json()["error"]
