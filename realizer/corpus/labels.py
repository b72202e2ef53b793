"""Changes of the labels of a recording."""

from collections.abc import Iterable
from dataclasses import replace

from realizer.corpus.recording import Annotation, CorpusError, Recording

Spans = Iterable[tuple[float, float, str]]


def change(recording: Recording, annotator: str, added: Spans = (), removed: Spans = ()) -> Recording:
    """Return a recording without and with segments of an annotator, in order of time.

    Segments are (start, end, expression), in seconds. One that is removed may be half a frame off.

    Raises:
        CorpusError: a segment that is no segment, is not there, lies behind the end, or overlaps another one
            of the same expression.
    """
    labels, slack = list(recording.labels), 0.5 / recording.fps + 1e-6
    for start, end, text in removed:
        same = [one for one in labels if (one.text, one.by) == (text, annotator)]
        near = [one for one in same if abs(one.start - start) <= slack and abs(one.end - end) <= slack]
        if not near:
            there = ", ".join(f"{one.start:g} to {one.end:g}" for one in same) or "none"
            raise CorpusError(
                f"{recording.name}: wanted a segment of {text!r} by {annotator!r} to remove, got "
                f"{start:g} to {end:g}; there are {there}"
            )
        labels.remove(near[0])
    last = recording.frames / recording.fps if recording.has_frames else float("inf")
    for start, end, text in added:
        try:
            new = Annotation(start, end, text.strip(), annotator)
        except ValueError as error:
            raise CorpusError(f"{recording.name}: {error}") from None
        if end > last + slack:
            raise CorpusError(f"{recording.name}: wanted an end up to {last:g} s, got {end:g}")
        for one in labels:
            if (one.text, one.by) == (new.text, new.by) and one.start < end and start < one.end:
                raise CorpusError(
                    f"{recording.name}: wanted a segment beside that of {one.start:g} to {one.end:g}, got "
                    f"{start:g} to {end:g}; remove that one first"
                )
        labels.append(new)
    return replace(recording, labels=tuple(sorted(labels, key=lambda one: (one.start, one.end))))
