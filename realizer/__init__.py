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
    from realizer.core.errors import FaceError as FaceError
    from realizer.core.errors import RealizerError as RealizerError
    from realizer.core.errors import RenderError as RenderError
    from realizer.core.errors import ScheduleError as ScheduleError
    from realizer.core.errors import TableError as TableError
    from realizer.core.errors import VoiceError as VoiceError
    from realizer.core.settings import Settings as Settings
    from realizer.face.load import load_face as load_face
    from realizer.face.model import Face as Face
    from realizer.offline import realize as realize
    from realizer.offline import schedule as schedule
    from realizer.playback.player import Player as Player
    from realizer.realization import Realization as Realization
    from realizer.scheduling.timing import Schedule as Schedule
    from realizer.server.serve import serve as serve

__version__ = "0.1.0"

# The public names of each module. They are imported on first use: `import realizer` stays quick, and works
# without the optional parts.
_NAMES = {
    "core.errors": "FaceError RealizerError RenderError ScheduleError TableError VoiceError",
    "core.settings": "Settings",
    "face.load": "load_face",
    "face.model": "Face",
    "offline": "realize schedule",
    "playback.player": "Player",
    "realization": "Realization",
    "scheduling.timing": "Schedule",
    "server.serve": "serve",
}
_HOMES = {name: f"realizer.{module}" for module, names in _NAMES.items() for name in names.split()}
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'realizer' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
