"""Files attached to Xface tasks: scripts, FAP and sound."""

import re
from dataclasses import dataclass
from html import unescape
from itertools import count

from bml_schema import Block, BMLError, read
from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.fap.fap_reader import read_fap
from realizer.behaviours.fap_values import MAX_BYTES
from realizer.behaviours.fap_visemes import expand_compound
from realizer.behaviours.keyframes import document_of
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.media import media_file
from realizer.behaviours.registry import VOCABULARY
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings, limit_hint
from realizer.server.documents.limits import size_error
from realizer.server.transports.xface.wire import Task

ROOM = 2**10  # bytes of a document beside its keyframes
_UNNAMED = "-without-id-"
_NUMBERS = count(1)  # of documents without an id
_NAME = re.compile(r"""<(?:[\w.-]+:)?bml(?=[\s/>])(?:[^<>"'/]|"[^<"]*"|'[^<']*')*""")
_ID = re.compile(r"""\sid\s*=\s*["']([^"'<]*)["']""")


@dataclass(frozen=True, slots=True)
class Script:
    """BML documents with the ids of their blocks."""

    text: str
    blocks: tuple[str, ...]


Attachment = FAPClip | Script | RealizerError | None


class MissingAttachment(RealizerError):
    """A task lacks its attachment."""


def prepare(task: Task, settings: Settings) -> FAPClip | Script | None:
    """Parse the attachment of a task, which may take a second. Return None if the task needs none.

    Args:
        settings: the folder that LOAD_FAP reads from, and the limit of documents.

    Raises:
        RealizerError: the attachment cannot be used.
    """
    match task.name, task.params:
        case "UPLOAD_FAP", (text, *_) if text.strip():
            return _clip(text, settings)
        case "LOAD_FAP", (name, *_) if name.strip():
            path = media_file(name, PlanningContext(media=settings.media))
            if (size := path.stat().st_size) > MAX_BYTES:
                raise RealizerError(f"wanted at most {MAX_BYTES} bytes of FAP text, got {size}")
            return _clip(path.read_bytes(), settings)
        case "UPLOAD_SCRIPT", (text, processor, *_) if processor.strip().upper() == "BML":
            script = text if "<" in text else unescape(text)
            if (large := size_error(script, settings)) is not None:
                raise RealizerError(large)
            items = _read(script, settings)
            if any(isinstance(item, Block) and item.id.startswith(_UNNAMED) for item in items):
                # The session would make other ids than `_read`, and the script would never end.
                script = _with_ids(script)
                items = _read(script, settings)
            blocks = tuple(item.id for item in items if isinstance(item, Block))
            if not blocks:
                wrong = next((str(item) for item in items if isinstance(item, BMLError)), "nothing")
                raise RealizerError(f"wanted BML, got {wrong}")
            return Script(script, blocks)
        case "UPLOAD_SCRIPT", (_, processor, *_):
            raise RealizerError(f"wanted the processor BML, got {processor.strip()[:60]!r}")
        case (("UPLOAD_FAP" | "LOAD_FAP" | "UPLOAD_SCRIPT"), _):
            raise MissingAttachment("wanted params, got none, or empty ones")
    return None


def _read(script: str, settings: Settings) -> list[Block | BMLError]:
    ids = (f"{_UNNAMED}{n}" for n in count(1))
    most, strict = settings.max_document, settings.strict_bml
    return list(read(script, VOCABULARY, max_bytes=most, strict_bml=strict, block_ids=ids))


def _with_ids(script: str) -> str:
    def tag(found: re.Match[str]) -> str:
        if (id := _ID.search(found[0])) is None:
            return f'{found[0]} id="script-{next(_NUMBERS)}"'
        return found[0] if id[1].strip() else found[0].replace(id[0], f' id="script-{next(_NUMBERS)}"')

    return _NAME.sub(tag, script)


def _clip(text: str | bytes, settings: Settings) -> FAPClip:
    most = settings.max_document - ROOM
    clip = expand_compound(read_fap(text))
    if not len(clip.values):
        raise RealizerError("wanted frames, got none")
    if len(clip.values) > 1 and clip.mask.any() and len(document_of(clip, "")) > most:
        got = f"{len(clip.values)} frames of {clip.mask.sum()} FAPs"
        words = f"wanted a file that plays as at most {most} bytes of BML, got {got}: send parts"
        raise RealizerError(f"{words} {limit_hint('max_document')}")
    return clip
