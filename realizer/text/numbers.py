"""Numbers and signs in words: money, dates, times, units, versions, Roman numbers, by `text_numbers.toml`."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple

from realizer.tables import toml_table
from realizer.text.spellout import facts, spelled

FILE = "text_numbers.toml"
AROUND = 40  # characters
LONGEST_NAME = 12  # characters; with a Roman number behind it
MAX_HELD = 400  # characters; of numbers that go on for longer, only the last part waits
FEW = 3  # words after a number that may belong to it
ROMAN = r"(?:(?=[IVXL])(?:XL|L?X{0,3})(?:IX|IV|V?I{0,3}))"
_SIGNS = "$€£¥₹¢%‰°#§½¼¾⅓⅔⅛*×·÷=<>≤≥≈~±№℃"
_DIRECT = rf"[0-9{re.escape(_SIGNS)}]"
_NUMERAL = (
    r"\b(?:(?:[VXL]|[IVXL]{2,})(?:e|ème)?\b|Ier\b|(?:War|[Cc]hapter|[Pp]art|[Vv]olume|[Aa]ct|[Ss]cene|Elizabeth"
    r"|Charles|James|Francis|Kapitel) I\b)"
)
# Signs of a number or of a word that belongs to one; text without these stays as it is. The first
# characters of all of them come first, and the conditions behind them: so the search leaps.
BUSY = re.compile(
    rf"[IVXLWCcPpvAaSsEJFK{_DIRECT[1:-1]}](?:(?<={_DIRECT})"
    rf"|(?<=(?={_NUMERAL}).)(?:[IVXL]*(?:e|ème)?|er|[a-z]+ I)\b)"
)
STARS = re.compile(r"\*")
_VALUES = {"I": 1, "V": 5, "X": 10, "L": 50}
_FRACTIONS = {"½": "1/2", "¼": "1/4", "¾": "3/4", "⅓": "1/3", "⅔": "2/3", "⅛": "1/8"}
_SLOT = re.compile(r"\{(\w+)(?::(\w+))?\}")
_OPTION = re.compile(r"\[([^\[\]]*)\]")
_WORD = re.compile(r"(?<!\S)\S+\s+")  # the first condition makes long words take linear time
_GROUP = re.compile(r"\(\?<(?![!=])")  # as JavaScript writes it
_DIGIT_ONLY = re.compile(r"[^0-9]")
# Parts of a pattern of the table: sets of signs, groups without groups in them, and what is no sign.
_SETS = re.compile(r"\[([^\]]+)\]")
_GROUPS = re.compile(r"\((\?(?:[:=!]|<[=!]|<\w+>))?((?:[^()\\]|\\.)*)\)([?*]?)")
_NO_SIGN = re.compile(r"(?:\\.|[^\\])[?*]|\{\w*,?\w*\}[?*]?| |(?<!\\)\+")
_RANGE = re.compile(r"^\^|.-.|\\")
_AT_NUMBER = re.compile(
    r"\{B\}(?:\(\?!\{NUM\}\{E\}\))?(?:\(\?<\w+>|\(\?:)?(?:[0-9]|\[[0-9]|\{(?:NUM|SIGNED|T|Y)\})"
)
_NUMBER_BEGINS = re.compile(r"(?<![\w.,:/])[-−0-9]")
_ROMAN_ENDS = re.compile("[IVXL](?![a-df-z])")
_ROMAN_SIGN = "\ufdd0"  # stands for a Roman number
_PRIVATE = 0xE000  # the first character without a meaning


class Frame(NamedTuple):
    """A pattern of a number with its surroundings, such as a date, and the words for what it matches.

    Attributes:
        needs: sets of signs; a text in which the pattern is found has one of each.
        at_number: whether it is only found where a number begins.
    """

    pattern: re.Pattern[str]
    words: str
    needs: tuple[str, ...]
    at_number: bool

    def is_in(self, text: str, numbers: Sequence[int]) -> bool:
        """Return whether the pattern is found in a text whose numbers begin at these places."""
        if not self.at_number:
            return self.pattern.search(text) is not None
        match = self.pattern.match
        for at in numbers:  # noqa: SIM110  (twice as fast as `any`, and short texts have few numbers)
            if match(text, at):
                return True
        return False


def language_of(tag: str) -> str | None:
    """Return the language of a BCP-47 tag whose numbers are known, or None."""
    language = tag.lower().replace("_", "-").partition("-")[0]
    return language if language in toml_table(FILE) and language != "shared" else None


def numbers_in_words(text: str, tag: str, before: str = "") -> str:
    """Return a text with its numbers as people say them; whole numbers alone are left to the voice.

    Args:
        tag: BCP-47; text of a language that is not known stays as it is, without asterisks.
        before: what is spoken before it, so that "II" after "World War" is a number.
    """
    if not BUSY.search(before[-LONGEST_NAME:] + text):
        return text
    if (language := language_of(tag)) is not None:
        whole = _applied(before + text, language)
        text = whole[len(before) :] if whole.startswith(before) else _applied(text, language)
    return STARS.sub("", text)


def complete(text: str, tag: str, before: str = "") -> int:
    """Return the length of the part of a text whose numbers cannot change by what follows the text."""
    language = language_of(tag)
    length = len(text)
    # What is held back is short, so that the last words decide.
    begin = text.find(" ", length - 2 * MAX_HELD) + 1 if length > 2 * MAX_HELD else 0
    words = list(_WORD.finditer(text, begin))
    if language is None or not words:
        return words[-1].end() if words else 0
    busy = [bool(BUSY.search(word[0])) or bool(_triggers(language).search(word[0].strip())) for word in words]
    last = words[-1][0].rstrip()
    if "\n\n" in words[-1][0]:
        return words[-1].end()
    has_stop = last[-1] in ".!?…:;" and not _triggers(language).search(last)
    if has_stop and not (_row(language)["ordinals"] and last[:-1].isdigit()):
        return words[-1].end()
    if not any(busy[-FEW - 1 :]):
        return words[-1].end()
    first = len(words)
    quiet = 0
    for place in range(len(words) - 1, -1, -1):
        quiet = 0 if busy[place] else quiet + 1
        if busy[place]:
            first = place
        if quiet > FEW or (not busy[place] and words[place][0].rstrip()[-1] in ".!?…:;"):
            break
    cut = words[first].start() if first < len(words) else words[-1].end()
    if length - cut > MAX_HELD:
        cut = next(word.start() for word in words if word.end() > length - MAX_HELD // 2)
    return cut


def _applied(text: str, language: str) -> str:
    """Return a text with all frames applied, around its numbers only: few texts have many."""
    said, at = "", 0
    frames = _frames(language)
    for begin, end in _windows(text):
        said += text[at:begin]
        piece, at = text[begin:end], end
        possible, numbers = _possible(language, _signs(piece, language)), _beginnings(piece)
        for place, frame in enumerate(frames):
            if possible[place] and frame.is_in(piece, numbers):
                piece = frame.pattern.sub(_filler(frame, language), piece)
                possible = _possible(language, _signs(piece, language))
                numbers = _beginnings(piece)
        said += piece
    return said + text[at:]


def _beginnings(text: str) -> list[int]:
    return [found.start() for found in _NUMBER_BEGINS.finditer(text)]


def _signs(text: str, language: str) -> frozenset[str]:
    """Return the signs of a text of which the frames of a language need some."""
    signs = _needed(language).intersection(text)
    return signs | {_ROMAN_SIGN} if _ROMAN_ENDS.search(text) else signs


@cache
def _needed(language: str) -> frozenset[str]:
    return frozenset(sign for frame in _frames(language) for need in frame.needs for sign in need)


@lru_cache(maxsize=1000)
def _possible(language: str, signs: frozenset[str]) -> tuple[bool, ...]:
    """Return for each frame whether a text with these signs may have it."""
    return tuple(not any(signs.isdisjoint(need) for need in frame.needs) for frame in _frames(language))


def _windows(text: str) -> Iterator[tuple[int, int]]:
    """Yield the parts of a text that have numbers and the words around them."""
    begin = end = 0
    for found in BUSY.finditer(text):
        if found.start() >= end:
            if end:
                yield begin, end
            blank = text.rfind(" ", end, max(end, found.start() - AROUND))
            begin = end if blank < 0 else blank
        blank = text.find(" ", found.end() + AROUND)
        end = len(text) if blank < 0 else blank
    if end:
        yield begin, end


def _filler(frame: Frame, language: str) -> Callable[[re.Match[str]], str]:
    def fill(found: re.Match[str]) -> str:
        groups = {name: text for name, text in found.groupdict().items() if text is not None}
        if not _is_possible(groups, language):
            return found[0]

        parts = _slots(frame.words, frozenset(groups))
        said = parts[0]
        for name, kind, after in zip(parts[1::3], parts[2::3], parts[3::3], strict=True):
            said += _money(groups, language) if name == "money" else _said(name, kind, groups, language)
            said += after
        return said

    return fill


@lru_cache(maxsize=1000)
def _slots(words: str, groups: frozenset[str]) -> list[str]:
    """Return the words of a frame for these groups: text, then name, kind and text behind of each slot."""

    def optional(option: re.Match[str]) -> str:
        return option[1] if all(slot[1] in groups for slot in _SLOT.finditer(option[1])) else ""

    return _SLOT.split(_OPTION.sub(optional, words))


def _is_possible(groups: Mapping[str, str], language: str) -> bool:
    """Return whether a month and a day can be ones, and a Roman number is not empty."""
    return groups.get("r", "I") != "" and groups.get("R", "I") != "" and len(groups.get("n", "")) <= 24


def _said(group: str, kind: str | None, groups: Mapping[str, str], language: str) -> str:
    """Return the words for a group, by the letter of its name."""
    text, row = groups[group], _row(language)
    match group[0]:
        case "n":
            return _number(text, language, kind or _gender(groups, language))
        case "o":
            return spelled(int(_DIGIT_ONLY.sub("", text)), language, kind or "ordinal")
        case "y":
            return spelled(int(text), language, kind or "year")
        case "d":
            return _digit_by_digit(text, language)
        case "v":
            return f" {facts(language)['point']} ".join(spelled(int(n), language) for n in text.split("."))
        case "r":
            return spelled(roman(text), language, kind or "ordinal")
        case "R":
            return spelled(roman(text), language)
        case "c":
            return str(row["currencies"][text].split("|")[1])
        case "u":
            one, many, *_ = row["units"][text].split("|")
            last = groups.get("n2", groups.get("n", ""))
            return str(one if last.lstrip("-−") == "1" else many)
        case "m":
            return str(row["magnitudes"][text])
        case "M":
            return _months(language).get(text.rstrip("."), text)
        case "k":
            return str(row["months"].split()[int(text) - 1])
        case "f":
            return str(row["fractions"][_FRACTIONS.get(text, text)])
        case "D":
            return str(row["decades"].split()[int(text)])
        case "a":
            return f"{text.upper()} M"
        case "s":
            return str(facts(language)["minus"])
    return text


def _number(text: str, language: str, kind: str) -> str:
    """Return the words for a number in the writing of a language."""
    whole, _, decimals = text.lstrip("-−").partition(_row(language)["decimal"])
    whole = _DIGIT_ONLY.sub("", whole)
    sign = f"{facts(language)['minus']} " if text[0] in "-−" else ""
    words = sign + spelled(int(whole), language, "cardinal" if decimals else kind)
    if not decimals:
        return words
    if facts(language).get("pairs") and len(decimals) < 3 and decimals[0] != "0":
        return f"{words} {facts(language)['point']} {spelled(int(decimals), language)}"
    return f"{words} {facts(language)['point']} " + " ".join(spelled(int(n), language) for n in decimals)


def _money(groups: Mapping[str, str], language: str) -> str:
    """Return an amount: "twelve dollars and fifty cents"."""
    row = _row(language)
    one, many, gender, cent, cents = row["currencies"][groups["c"]].split("|")
    whole, with_cents, cents_alone, large = row["money"]
    if "m" in groups:
        words = {"m": row["magnitudes"][groups["m"]], "c": one if language == "nl" else many}
        kind = "cardinal"
        if groups["m"] in ("Million", "million", "millón") and language != "en":
            kind = gender or "m"
        return _SLOT.sub(
            lambda slot: words.get(slot[1]) or _number(groups["n"], language, kind),
            large,
        ).replace("de euro", "d’euro" if language == "fr" else "de euro")
    amount, _, small = groups["n"].partition(row["decimal"])
    if small and len(small) != 2:
        return f"{_number(groups['n'], language, 'cardinal')} {many}"
    count = int(_DIGIT_ONLY.sub("", amount))
    few = int(small or 0)
    parts = {
        "n": spelled(count, language, gender or "cardinal"),
        "c": one if count == 1 else many,
        "cents": f"{spelled(few, language, (gender and 'm') or 'cardinal')} {cent if few == 1 else cents}",
    }
    sentence = whole if not few else cents_alone if not count else with_cents
    return _SLOT.sub(lambda slot: parts[slot[1]], sentence)


def _gender(groups: Mapping[str, str], language: str) -> str:
    if "u" in groups:
        return next(iter(_row(language)["units"][groups["u"]].split("|")[2:3]), "") or "cardinal"
    return "cardinal"


def _digit_by_digit(text: str, language: str) -> str:
    plus = "plus " if text.startswith("+") else ""
    groups = re.findall("[0-9]+", text)
    return plus + ", ".join(" ".join(spelled(int(n), language) for n in group) for group in groups)


def roman(text: str) -> int:
    """Return the value of a Roman number."""
    values = [_VALUES[letter] for letter in text]
    return sum(-a if a < b else a for a, b in zip(values, [*values[1:], 0], strict=True))


def _row(language: str) -> Mapping[str, Any]:
    row: Mapping[str, Any] = toml_table(FILE)[language]
    return row


@cache
def _months(language: str) -> Mapping[str, str]:
    months, short = _row(language)["months"].split(), _row(language)["short"].split()
    return dict(zip(short, months, strict=True))


@cache
def _triggers(language: str) -> re.Pattern[str]:
    return re.compile(rf"(?<!\w){_row(language)['triggers']}$")


@cache
def _frames(language: str) -> tuple[Frame, ...]:
    row, shared = _row(language), toml_table(FILE)["shared"]
    months = "|".join(f"{m}\\b\\.?" for m in [*row["months"].split(), *row["short"].split()])
    any_of = {
        name: "|".join(map(re.escape, sorted(row[name], key=len, reverse=True)))
        for name in ("currencies", "units", "magnitudes", "fractions")
    }
    macros = {
        "NUM": row["number"],
        "SIGNED": f"[-−]?{row['number']}",
        "CUR": f"(?:{any_of['currencies']})",
        "UNIT": rf"(?:{any_of['units']})(?![\w/²³])",
        "MAG": rf"(?:{any_of['magnitudes']})(?!\w)",
        "FRACTION": f"(?:{any_of['fractions']})",
        "MONTH": f"(?:{months})",
        "ROMAN": ROMAN,
        "Y": "(?:1[0-9]|20)[0-9]{2}",
        "T": shared["time"],
        "W": r"\w",
        "B": r"(?<![\w.,:/])",
        "E": r"(?!\w)(?![.,:/][0-9])",
    }
    frames = []
    at = row["frames"].index(["shared", ""])
    for pattern, words in [*row["frames"][:at], *shared["frames"], *row["frames"][at + 1 :]]:
        needs, at_number = _needs(pattern), _AT_NUMBER.match(pattern) is not None
        for name, macro in macros.items():
            pattern = pattern.replace(f"{{{name}}}", macro)
        frames.append(Frame(re.compile(_GROUP.sub("(?P<", pattern)), words, needs, at_number))
    return tuple(frames)


def _needs(pattern: str) -> tuple[str, ...]:
    """Return sets of signs of which a text has one each if a pattern of the table is found in it."""
    sets: list[str] = []

    def of_set(found: re.Match[str]) -> str:
        if _RANGE.search(found[1]):
            return "{}"
        sets.append(found[1])
        return chr(_PRIVATE + len(sets) - 1)

    def of_group(found: re.Match[str]) -> str:
        is_free = found[3] or "|" in found[2] or found[1] in ("?=", "?!", "?<=", "?<!")
        return "{}" if is_free else found[2]

    pattern = pattern.replace("{ROMAN}", _ROMAN_SIGN).replace("[IVXL]{2,}", _ROMAN_SIGN)
    rest, count = _SETS.sub(of_set, pattern.replace("{FRACTION}", "/")), 1
    while count:
        rest, count = _GROUPS.subn(of_group, rest)
    choices = [
        [
            sets[ord(sign) - _PRIVATE] if _PRIVATE <= ord(sign) < ord(_ROMAN_SIGN) else sign
            for sign in signs
            if not _is_letter(sign)
        ]
        for signs in _NO_SIGN.sub("", rest).replace("\\", "").split("|")
    ]
    if len(choices) == 1:
        return tuple(need for need in choices[0] if not any(map(_is_letter, need)))
    return ("".join(needs[0] for needs in choices),) if all(choices) else ()


def _is_letter(sign: str) -> bool:
    """Return whether most texts have a sign, so that to look for it saves nothing."""
    return sign.isalpha() or sign.isdecimal()
