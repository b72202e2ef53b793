"""The routes without a session: realizing, checking, the page and metrics."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Mapping
from dataclasses import fields
from http import HTTPStatus
from typing import Any

from realizer import pipeline
from realizer.asgi.gateway import Gateway, target_of
from realizer.behaviours.registry import VOCABULARY
from realizer.checking.source import check
from realizer.core.errors import UnknownFaceError
from realizer.core.options import PlayOptions
from realizer.core.settings import limit_hint
from realizer.face.load import is_path
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import output_for
from realizer.playback.scene_file import parse_scene
from realizer.server.http.jwt_tokens import Grant
from realizer.server.http.metrics import MEDIA_TYPE
from realizer.server.http.page_tools import lint
from realizer.server.runtime.session_registry import JoinError
from realizer.sources import documents_of, first_error

# Query of POST /realize -> what reads its value; other options are those of the service.
QUERY: Mapping[str, Callable[[str], Any]] = {
    "face": str,
    "voice": str,
    "fps": float,
    "seed": int,
    "camera": str,
    "light": str,
    "background": str,
    "size": lambda text: tuple(map(int, text.split("x"))),
    "at": float,
}
DRAWN = {f.name for f in fields(RenderSettings)}


class Documents:
    """The handlers of these routes."""

    def __init__(self, gateway: Gateway) -> None:
        self._gateway = gateway
        self._settings = gateway.settings

    async def realize(self, request: Any, grant: Grant) -> Any:
        """Answer POST /realize: play BML or a text, and return the file of the format."""
        from starlette.responses import Response

        body = await self._gateway.body_of(request)
        query = {name: v for name, v in request.query_params.items() if name != "token"}
        suffix = f".{query.pop('format', 'json').removeprefix('.').lower()}"
        async with self._gateway.working:
            content = await asyncio.to_thread(self._realize, body, suffix, query)
        return Response(content, media_type=output_for(f"x{suffix}").media_type)

    def _realize(self, body: bytes, suffix: str, query: Mapping[str, str]) -> bytes:
        output = output_for(f"x{suffix}")
        chosen = {name: _value(name, text) for name, text in query.items()}
        if is_path(chosen.get("face", "")):
            raise UnknownFaceError(f"face: wanted the name of a face, got {chosen['face']!r}")
        if re.fullmatch("#[0-9a-fA-F]{6}|transparent", chosen.get("background", "transparent")) is None:
            raise ValueError(f"background: wanted a colour or transparent, got {chosen['background']!r}")
        drawing = RenderSettings(**{name: chosen.pop(name) for name in list(chosen) if name in DRAWN})
        output.check(drawing)
        if max(drawing.size) > self._settings.max_size:
            raise JoinError(413, f"size: wanted {self._settings.max_size} {limit_hint('max_size')}")
        scene = None if self._settings.scene is None else parse_scene(self._settings.scene.read_text("utf-8"))
        play = self._settings.play_options(scene)
        voice = chosen.pop("voice", self._settings.voice)
        options = PlayOptions(**{f.name: getattr(play, f.name) for f in fields(play)} | chosen)
        documents = documents_of(body)
        played = pipeline.play([d.bml for d in documents], options, voice, self._settings.max_duration)
        if not played.schedules:
            raise first_error(documents, VOCABULARY, strict_bml=options.strict_bml)
        if not played.has_content:
            raise ValueError(played.refusals[0])
        output.check(drawing, played)
        return output.encode(played, drawing)

    async def check(self, request: Any, grant: Grant) -> Any:
        """Answer POST /check: return the faults of BML."""
        from starlette.responses import JSONResponse

        body = await self._gateway.body_of(request)
        async with self._gateway.working:
            found = await asyncio.to_thread(check, body, strict_bml=self._settings.strict_bml)
        names = ("line", "column", "type", "id", "text", "help")
        return JSONResponse([{name: getattr(finding, name) for name in names} for finding in found])

    async def lint(self, socket: Any) -> None:
        """Serve the WebSocket of the page's editor: send the faults of each text that arrives."""
        headers = dict(socket.headers)
        try:
            self._gateway.access.check_host(headers)
            self._gateway.access.request(target_of(socket), headers)
        except JoinError:
            await socket.close(1008)
            return
        await socket.accept()
        async for text in socket.iter_text():
            async with self._gateway.working:
                faults = await asyncio.to_thread(lint, text, self._settings)
            await socket.send_text(faults)

    async def page(self, request: Any, grant: Grant) -> Any:
        """Answer any other GET: the page, its tools, faces as GLB, health."""
        from starlette.responses import Response

        await self._gateway.ready()
        target, known = target_of(request), request.headers.get("if-none-match", "")
        answer = await asyncio.to_thread(self._gateway.site.answer, target, known)
        headers = {"Content-Type": answer.media_type, **dict(answer.headers)}
        return Response(answer.body, answer.status, headers)

    async def metrics(self, request: Any, grant: Grant) -> Any:
        """Answer GET /metrics."""
        from starlette.responses import Response

        if grant.sessions is not None:
            raise JoinError(HTTPStatus.FORBIDDEN, "metrics: wanted a token for all sessions")
        return Response((await self._gateway.ready()).metrics_text(), media_type=MEDIA_TYPE)


def _value(name: str, text: str) -> Any:
    if name not in QUERY:
        raise ValueError(f"{name}: wanted one of format, {', '.join(QUERY)}")
    try:
        return QUERY[name](text)
    except ValueError:
        raise ValueError(f"{name}: wanted a number or WIDTHxHEIGHT, got {text[:80]!r}") from None
