"""Send it BML, get a living face.

realize(text)   play documents without a clock: schedule, FAP frames, sound and feedback
schedule(text)  the sync times alone
Player          the blocks of a session; every call has the time as an argument
load_face(name) a face folder as arrays
serve(settings) the service
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from realizer.core.errors import (
        FaceError,
        RealizerError,
        RenderError,
        ScheduleError,
        TableError,
        VoiceError,
    )
    from realizer.core.settings import Settings
    from realizer.face.load import load_face
    from realizer.face.model import Face
    from realizer.offline import realize, schedule
    from realizer.playback.player import Player
    from realizer.realization import Realization
    from realizer.scheduling.timing import Schedule
    from realizer.server.serve import serve

__version__ = "0.1.0"

# The module of each public name. They are imported on first use: `import realizer` stays quick, and works
# without the optional parts.
_HOMES = {
    "Face": "realizer.face.model",
    "FaceError": "realizer.core.errors",
    "Player": "realizer.playback.player",
    "RealizerError": "realizer.core.errors",
    "Realization": "realizer.realization",
    "RenderError": "realizer.core.errors",
    "Schedule": "realizer.scheduling.timing",
    "ScheduleError": "realizer.core.errors",
    "Settings": "realizer.core.settings",
    "TableError": "realizer.core.errors",
    "VoiceError": "realizer.core.errors",
    "load_face": "realizer.face.load",
    "realize": "realizer.offline",
    "schedule": "realizer.offline",
    "serve": "realizer.server.serve",
}

__all__ = [
    "Face",
    "FaceError",
    "Player",
    "Realization",
    "RealizerError",
    "RenderError",
    "Schedule",
    "ScheduleError",
    "Settings",
    "TableError",
    "VoiceError",
    "load_face",
    "realize",
    "schedule",
    "serve",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'realizer' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
