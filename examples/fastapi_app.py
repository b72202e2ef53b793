"""The service inside your own FastAPI application: one process, one port.

  uvicorn --app-dir examples fastapi_app:app --port 8000

/ is your page, /face/ the realizer's, /face/ws its WebSocket, and /say makes films.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from fastapi import FastAPI, Response

import realizer
from realizer.asgi import create_app

face = create_app()
app = FastAPI(lifespan=face.router.lifespan_context)  # sessions end in order when the application does
app.mount("/face", face)


@app.get("/")
def page() -> Response:
    words = '<p>A face: <a href="/face/">open it</a>, or see <a href="/say?text=Hello+there">this</a>.</p>'
    return Response(words, media_type="text/html")


@app.get("/say")
def say(text: str) -> Response:
    """Return a short film. FastAPI runs it in a thread, so that sessions go on meanwhile."""
    with tempfile.TemporaryDirectory() as folder:
        film = realizer.realize(text).save(Path(folder) / "film.webp", size=(256, 256))
        return Response(film.read_bytes(), media_type="image/webp")
