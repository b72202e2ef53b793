"""Send it BML, get a living face.

realize(source)   play BML, a text or files without a clock: frames, pictures, sound, feedback, files
schedule(source)  the sync times alone
check(source)     every fault, with line, column and help
enrich(text)      BML with expressions from the knowledge base
spoken_text(text) what a voice is given of a text with Markdown, stage directions, emoji and numbers
emotion(word)     the FAPs of an emotion
voices(), faces() what there is
load_face(name)   a face folder or a GLB head as arrays
Player            the blocks of a session; every call has the time as an argument
serve(settings)   the service; `realizer.client.connect` connects to one
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bml_schema import BMLError as BMLError
    from realizer import client as client
    from realizer.checking.finding import Finding as Finding
    from realizer.checking.source import check as check
    from realizer.core.errors import FaceError as FaceError
    from realizer.core.errors import RealizerError as RealizerError
    from realizer.core.errors import RenderError as RenderError
    from realizer.core.errors import ScheduleError as ScheduleError
    from realizer.core.errors import TableError as TableError
    from realizer.core.errors import UnknownNameError as UnknownNameError
    from realizer.core.errors import VoiceError as VoiceError
    from realizer.core.settings import Settings as Settings
    from realizer.emotions.chosen import emotion as emotion
    from realizer.emotions.profile import Profile as Profile
    from realizer.enrichment import enrich as enrich
    from realizer.face.load import FaceInfo as FaceInfo
    from realizer.face.load import list_faces as faces  # noqa: F401
    from realizer.face.load import load_face as load_face
    from realizer.face.model import Face as Face
    from realizer.offline import realize as realize
    from realizer.offline import schedule as schedule
    from realizer.playback.player import Player as Player
    from realizer.result import Realization as Realization
    from realizer.scheduling.timing import Schedule as Schedule
    from realizer.server.serve import serve as serve
    from realizer.speech.registry import VoiceInfo as VoiceInfo
    from realizer.speech.registry import voices as voices
    from realizer.text.spoken import spoken_text as spoken_text

__version__ = "0.3.0"

# The public names of each module, NAME or NAME=ATTRIBUTE, imported on first use: `import realizer` stays
# quick, and works without the optional parts.
_NAMES = {
    "bml_schema": "BMLError",
    "realizer": "client",
    "realizer.checking.finding": "Finding",
    "realizer.checking.source": "check",
    "realizer.core.errors": "FaceError RealizerError RenderError ScheduleError TableError UnknownNameError "
    "VoiceError",
    "realizer.core.settings": "Settings",
    "realizer.emotions.chosen": "emotion",
    "realizer.emotions.profile": "Profile",
    "realizer.enrichment": "enrich",
    "realizer.face.load": "FaceInfo faces=list_faces load_face",
    "realizer.face.model": "Face",
    "realizer.offline": "realize schedule",
    "realizer.playback.player": "Player",
    "realizer.result": "Realization",
    "realizer.scheduling.timing": "Schedule",
    "realizer.server.serve": "serve",
    "realizer.speech.registry": "VoiceInfo voices",
    "realizer.text.spoken": "spoken_text",
}
_HOMES = {
    name.partition("=")[0]: (module, name.rpartition("=")[2])
    for module, names in _NAMES.items()
    for name in names.split()
}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'realizer' has no attribute {name!r}")
    module, attribute = _HOMES[name]
    is_package = module == "realizer"
    value = import_module(f"realizer.{name}") if is_package else getattr(import_module(module), attribute)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
