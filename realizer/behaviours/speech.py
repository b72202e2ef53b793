"""speech: the request to a voice, the times of the utterance, and the lips."""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass, replace
from weakref import WeakKeyDictionary
from xml.sax.saxutils import escape, quoteattr

import numpy as np

from bml_schema import AudioFile, Speech, Sync
from bml_schema.nodes import LANGUAGE, OWN, SSML
from realizer.animation.channel import Channel
from realizer.behaviours.kind import BehaviourKind, Fault, PlanningContext, claiming
from realizer.core.array_types import Float64
from realizer.core.errors import RealizerError
from realizer.scheduling.timing import Timing
from realizer.speech.recorded.given_times import given_times, with_times
from realizer.speech.utterance import MAX_TEXT, Recording, SpeechRequest, Utterance

# An attribute of <speech>: sentences about what of a text is not in its words.
UNSAID = f"{{{OWN}:text}}unsaid"
# Stiffness of a second of speech, which is that of a stiff gap of the face; shorter gaps are stiffer.
STIFFNESS = 1000.0
MIN_GAP = 0.01  # s; limits the stiffness of very short gaps
MIN_DURATION = 0.1  # s, for text without words such as a full stop
Style = tuple[float, float]  # of jaw and lips


@dataclass(frozen=True)
class SpokenContent:
    """The spoken content: inner SSML, its marks in order, and its language or None."""

    ssml: str
    marks: tuple[str, ...]
    language: str | None = None


def speech_request(node: Speech, context: PlanningContext) -> SpeechRequest | None:
    """Return the request for the SSML description of highest priority, or for the text with its marks.

    A description with an audio file replaces the voice. The text is then in another description, or in the
    sound clip; without text, the lips follow the sound alone.
    """
    recording, given = _recording(node, context), given_times(node)
    spoken = _spoken_content(node)
    if spoken is None and (recording is not None or given is not None):
        spoken = SpokenContent(escape((recording.text if recording else None) or ""), ())
    if spoken is None or len(spoken.ssml) > MAX_TEXT:
        return None
    language = spoken.language or node.unknown_attributes.get(LANGUAGE) or context.language
    if recording is not None and given is not None:
        recording, given = with_times(recording, given), None
    return SpeechRequest(spoken.ssml, spoken.marks, language=language, recording=recording, given=given)


def timing(node: Speech, context: PlanningContext) -> Timing:
    """Return the rigid timing of start, the sync points in the order of their times, and end.

    Raises:
        KeyError: there is no `context.utterances[node.id]` yet.
    """
    utterance = context.utterances[node.id]
    spoken = _spoken_content(node) or SpokenContent("", ())
    measured = {
        name: min(max(time, 0.0), utterance.duration)
        for name, time in utterance.marks.items()
        if name not in Speech.sync_points
    }
    if (given := given_times(node)) is not None:
        measured |= {name: min(time, utterance.duration) for name, time in given.marks.items()}
    # The time of a sync that the voice does not report is estimated from its position in the text.
    estimated = {name: part * utterance.duration for name, part in _places(node).items()}
    times = estimated | measured
    order = {name: i for i, name in enumerate((*spoken.marks, *estimated))}
    names = sorted(times, key=lambda name: (times[name], order.get(name, len(order))))
    points = ("start", *names, "end")
    gaps = np.diff([0.0, *(times[name] for name in names), max(utterance.duration, MIN_DURATION)])
    return Timing(points, gaps, gaps, np.ones(len(gaps)), rigid=True)


def stretch(node: Speech, context: PlanningContext) -> Timing | None:
    """Return `timing` that can stretch evenly within the limits of the voice, or None if it cannot."""
    least, most = context.utterances[node.id].stretch
    if least == most:
        return None
    natural = timing(node, context)
    gaps = natural.preferred
    # With stiffness inverse to length all gaps stretch evenly, as with one rate of speech.
    stiffness = STIFFNESS / np.maximum(gaps, MIN_GAP)
    return Timing(natural.points, gaps, gaps * least, stiffness, most=gaps * most)


def expand(node: Speech, times: Float64, context: PlanningContext) -> tuple[Channel, ...]:
    """Return the channels of lips, jaw and tongue, from the phonemes."""
    utterance, start = context.utterances[node.id], float(times[0])
    parts = utterance.sections or ((0.0, utterance),)
    style = (context.jaw if node.jaw is None else node.jaw, context.lips if node.lips is None else node.lips)
    lips = (channel for at, part in parts for channel in _lips(part, start + at, style))
    return tuple(channel.changed({"source": node.id}) for channel in lips)


# Utterance -> style, start, lips. A long text grows part by part, and the lips of earlier parts are reused.
_cached_lips: WeakKeyDictionary[Utterance, tuple[Style, float, tuple[Channel, ...]]] = WeakKeyDictionary()


