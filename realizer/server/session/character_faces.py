"""The faces assigned to the characters of a session."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING

from realizer.animation.fap.conversion import FapMapping
from realizer.core.errors import FaceError, TableError
from realizer.core.settings import Settings
from realizer.face.fap_mapping import mapping_of

if TYPE_CHECKING:
    from realizer.face.model import Face

log = logging.getLogger(__name__)


class CharacterFaces:
    """The faces of characters, by the characters' indices.

    Attributes:
        assigned: index -> the face that a client requested, as the client named it.
    """

    def __init__(self, settings: Settings) -> None:
        self._settings = settings
        self.assigned: dict[int, str] = {}

    def check(self, name: str) -> None:
        """Check that a face is listed and can be loaded.

        Raises:
            FaceError: no such face, or it cannot be loaded. Clients get the text: it names no folder.
        """
        from realizer.face.load import face_name, list_faces

        known = [info.name for info in list_faces()]
        if face_name(name) not in known:
            raise FaceError(f"wanted one of {', '.join(known)}, got {name!r}")
        try:
            self._load(name)
            mapping_of(name, self._settings.mapping)
        except (FaceError, TableError) as error:
            log.warning("face %s: %s", name, error)
            raise FaceError(
                f"wanted a face that can be loaded, got {name!r}: it is damaged, see the log"
            ) from None

    def name(self, index: int) -> str:
        """Return the name of a character's face."""
        from realizer.face.load import face_name

        return face_name(self.assigned.get(index, self._settings.face))

    def of(self, index: int) -> Face:
        """Return the face of a character."""
        return self._load(self.name(index))

    def mapping(self, index: int) -> FapMapping:
        """Return the mapping from AUs to FAPs of a character's face."""
        return mapping_of(self.name(index), self._settings.mapping)

    def _load(self, name: str) -> Face:
        from realizer.face.load import load_face

        return load_face(name, deformer=self._settings.deformer)
