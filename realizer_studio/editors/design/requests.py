"""The answers to the tab Design: JSON requests with the name of a tool."""

from __future__ import annotations

import json
from base64 import b64encode
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import asdict, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from realizer.core.errors import RealizerError, TableError
from realizer.core.json_reader import parse_json
from realizer.core.settings import Settings
from realizer.expressions.expression import Expression
from realizer.expressions.library import library_of
from realizer.expressions.timeline import Timeline, faults_of
from realizer.expressions.timeline_file import MAX_SECONDS, read_timeline
from realizer.face.load import face_folders, face_name

if TYPE_CHECKING:
    from realizer.tables.knowledge import Mood, Role

MAX_REQUEST = 1_000_000  # characters

_drawing = ThreadPoolExecutor(1, "pictures")


class Designer:
    """The tab Design of one page.

    Args:
        settings: of the service.
        may_save: whether this page may save; unused, because the tab saves by messages of its session.
    """

    def __init__(self, settings: Settings, may_save: bool) -> None:
        self._settings = settings

    def answer(self, message: str | bytes) -> str:
        """Return the answer to a request as JSON, or {"id", "error": text}.

        Args:
            message: {"id": number, "tool": a key of `TOOLS`, ...}.
        """
        number = None
        try:
            if len(message) > MAX_REQUEST:
                raise RealizerError(f"wanted at most {MAX_REQUEST} characters, got {len(message)}")
            request = parse_json(message)
            if not isinstance(request, dict):
                raise RealizerError("wanted a JSON object")
            number = request.get("id")
            if (tool := TOOLS.get(request.get("tool"))) is None:
                raise RealizerError(f"tool: wanted one of {', '.join(TOOLS)}")
            found = {"id": number, **tool(request, self._settings)}
            return json.dumps(found, ensure_ascii=False, separators=(",", ":"))
        except (RealizerError, ValueError, TypeError, KeyError, OverflowError) as error:
            text = error.args[0] if isinstance(error, KeyError) and error.args else error
            return json.dumps({"id": number, "error": str(text)})

    def close(self) -> None:
        """Do nothing: there are no resources."""


def timeline_of(request: Mapping[str, Any], settings: Settings) -> Timeline:
    """Return the timeline of a request.

    Raises:
        TableError: the timeline has faults; the message has a line for each.
    """
    timeline = read_timeline(json.dumps(request.get("timeline")).encode())
    if faults := faults_of(timeline, library_of(settings.library_folder)):
        raise TableError("\n".join(faults))
    return timeline


