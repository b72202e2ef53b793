"""Speech with faults: its words are brought where the parser reads them, and all else is named.

What a document wants spoken is spoken, whatever else in it is wrong.
"""

from typing import Any

from lxml import etree

from bml_schema.behaviours import Speech, SpeechText
from bml_schema.errors import CUSTOM_ATTRIBUTE_NOT_SUPPORTED, NOT_BML_1_0, Fault, did_you_mean, quoted
from bml_schema.node_schema import local, path_below
from bml_schema.nodes import CORE, DRAFTS, Description
from bml_schema.reading.element_reader import ElementReader
from bml_schema.reading.ssml import MARKS
from bml_schema.reading.undeclared_prefixes import remove_element

_MOST = 50  # faults of one speech that are reported
_UNREAD = "unread"  # the tag of elements of which only the content stays


Faults = dict[Any, list[Fault]]


def rescue(root: Any, reader: ElementReader) -> Faults:
    """Bring the words of a document into the form of BML 1.0; return speech -> what was wrong."""
    faults = _find_speech(root, reader)
    for speech in list(root.iter("{*}speech")):
        if reader.tag(speech) == Speech.tag and (wrong := _mend_speech(speech, reader)):
            faults.setdefault(speech, []).extend(wrong)
    return faults


def _find_speech(root: Any, reader: ElementReader) -> Faults:
    """Move a speech inside another element behind it, and read unknown elements with a <text> as speech."""
    faults: Faults = {}
    for element in list(root.iter("{*}text", "{*}speech")):
        speech = element if local(element.tag) == "speech" else element.getparent()
        if speech is None or speech is root or speech in faults:
            continue
        around = _around(speech, root)
        tag, name = reader.tag(speech), local(str(speech.tag))
        if (tag != Speech.tag and tag in reader.vocabulary) or any(
            local(str(e.tag)) in ("description", "speech", "text") for e in around
        ):
            continue
        if tag != Speech.tag:
            speech.tag = _beside(root, "speech")
            faults[speech] = [Fault(f"<{name}> is read as <speech>", speech, NOT_BML_1_0)]
        if around:
            words = f"it is inside <{local(str(around[0].tag))}>, and read as if it came after it"
            faults.setdefault(speech, []).append(Fault(words, speech, NOT_BML_1_0))
            remove_element(speech)
            speech.tail = None
            around[-1].addnext(speech)
    return faults


def _around(speech: Any, root: Any) -> list[Any]:
    """Return the elements around a speech, from the inside, up to the child of the block or of <required>."""
    around: list[Any] = []
    for element in speech.iterancestors():
        if element is root or (local(str(element.tag)) == "required" and element.getparent() is root):
            break
        around.append(element)
    return around


def _mend_speech(speech: Any, reader: ElementReader) -> list[Fault]:
    """Join the words of a <speech> in one <text>, with the marks that can be read; return what was wrong."""
    faults: list[Fault] = []

    def note(text: str, element: Any) -> None:
        if len(faults) < _MOST:  # each costs a walk to find its path
            path = path_below(element, speech, "")
            faults.append(Fault(text, element, CUSTOM_ATTRIBUTE_NOT_SUPPORTED, path))

    for child in [child for child in speech if reader.tag(child) == Description.tag]:
        try:
            reader.description(child)
        except Fault as fault:
            note(f"{fault.text}; this description is left out", child)
            remove_element(child)
    content = [child for child in speech if reader.tag(child) != Description.tag]
    texts = [child for child in content if reader.tag(child) == SpeechText.tag]
    loose = "".join([speech.text or "", *(child.tail or "" for child in speech)]).strip()
    if len(content) < 2 and content == texts and not loose:
        return faults
    if len(texts) > 1:
        note(f"wanted one <text>, got {len(texts)}; all of them are spoken", speech)
    if loose:
        note(f"wanted elements, got the text {quoted(loose)}, put it into <text>; it is spoken", speech)
    for child in content:
        if reader.tag(child) == SpeechText.tag:
            child.tail = f" {child.tail or ''}"
        elif (name := local(str(child.tag))) not in MARKS:
            near = did_you_mean(name, ["text"])
            note(f"wanted <text>, got <{name}>{near}; its words are spoken", child)
    joined: Any = etree.Element(_beside(speech, "text"), texts[0].attrib if texts else {})
    joined.sourceline = speech.sourceline
    joined.text, speech.text = speech.text, None
    joined.extend(content)
    for child in speech:  # the words behind descriptions
        joined.append(etree.Element(_UNREAD))
        joined[-1].tail, child.tail = child.tail, None
    for child in texts:
        child.tag = _UNREAD
    etree.strip_tags(joined, _UNREAD)
    speech.insert(0, joined)
    return faults


def _beside(element: Any, name: str) -> str:
    """Return the tag of a core element in the namespace of an element of the document."""
    space = str(element.tag).rpartition("}")[0][1:]
    return f"{{{space}}}{name}" if space in (CORE, *DRAFTS) else name
