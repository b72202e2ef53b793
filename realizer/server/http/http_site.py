"""The HTTP site on the service's port: page, tools, faces as GLB, health."""

from __future__ import annotations

import functools
import json
import mimetypes
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files
from urllib.parse import parse_qs, unquote

from realizer.core.errors import FaceError, RealizerError
from realizer.core.settings import Settings
from realizer.server.http.page_tools import ToolError, export_pose, preview_emotion

JSON = "application/json; charset=utf-8"
TEXT = "text/plain; charset=utf-8"
NOT_BUILT = """The page was not bundled when this package was built.
Build it where npm is on the PATH: pip install -e . in the checkout, or install a wheel.
The WebSocket at /ws works without it.
"""
# The page loads nothing from other hosts, and opens no other connections than WebSockets.
POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; "
    "connect-src 'self' ws: wss:"
)


@dataclass(frozen=True)
class HttpResponse:
    """An HTTP response."""

    status: int
    media_type: str
    body: bytes
    headers: tuple[tuple[str, str], ...] = ()


class HttpSite:
    """The answers to GET requests.

    Args:
        health: returns what `/healthz` reports beside the status.
        settings: of the service; the page begins with its light and background.
    """

    def __init__(self, health: Callable[[], dict[str, object]], settings: Settings | None = None) -> None:
        self._health = health
        self._settings = settings or Settings()
        self._static = files("realizer.server").joinpath("static")

    def answer(self, target: str) -> HttpResponse:
        """Return the response to `GET target`. May block while a face is loaded for the first time."""
        path, _, query = target.partition("?")
        path = unquote(path)
        if path == "/healthz":
            return HttpResponse(200, JSON, json.dumps({"status": "ok", **self._health()}).encode())
        if path == "/asyncapi.json":
            return HttpResponse(200, JSON, files("realizer.server").joinpath("asyncapi.json").read_bytes())
        if path == "/examples.json":
            return HttpResponse(200, JSON, _examples())
        if path == "/vocabulary.json":
            from realizer.server.http.vocabulary import vocabulary

            return HttpResponse(200, JSON, vocabulary())
        asked = {name: values[-1] for name, values in parse_qs(query).items()}
        try:
            if path == "/feeling.json":
                return HttpResponse(200, JSON, preview_emotion(asked.get("of", "")).encode())
            if path == "/pose.fap":
                pose = export_pose(asked.get("set", ""), asked.get("face"), self._settings)
                headers = (("Content-Disposition", 'attachment; filename="pose.fap"'),)
                return HttpResponse(200, "text/x-fap", pose.encode(), headers)
            if path == "/look.json":
                name, settings = asked.get("face", "default"), self._settings
                return HttpResponse(200, JSON, _look(name, settings.light, settings.background))
            if path.startswith("/faces/"):
                glb = _glb(path.removeprefix("/faces/").removesuffix(".glb"))
                return HttpResponse(200, "model/gltf-binary", glb, (("Cache-Control", "no-cache"),))
        except ToolError as error:
            return HttpResponse(400, TEXT, f"{error}\n".encode())
        except FaceError as error:
            return HttpResponse(404, TEXT, f"{error}\n".encode())
        except RealizerError as error:
            return HttpResponse(500, TEXT, f"{error}\n".encode())
        return self._file("index.html" if path == "/" else path[1:])

    def _file(self, name: str) -> HttpResponse:
        """Return a file of the page. Only names in its folder are accepted, so that no path can leave it."""
        names = {f.name for f in self._static.iterdir()} if self._static.is_dir() else set()
        if name in names and not name.startswith("."):
            media_type = mimetypes.guess_type(name)[0] or "application/octet-stream"
            if media_type.startswith("text/") or media_type.endswith("svg+xml"):
                media_type += "; charset=utf-8"
            headers = (("Cache-Control", "no-cache"), ("Content-Security-Policy", POLICY))
            return HttpResponse(200, media_type, self._static.joinpath(name).read_bytes(), headers)
        if name == "index.html":
            return HttpResponse(503, TEXT, NOT_BUILT.encode())
        words = f"/{name} is not here; there are / /ws /faces/NAME /healthz\n"
        return HttpResponse(404, TEXT, words.encode())


@functools.cache
def _examples() -> bytes:
    from realizer.examples import examples

    rows = [
        {"name": name, "title": name.replace("-", " ").capitalize(), "bml": text}
        for name, text in examples().items()
    ]
    return json.dumps(rows, ensure_ascii=False).encode()


@functools.lru_cache(8)
def _look(name: str, light: str | None, background: str | None) -> bytes:
    """Return the light, the camera, and the wrinkles and highlights of a face, for viewers of its mesh."""
    from realizer.face.load import load_face
    from realizer.render.cameras import camera_for
    from realizer.render.eye_highlights import EyeHighlights
    from realizer.render.light import preset, presets
    from realizer.render.wrinkles import Wrinkles

    face, lights = load_face(name), preset(light)
    camera = camera_for(face)
    look = {
        "light": lights.to_json(),
        "lights": {name: lights.to_json() for name, lights in presets().items()},
        "background": background,
        "camera": camera.to_json(),
        "furrows": Wrinkles(face).to_json(),
        "glints": EyeHighlights(face, lights, camera.towards).to_json(),
    }
    return json.dumps(look, separators=(",", ":")).encode()


@functools.lru_cache(8)
def _glb(name: str) -> bytes:
    from realizer.face.glb import to_glb
    from realizer.face.load import load_face

    return to_glb(load_face(name))