def _lips(utterance: Utterance, start: float, style: Style) -> tuple[Channel, ...]:
    # Imported here, because it reads tables that a block without speech does not need.
    from realizer.animation.lips.lip_sync import LipStyle, lip_channels
    from realizer.speech.melody import with_loudness

    known, before, channels = _cached_lips.get(utterance, (None, start, ()))
    if known != style:
        phonemes = with_loudness(utterance)
        channels = lip_channels(phonemes, start, max(start, 0.0), LipStyle(*style))
    elif start != before:
        channels = tuple(channel.shifted(start - before) for channel in channels)
    _cached_lips[utterance] = style, start, channels
    return channels


def check(node: Speech, context: PlanningContext) -> tuple[Fault, ...]:
    """Return faults: no text, and too much for a voice, is fatal; text replaces a missing recording.

    What the voice could not speak as written is one fault that is not fatal.
    """
    spoken = _spoken_content(node)
    name = _audio_file(node)
    faults: tuple[Fault, ...] = ()
    if name is not None:
        from realizer.behaviours import audio  # most speech has none

        faults = audio.faults(name, context)
        if spoken is not None:
            faults = tuple(replace(f, text=f"{f.text}; the voice speaks the text instead") for f in faults)
    elif unread := [d for d in node.descriptions if d.content.strip().startswith("clip:")]:
        got = f'a description of type "{unread[0].type}" with {unread[0].content.strip()[:80]!r}'
        wanted = f'wanted <bmlt:audiofile fileName="clip:ID"/> in its description, got {got}'
        faults = (Fault("CANNOT_CREATE_BEHAVIOR", wanted),)
    given = given_times(node)
    if spoken is None and ((name is not None and not faults) or given is not None):
        spoken = SpokenContent("", ())
    if spoken is None and faults:
        words = f"speech: {faults[0].text}"
    elif spoken is None:
        words = f"speech: wanted <text>, a description of type {SSML} or a recording, got none"
    elif len(spoken.ssml) > MAX_TEXT:
        words = (
            f"speech: wanted a text of at most {MAX_TEXT} characters, got {len(spoken.ssml)}; "
            "say it in several behaviours"
        )
    else:
        unsaid = context.utterances[node.id].warnings if node.id in context.utterances else ()
        if left_out := node.unknown_attributes.get(UNSAID):
            unsaid = (left_out, *unsaid)
        unsaid = (*unsaid, *(given.warnings if given is not None else ()))
        if unsaid:
            words = f"speech: {'; '.join(unsaid)}"
            faults = (*faults, Fault("CUSTOM_ATTRIBUTE_NOT_SUPPORTED", words))
        return tuple(replace(fault, fatal=False) for fault in faults)
    return (Fault("CANNOT_CREATE_BEHAVIOR", words),)


def _spoken_content(node: Speech) -> SpokenContent | None:
    for description in sorted(node.descriptions, key=lambda d: -d.priority):
        if description.priority < 0 and node.text is not None:
            break  # the core form has priority 0
        if description.type == SSML and (spoken := _inside(description.content)) is not None:
            return spoken
    if node.text is None:
        return None
    parts = [
        f"<mark name={quoteattr(part.id)}/>" if isinstance(part, Sync) else escape(part)
        for part in node.text.parts
    ]
    return SpokenContent("".join(parts), node.marked, node.text.language or None)


def _audio_file(node: Speech) -> str | None:
    """Return the name of the recording: of the highest <bmlt:audiofile> among the descriptions."""
    for description in sorted(node.descriptions, key=lambda d: -d.priority):
        try:
            element = ElementTree.fromstring(description.content)
        except ElementTree.ParseError:
            continue
        if element.tag == AudioFile.tag:
            return element.get("fileName", "")
    return None


def _recording(node: Speech, context: PlanningContext) -> Recording | None:
    """Return the recording that replaces the voice, or None; `check` reports why."""
    name = _audio_file(node)
    if name is None:
        return None
    from realizer.behaviours import audio

    try:
        return audio.recording(name, context)
    except RealizerError:
        return None


def _inside(content: str) -> SpokenContent | None:
    """Return the content of <speak>, without namespaces, or None if it is not one element.

    The content comes from the parser, which allows no DTD and no entities.
    """
    try:
        speak = ElementTree.fromstring(content)
    except ElementTree.ParseError:
        return None
    for element in speak.iter():
        element.tag = element.tag.rpartition("}")[2]
    marks = tuple(mark.get("name", "") for mark in speak.iter("mark") if mark.get("name"))
    inner = escape(speak.text or "") + "".join(
        ElementTree.tostring(child, encoding="unicode") for child in speak
    )
    return SpokenContent(inner, marks, speak.get(LANGUAGE))


def _places(node: Speech) -> dict[str, float]:
    """Return sync of the core text -> its relative position in the text, 0..1."""
    if node.text is None:
        return {}
    length, places = 0, {}
    for part in node.text.parts:
        if isinstance(part, Sync):
            places[part.id] = length
        else:
            length += len(part)
    return {name: place / length if length else 0.0 for name, place in places.items()}


KINDS = (
    BehaviourKind(
        Speech,
        timing,
        expand,
        check,
        speech_request,
        stretch=stretch,
        sound=lambda node, context: context.utterances.get(node.id),
        claims=claiming("voice"),
        parameters={"volume": 100.0},
    ),
)
