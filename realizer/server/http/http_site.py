"""The HTTP site on the service's port: page, tools, faces as GLB."""

import functools
import hashlib
import json
import logging
import mimetypes
import re
from collections.abc import Callable
from importlib.resources import as_file, files
from pathlib import Path
from urllib.parse import parse_qs

import numpy as np
from starlette.responses import PlainTextResponse, RedirectResponse, Response

from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.server.http.page_tools import ToolError, UnknownName, export_pose, preview_emotion
from realizer.server.http.vocabulary import vocabulary

log = logging.getLogger(__name__)

JSON = "application/json; charset=utf-8"
GLB = "model/gltf-binary"
BYTES = "application/octet-stream"
NOT_BUILT = """The page was not bundled when this package was built.
Build it where npm is on the PATH: pip install -e . in the checkout, or install a wheel.
The WebSocket at /ws works without it.
"""
# No page of another origin may show an answer in a frame.
FRAMES = "frame-ancestors 'self'"
# The page loads nothing from other hosts, and opens no other connections than WebSockets.
POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; media-src 'self' blob:; "
    f"style-src 'self' 'unsafe-inline'; connect-src 'self' ws: wss:; {FRAMES}"
)
# Pages of mkdocs have scripts in them, and search in a worker.
DOCUMENTATION_POLICY = (
    "default-src 'self'; script-src 'self' 'unsafe-inline'; worker-src 'self' blob:; "
    f"img-src 'self' data:; style-src 'self' 'unsafe-inline'; {FRAMES}"
)
NO_DOCUMENTATION = """The documentation has not been built.
Build it in a checkout: pip install -e '.[docs]' && python -m mkdocs build
"""
REVALIDATED = {"Cache-Control": "no-cache"}
NAME = re.compile(r"[a-z0-9_-]{1,64}")  # in a URL


class HttpSite:
    """The answers to GET requests.

    Args:
        settings: of the service; the page begins with its light and background.
    """

    def __init__(self, settings: Settings | None = None) -> None:
        self._settings = settings or Settings()
        self._static = files("realizer.server").joinpath("static")
        self._documentation = files("realizer.server").joinpath("docs")
        self._routes: dict[str, Callable[[dict[str, str]], Response]] = {
            "/": lambda asked: self._file("index.html"),
            "/asyncapi.json": lambda asked: _json(asyncapi()),
            "/examples.json": lambda asked: _json(_examples()),
            "/vocabulary.json": lambda asked: _json(vocabulary()),
            "/feeling.json": lambda asked: _json(preview_emotion(asked.get("of", ""))),
            "/look.json": self._look,
            "/mirror": lambda asked: Response(_mirror(asked.get("light", "")), media_type=BYTES),
            "/background": self._background,
            "/pose.fap": self._pose,
        }

    def is_public(self, path: str) -> bool:
        """Return whether anybody may get what is at a path: page, documentation."""
        return path in ("/", "/docs") or path.startswith("/docs/") or path[1:] in self._names

    def answer(self, target: str, known: str = "") -> Response:
        """Return the response to `GET target`. May block while a face is loaded for the first time.

        Args:
            known: the header If-None-Match, the tags of faces that the client has.
        """
        path, _, query = target.partition("?")
        asked = {name: values[-1] for name, values in parse_qs(query).items()}
        try:
            if path in self._routes:
                return self._routes[path](asked)
            if path == "/docs" or path.startswith("/docs/"):
                return self._document(path.removeprefix("/docs").removeprefix("/"))
            if path.startswith("/faces/"):
                glb, tag = _glb(_face(path.removeprefix("/faces/").removesuffix(".glb")))
                headers = {**REVALIDATED, "ETag": tag}
                if tag in known:
                    return Response(status_code=304, headers=headers)
                return Response(glb, headers=headers, media_type=GLB)
        except ToolError as error:
            return PlainTextResponse(f"{error}\n", error.status)
        except (RealizerError, OSError):
            log.exception("there is no answer to GET %s", path)
            return PlainTextResponse("an error of the service: its log says which\n", 500)
        return self._file(path[1:])

    @functools.cached_property
    def _names(self) -> frozenset[str]:
        """The names of the page's files, listed once: every request compares its path with them."""
        found = self._static.iterdir() if self._static.is_dir() else ()
        return frozenset(f.name for f in found if not f.name.startswith("."))

    def _look(self, asked: dict[str, str]) -> Response:
        face = _face(asked.get("face", "default"))
        return _json(_look(face, self._settings.light, self._settings.background))

    def _background(self, asked: dict[str, str]) -> Response:
        from realizer.render.backdrop import is_picture

        path = self._settings.background
        if path is None or not is_picture(path):
            return self._file("background")
        return Response(Path(path).read_bytes(), 200, REVALIDATED, _media_type(path))

    def _pose(self, asked: dict[str, str]) -> Response:
        face = asked.get("face")
        pose = export_pose(asked.get("set", ""), None if face is None else _face(face), self._settings)
        headers = {"Content-Disposition": 'attachment; filename="pose.fap"'}
        return Response(pose, headers=headers, media_type="text/x-fap")

    @functools.cached_property
    def _documents(self) -> frozenset[str]:
        """The names of the files of the documentation, below its folder; none if it was not built."""
        with as_file(self._documentation) as folder:
            return frozenset(f.relative_to(folder).as_posix() for f in folder.rglob("*") if f.is_file())

    def _document(self, name: str) -> Response:
        if not self._documents:
            return PlainTextResponse(NO_DOCUMENTATION, 404)
        if not name:
            # Links of a page are relative to its folder, which is /docs/.
            return RedirectResponse("/docs/index.html", 302)
        if name not in self._documents:
            return _missing(f"docs/{name}")
        body = self._documentation.joinpath(name).read_bytes()
        headers = {**REVALIDATED, "Content-Security-Policy": DOCUMENTATION_POLICY}
        return Response(body, headers=headers, media_type=_media_type(name))

    def _file(self, name: str) -> Response:
        """Return a file of the page. Only names in its folder are accepted, so that no path can leave it."""
        if name in self._names and (file := self._static.joinpath(name)).is_file():
            headers = {**REVALIDATED, "Content-Security-Policy": POLICY}
            return Response(file.read_bytes(), headers=headers, media_type=_media_type(name))
        if name == "index.html":
            return PlainTextResponse(NOT_BUILT, 503)
        return _missing(name)


