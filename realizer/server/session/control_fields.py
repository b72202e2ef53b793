"""Lookup of the characters, action units, FAPs and emotions that control messages name."""

from collections.abc import Collection

from bml_schema import Emotion
from realizer.animation.axis import AU_NAMES
from realizer.behaviours import emotion
from realizer.behaviours.kind import PlanningContext
from realizer.core.errors import RealizerError
from realizer.playback.character import Cast
from realizer.protocol.messages.requests import EmotionFields, SetMessage
from realizer.server.documents.limits import MAX_CHARACTERS
from realizer.tables import faps


class FieldError(RealizerError):
    """A field of a control message, `where`, has an invalid value."""

    def __init__(self, where: str, text: str) -> None:
        super().__init__(text)
        self.where = where


def character_index(cast: Cast, character: str | None) -> int:
    """Return the index of a character of the session, which is added if it is new.

    Raises:
        FieldError: the session has too many characters.
    """
    if character not in (None, *cast.ids) and len(cast) >= MAX_CHARACTERS:
        raise FieldError("character", f"wanted at most {MAX_CHARACTERS} characters in a session")
    return cast.index_of(character)


def direct_values(message: SetMessage, before: Collection[str]) -> dict[str, float | None]:
    """Return the AUs (0..1) and FAPs (FAPU) that a message sets, by name; None releases one.

    Raises:
        FieldError: the message names an unknown AU or FAP.
    """
    rows = faps()
    released = [name for name in before if (message.aus if name in AU_NAMES() else message.faps) is None]
    values: dict[str, float | None] = dict.fromkeys(released)
    for name, value in (message.aus or {}).items():
        names = [n for n in (name, f"{name}L", f"{name}R") if n in AU_NAMES()]
        if not names:
            raise FieldError("aus", f"wanted an AU number, with L or R for one side, got {name[:80]!r}")
        values |= dict.fromkeys(names, value)
    movable = {row.name for row in rows[2:]}  # FAP 1 and 2 select visemes and expressions
    for name, value in (message.faps or {}).items():
        if name.isascii() and name.isdigit() and len(name) < 4 and 3 <= int(name) <= len(rows):
            name = rows[int(name) - 1].name
        if name not in movable:
            raise FieldError("faps", f"wanted the name or the number (3..68) of a FAP, got {name[:80]!r}")
        values[name] = value
    return values


def emotion_values(fields: EmotionFields | None) -> dict[str, float]:
    """Return the AUs of an emotion: name -> 0..1; {} for None.

    Raises:
        FieldError: the emotion is unknown or its values are invalid.
    """
    if fields is None:
        return {}
    node = Emotion(id="set", **fields.model_dump())
    text = node.fault() or next((fault.text for fault in emotion.check(node, PlanningContext())), "")
    if not text:
        try:
            return {target.name: value for target, value in emotion.values_of(node).items()}
        except ValueError as error:
            text = str(error)
    field, _, rest = text.partition(": ")
    if field in EmotionFields.model_fields:
        raise FieldError(f"emotion.{field}", rest)
    raise FieldError("emotion", text)
