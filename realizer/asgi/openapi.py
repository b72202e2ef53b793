"""The description of the routes as OpenAPI 3.1."""

from __future__ import annotations

from http import HTTPStatus
from typing import Any

from realizer.asgi.documents import QUERY
from realizer.outputs.registry import OUTPUTS
from realizer.server.http.jwt_tokens import Grant


async def openapi(request: Any, grant: Grant) -> Any:
    """Answer GET /openapi.json."""
    from starlette.responses import JSONResponse

    return JSONResponse(description())


def description() -> dict[str, Any]:
    """Return the description of the routes as OpenAPI 3.1."""
    text = {"schema": {"type": "string"}}
    body = {"required": True, "content": dict.fromkeys(("text/plain", "application/xml"), text)}
    session = {"name": "session", "in": "path", "required": True, **text}
    query = [{"name": n, "in": "query", **text} for n in ("format", *QUERY)]
    seen = {"name": "seen", "in": "query", "schema": {"type": "integer"}}
    error = {"description": "what was wanted, and what came", "content": {"application/json": {}}}

    def route(summary: str, status: int, parameters: list[Any], **more: Any) -> dict[str, Any]:
        answers = {str(status): {"description": HTTPStatus(status).phrase}, "400": error, "401": error}
        return {"summary": summary, "parameters": parameters, "responses": answers, **more}

    formats = " ".join(suffix.removeprefix(".") for suffix in OUTPUTS)
    return {
        "openapi": "3.1.0",
        "info": {"title": "bml-realizer", "version": "1", "description": "Send BML, get a face."},
        "paths": {
            "/realize": {
                "post": route(f"Play BML or a text into a file: {formats}", 200, query, requestBody=body)
            },
            "/check": {"post": route("Return every fault of BML", 200, [], requestBody=body)},
            "/sessions/{session}/bml": {
                "post": route("Send BML or a text to a session", 202, [session], requestBody=body)
            },
            "/sessions/{session}/feedback": {
                "get": route("Feedback as server-sent events", 200, [session, seen])
            },
            "/sessions/{session}": {"delete": route("End a session", 204, [session])},
        },
        "components": {"securitySchemes": {"token": {"type": "http", "scheme": "bearer"}}},
        "security": [{}, {"token": []}],
    }
