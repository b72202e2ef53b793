"""Division of a script into runs of text with one prosody, with the places of marks among the words."""

from dataclasses import dataclass, replace

from realizer.speech.ssml import Break, Mark, Script
from realizer.speech.ssml_prosody import PLAIN, Prosody
from realizer.speech.words import PlacedMark, words_in


@dataclass(frozen=True, slots=True)
class ProsodyRun:
    """Text with one prosody.

    Attributes:
        text: plain; may be empty if the script ends in a pause.
        words: of the text, in order.
        prosody: of the text.
        pause: seconds of silence before it.
    """

    text: str
    words: tuple[str, ...]
    prosody: Prosody = PLAIN
    pause: float = 0.0


def runs(script: Script) -> tuple[tuple[ProsodyRun, ...], tuple[PlacedMark, ...]]:
    """Divide a script at each <break>, and where <prosody> begins or ends; <sub> is read by its alias.

    hibari does not support other SSML elements: their text is spoken.
    """
    found: list[ProsodyRun] = []
    marks: list[PlacedMark] = []
    manners = [PLAIN]  # of the open tags, outermost first
    hidden = 0  # depth inside <sub>
    count = 0  # of words before
    text, pause = "", 0.0

    def close() -> None:
        nonlocal text, pause, count
        if text.strip() or pause:
            words = tuple(word for word, _ in words_in(text))
            found.append(ProsodyRun(text, words, manners[-1], pause))
            count += len(words)
            text, pause = "", 0.0

    for part in script.parts:
        if isinstance(part, str):
            text += "" if hidden else part
        elif isinstance(part, Mark):
            marks.append(PlacedMark(part.name, count + len(list(words_in(text))), False))
        elif isinstance(part, Break):
            if text.strip():
                close()
            pause += part.seconds
            marks = [replace(mark, paused=mark.paused or mark.word == count) for mark in marks]
        elif part.name == "prosody":
            if text.strip():
                close()
            if part.attributes is None:
                manners.pop()
            else:
                manners.append(manners[-1].within(dict(part.attributes)))
        elif part.name == "sub":
            if part.attributes is not None and not hidden:
                text += dict(part.attributes).get("alias", "")
            hidden += 1 if part.attributes is not None else -1
    close()
    return tuple(found), tuple(marks)
