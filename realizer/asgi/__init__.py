"""The service as an ASGI application: `uvicorn realizer.asgi:app`, or mounted in another application.

`app` takes its settings from REALIZER_* variables; `create_app` takes others. It needs the extra `asgi`.
"""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator
from typing import Any

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings

__all__ = ["create_app"]


def __getattr__(name: str) -> Any:
    """Return `app`, made on first use: other modules can be imported without Starlette."""
    if name != "app":
        raise AttributeError(f"module 'realizer.asgi' has no attribute {name!r}")
    globals()["app"] = app = create_app(Settings.read())
    return app


def create_app(settings: Settings | None = None) -> Any:
    """Return the Starlette application of a service.

    Its sessions live in the event loop of the first request. They end with its lifespan, or with the process
    where a mounted application has none.

    Raises:
        RealizerError: Starlette is not installed.
    """
    try:
        from starlette.applications import Starlette
        from starlette.routing import Route, WebSocketRoute
    except ImportError:
        raise RealizerError("realizer.asgi needs Starlette: pip install 'bml-realizer[asgi]'") from None
    from realizer.asgi.documents import Documents
    from realizer.asgi.gateway import Gateway
    from realizer.asgi.openapi import openapi
    from realizer.asgi.sessions import Sessions

    gateway = Gateway(settings or Settings())
    documents, sessions, guarded = Documents(gateway), Sessions(gateway), gateway.guarded

    @contextlib.asynccontextmanager
    async def lifespan(app: Any) -> AsyncIterator[None]:
        yield
        await gateway.close()

    routes = [
        Route("/realize", guarded(documents.realize), methods=["POST"]),
        Route("/check", guarded(documents.check), methods=["POST"]),
        Route("/sessions/{session}/bml", guarded(sessions.send), methods=["POST"]),
        Route("/sessions/{session}/feedback", guarded(sessions.feedback), methods=["GET"]),
        Route("/sessions/{session}", guarded(sessions.delete), methods=["DELETE"]),
        Route("/openapi.json", guarded(openapi, public=True), methods=["GET"]),
        Route("/metrics", guarded(documents.metrics), methods=["GET"]),
        WebSocketRoute("/ws", sessions.websocket),
        WebSocketRoute("/check", documents.lint),
        Route("/{path:path}", guarded(documents.page, public=True), methods=["GET"]),
    ]
    return Starlette(routes=routes, lifespan=lifespan)