def _library(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    """Return all expressions, or those that match `find`: words, or action units such as "1+2+12L"."""
    from realizer.tables.knowledge import knowledge
    from realizer.tables.lexemes import read_aus
    from realizer_studio.analysis.expression_search import by_action_units, by_meaning

    library = library_of(settings.library_folder)
    expressions = list(library.values())
    query = str(request.get("find", "")).strip()
    parts = query.upper().replace("AU", " ").replace(",", " ").replace("+", " ").split()
    if parts and all(part.rstrip("LR").isdigit() for part in parts):
        units = read_aus(dict.fromkeys(parts, 1.0), "find")
        expressions = [match for match, _ in by_action_units(units, expressions)]
    elif query:
        expressions = [match for match, _ in by_meaning(query, expressions)]
    moods = sorted({mood.like for mood in knowledge().moods.values()})
    return {"expressions": [_row(expression) for expression in expressions], "moods": moods}


def _row(expression: Expression) -> dict[str, Any]:
    """Return an expression for the page, with the version of its file but without the path."""
    row = expression.to_json()
    file = expression.file
    row |= {name: row[name]["seconds"] for name in ("onset", "apex", "offset")}
    row |= {"file": None if file is None else file.stem, "units": expression.units}
    if file is not None:
        from realizer.server.runtime.edit_folder import version_of

        row |= {"source": expression.source, "version": version_of(file.read_bytes())}
    return row


def _check(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    """Return advice about a timeline, missing expressions, and its duration."""
    from itertools import islice

    from realizer.checking.timeline_advice import missing_companions, timeline_advice
    from realizer.expressions.timeline import duration_of, remarks, spans, visible_spans

    library = library_of(settings.library_folder)
    timeline = _distinct(timeline_of(request, settings))
    positions = {span.place: (span.track, span.entry) for span in visible_spans(timeline, library)}
    role: Role = "listener" if request.get("role") == "listener" else "speaker"
    advice = islice(timeline_advice(timeline, library, role, mood_of(request)), 200)
    return {
        "duration": duration_of(timeline, library),
        "spans": [
            [[s.start, s.reached, s.left, s.end] for s in spans(track, library)] for track in timeline.tracks
        ],
        "advice": [
            {
                "place": positions.get(one.id),
                "text": one.text,
                "hint": one.hint.replace(
                    "`realizer enrich` adds what is missing", "the dashed block adds it"
                ),
                "impossible": one.is_impossible,
            }
            for one in advice
        ],
        "remarks": remarks(timeline),
        "companions": [one._asdict() for one in missing_companions(timeline, library)],
    }


def _distinct(timeline: Timeline) -> Timeline:
    """Return a timeline with unique names of tracks, to which advice refers."""
    names = Counter(track.name for track in timeline.tracks)
    tracks = (
        track if names[track.name] == 1 else replace(track, name=f"{track.name} ({number})")
        for number, track in enumerate(timeline.tracks, 1)
    )
    return replace(timeline, tracks=tuple(tracks))


def mood_of(request: Mapping[str, Any]) -> Mood | None:
    """Return the mood of a request, or None; raises KeyError for an unknown name."""
    from realizer.tables.knowledge import knowledge

    return knowledge().mood(str(request["mood"])) if request.get("mood") else None


def _frames(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    from realizer_studio.editors.design.frames import expression_frame, timeline_frames

    if "aus" in request:
        return expression_frame(request, settings)
    return timeline_frames(request, timeline_of(request, settings), settings)


def _open(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    from realizer_studio.editors.design.documents import open_file

    return asdict(open_file(str(request.get("text", "")), settings))


def _enrich(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    from realizer_studio.editors.design.documents import enrich_text

    listener = request.get("role") == "listener"
    return asdict(enrich_text(str(request.get("text", "")), settings, mood_of(request), listener=listener))


def _export(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    from realizer_studio.editors.design.documents import export

    timeline = timeline_of(request, settings)
    return {"text": export(timeline, str(request.get("form")), settings, _says(request))}


def _sound(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    """Return the sound of speeches as int16 in base64, and its rate in Hz."""
    from realizer.outputs.wav import RATE
    from realizer_studio.editors.design.documents import sound

    samples = sound(_says(request), settings).astype("<i2").tobytes()
    return {"rate": RATE, "data": b64encode(samples).decode()}


def _says(request: Mapping[str, Any]) -> list[tuple[float, str]]:
    says = [(float(start), str(text)) for start, text in request.get("says") or ()]
    if not all(0 <= start <= MAX_SECONDS for start, _ in says):
        raise ValueError(f"says: wanted starts of 0..{MAX_SECONDS:g} s")
    return says


def _pictures(request: Mapping[str, Any], settings: Settings) -> dict[str, Any]:
    """Return pictures of all expressions as a WebP in base64; {"drawing": true} while they are drawn."""
    face = str(request.get("face") or settings.face)
    if face_name(face) not in face_folders():
        raise ValueError(f"face: wanted one of {', '.join(face_folders())}, got {face[:80]!r}")
    drawn = _sheet(face, settings, library_of(settings.library_folder).edition)
    return {"picture": b64encode(drawn.result()).decode()} if drawn.done() else {"drawing": True}


@lru_cache(8)
def _sheet(face: str, settings: Settings, edition: int) -> Future[bytes]:
    """Begin to draw the expressions of an edition of the library, in another thread."""
    from realizer_studio.editors.design.frames import sheet

    return _drawing.submit(sheet, face, settings)


TOOLS: Mapping[Any, Callable[[Mapping[str, Any], Settings], dict[str, Any]]] = {
    "library": _library,
    "check": _check,
    "frames": _frames,
    "open": _open,
    "enrich": _enrich,
    "export": _export,
    "sound": _sound,
    "pictures": _pictures,
}
