"""The scripts of languages, for texts that a voice of another language spells letter by letter."""

import unicodedata
from collections import Counter
from collections.abc import Mapping

# The first word of the Unicode names of a script's letters -> the primary subtags of espeak-ng's languages
# that are written in it, the most spoken first.
LANGUAGES: Mapping[str, tuple[str, ...]] = {
    script: tuple(languages.split())
    for script, languages in {
        "CYRILLIC": "ru uk bg sr be kk ky tt ba cv mk",
        "GREEK": "el grc",
        "CJK": "zh cmn yue hak ja",
        "HIRAGANA": "ja",
        "KATAKANA": "ja",
        "HANGUL": "ko",
        "ARABIC": "ar fa ur sd ug ku",
        "HEBREW": "he",
        "DEVANAGARI": "hi mr ne kok",
        "BENGALI": "bn as bpy",
        "GURMUKHI": "pa",
        "GUJARATI": "gu",
        "ORIYA": "or",
        "TAMIL": "ta",
        "TELUGU": "te",
        "KANNADA": "kn",
        "MALAYALAM": "ml",
        "SINHALA": "si",
        "THAI": "th",
        "MYANMAR": "my shn",
        "GEORGIAN": "ka",
        "ARMENIAN": "hy hyw",
        "ETHIOPIC": "am",
        "CHEROKEE": "chr",
    }.items()
}


def foreign_script(text: str, language: str) -> str | None:
    """Return the script of most letters of a text, if the language is not written in it; else None.

    Args:
        language: a tag, of which the primary subtag counts.
    """
    scripts = Counter(unicodedata.name(c, "").partition(" ")[0] for c in text if c.isalpha())
    script, count = next(iter(scripts.most_common(1)), ("", 0))
    is_foreign = language.lower().partition("-")[0] not in LANGUAGES.get(script, ())
    return script if script in LANGUAGES and is_foreign and 2 * count > scripts.total() else None