def _missing(name: str) -> Response:
    words = f"/{name[:80]} is not here; there are / /ws /faces/NAME /healthz\n"
    return PlainTextResponse(words, 404)


def _media_type(name: str) -> str:
    media_type = mimetypes.guess_type(name)[0] or BYTES
    if media_type.startswith("text/") or media_type.endswith("svg+xml"):
        media_type += "; charset=utf-8"
    return media_type


def _json(text: str | bytes) -> Response:
    return Response(text, media_type=JSON)


def _face(name: str) -> str:
    """Return the name of a face in a URL if there is such a face, without a look at other folders."""
    from realizer.face.load import face_folders, face_name

    known = face_folders()
    if not NAME.fullmatch(name) or face_name(name) not in known:
        raise UnknownName(f"face: wanted one of {', '.join(known)}, got {name[:80]!r}")
    return name


def asyncapi() -> bytes:
    """Return the AsyncAPI document of the WebSocket, as JSON."""
    return files("realizer.server").joinpath("asyncapi.json").read_bytes()


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
    """Return the lights, as uniforms of `surface.glsl`, the camera and the backdrops of a face's pictures."""
    from realizer.face.load import load_face
    from realizer.render.backdrop import is_picture
    from realizer.render.cameras import camera_for
    from realizer.render.lamp_view import LampView
    from realizer.render.light import HEIGHT, preset, presets
    from realizer.render.surfaces import uniforms_of

    face = load_face(name)
    lights = {}
    for each in presets().values():
        values = uniforms_of(each, LampView(each.key.direction, *face.bounds))
        lights[each.name] = {
            "uniforms": {
                key: np.ravel(value).tolist() if np.ndim(value) else value for key, value in values.items()
            },
            "backdrop_middle": each.backdrop_middle,
            "backdrop_edge": each.backdrop_edge,
        }
    look = {
        "light": preset(light).name,
        "lights": lights,
        "mirror": HEIGHT,
        "background": "/background" if is_picture(background) else background,
        "camera": camera_for(face).to_json(),
    }
    return json.dumps(look, separators=(",", ":")).encode()


@functools.lru_cache(8)
def _mirror(light: str) -> bytes:
    """Return the texels of `mirrorMap` of surface.glsl: half floats, red, green, blue and 1."""
    from realizer.render.light import preset, presets
    from realizer.render.surfaces import mirrored_of

    if light not in presets():
        raise UnknownName(f"light: wanted one of {', '.join(presets())}, got {light[:80]!r}")
    levels = mirrored_of(preset(light))
    return np.insert(levels, 3, 1, axis=3).astype("<f2").tobytes()


@functools.lru_cache(8)
def _glb(name: str) -> tuple[bytes, str]:
    from realizer.face.load import load_face
    from realizer.server.http.face_glb import face_glb

    glb = face_glb(load_face(name))
    return glb, f'"{hashlib.sha256(glb).hexdigest()[:32]}"'
