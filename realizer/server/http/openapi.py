"""The description of the HTTP interface in OpenAPI 3.1."""

from importlib.metadata import version
from typing import Any

from realizer.outputs.registry import OUTPUTS
from realizer.server.http.renderings import OPTIONS

TEXT = {"application/xml": {"schema": {"type": "string"}}, "text/plain": {"schema": {"type": "string"}}}
BODY = {"required": True, "description": "BML, or a text to speak", "content": TEXT}
ERROR = {
    "type": "object",
    "properties": {"error": {"type": "string", "description": "what was wanted, and what came"}},
}
# Attributes of a finding in an answer -> their types.
FINDING = {
    **{name: {"type": ["integer", "null"]} for name in ("line", "column")},
    **{name: {"type": "string"} for name in ("type", "id", "text", "help")},
}
FINDINGS = {"type": "array", "items": {"type": "object", "properties": FINDING}}
ACCEPTED = {"type": "object", "properties": {"session": {"type": "string"}}}
SESSION = {"name": "session", "in": "path", "required": True, "schema": {"type": "string"}}
PEER = {"name": "peer", "in": "path", "required": True, "schema": {"type": "integer"}}
# Options of the pictures of a WebRTC peer, as of the stream `video`.
VIDEO = ("character", "size", "fps", "camera", "light", "background")
DESCRIPTION = {
    "type": "object",
    "properties": {"type": {"enum": ["offer", "answer"]}, "sdp": {"type": "string"}},
}
OFFER = {
    "required": True,
    "description": "an offer with all its candidates",
    "content": {
        "application/json": {"schema": DESCRIPTION},
        "application/sdp": {"schema": {"type": "string"}},
    },
}


def description(prefix: str = "") -> dict[str, Any]:
    """Return the description, whose server is the application's own address with a prefix."""
    formats = [name.removeprefix(".") for name in OUTPUTS]
    files = {output.media_type: {"schema": {"type": "string"}} for output in OUTPUTS.values()}
    query = [_query("format", {"type": "string", "enum": formats, "default": "json"})]
    forms = {name: {"type": "string", "pattern": f"^({form.pattern})$"} for name, form in OPTIONS.items()}
    query += [_query(name, schema) for name, schema in forms.items()]
    video = [_query(name, {"type": "string"}) for name in VIDEO]
    seen = _query("seen", {"type": "integer"}, "send also the feedback after this seq")
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "BML realizer",
            "version": version("bml-realizer"),
            "description": "Send BML, get a talking face. Frames, sound and control messages go over the "
            "WebSocket at /ws, which /asyncapi.json describes.",
        },
        "servers": [{"url": prefix or "/"}],
        "components": {"securitySchemes": {"token": {"type": "http", "scheme": "bearer"}}},
        "security": [{}, {"token": []}],
        "paths": {
            "/realize": {"post": _operation("Make a file of a document", query, 200, files, BODY)},
            "/check": {"post": _operation("Find the faults of a document", [], 200, _json(FINDINGS), BODY)},
            "/sessions/{session}/bml": {
                "post": _operation("Play documents in a session", [SESSION], 202, _json(ACCEPTED), BODY)
            },
            "/sessions/{session}/feedback": {
                "get": _operation(
                    "Follow the feedback of a session: an event for each element",
                    [SESSION, seen], 200, {"text/event-stream": {"schema": {"type": "string"}}},
                )
            },
            "/sessions/{session}/webrtc": {
                "post": _operation(
                    "Answer the offer of a WebRTC peer, which gets picture and sound of a session; an offer "
                    "in SDP alone (WHEP) is answered by 201 and SDP",
                    [SESSION, *video], 200, _json(DESCRIPTION), OFFER,
                )
            },
            "/sessions/{session}/webrtc/{peer}": {
                "delete": _operation("Disconnect a WebRTC peer", [SESSION, PEER], 204, {})
            },
            "/sessions/{session}": {"delete": _operation("End a session", [SESSION], 204, {})},
        },
    }  # fmt: skip


def _query(name: str, schema: dict[str, Any], text: str = "") -> dict[str, Any]:
    found: dict[str, Any] = {"name": name, "in": "query", "schema": schema}
    return {**found, "description": text} if text else found


def _json(schema: dict[str, Any]) -> dict[str, Any]:
    return {"application/json": {"schema": schema}}


def _operation(
    summary: str,
    parameters: list[dict[str, Any]],
    status: int,
    content: dict[str, Any],
    body: dict[str, Any] | None = None,
) -> dict[str, Any]:
    done = {"description": "done", **({"content": content} if content else {})}
    operation: dict[str, Any] = {
        "summary": summary,
        "parameters": parameters,
        "responses": {str(status): done, "default": {"description": "refused", "content": _json(ERROR)}},
    }
    return {**operation, "requestBody": body} if body else operation
