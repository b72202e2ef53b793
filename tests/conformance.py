"""The rules of BML and the cases that prove them in; bml_schema/CONFORMANCE.md out.

`python -m tests.conformance` writes the file. What the elements are, their attributes, values, defaults and
sync points, is read from the node classes, so that none can be forgotten; the other rules are in
corpus/rules.toml.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import groupby
from pathlib import Path
from typing import Any

import bml_schema
from bml_schema import (
    BMLA,
    BMLT,
    CORE,
    EXTENSIONS,
    OWN,
    After,
    Before,
    Behaviour,
    Block,
    Constraint,
    Description,
    Required,
    Sync,
    Synchronize,
)
from bml_schema import VOCABULARY as LANGUAGE
from bml_schema.node_schema import Attribute, schema_of
from realizer.behaviours.registry import VOCABULARY
from tests.cases import CASES, CORPUS, Case

__all__ = ["FILE", "Rule", "elsewhere", "gaps", "proofs", "render", "rules"]

FILE = Path(bml_schema.__path__[0]) / "CONFORMANCE.md"
_RULES = CORPUS / "rules.toml"
_PREFIXES = {CORE: "", EXTENSIONS: "", BMLA: "bmla:", BMLT: "bmlt:", OWN: "realizer:"}
# Elements that are no behaviours, nor children that a behaviour's class names.
_FRAME = (Block, Required, Constraint, Synchronize, Before, After, Sync, Description)
_MOST_SHOWN = 3  # cases named beside a rule


@dataclass(frozen=True)
class Rule:
    """One rule of the language.

    Attributes:
        id: such as "gaze.offsetAngle.default" or "ref.offset-negative".
        chapter: its chapter in the file.
        kind: element, attribute, required, value, default, sync point, reference, or as in rules.toml.
        says: the rule, in Markdown.
        core: of BML 1.0 and its feedback; otherwise of an extension.
        element, name, value: the subject of a derived rule.
    """

    id: str
    chapter: str
    kind: str
    says: str
    core: bool
    element: type[Any] | None = None
    name: str = ""
    value: str = ""


def prefixed(clark: str) -> str:
    """Return the name as in most documents: "{...bmla}interrupt" -> "bmla:interrupt"."""
    space, _, name = clark.removeprefix("{").rpartition("}")
    return _PREFIXES.get(space, "") + name


def classes() -> Iterator[type[Any]]:
    """Return every element: the block and its frame, then each behaviour with its children."""
    seen: set[type[Any]] = set()

    def within(cls: type[Any]) -> Iterator[type[Any]]:
        if cls not in seen:
            seen.add(cls)
            yield cls
            for child in schema_of(cls).children:
                for inner in child.classes:
                    yield from within(inner)

    for cls in (*_FRAME, *{**LANGUAGE, **VOCABULARY}.values()):
        yield from within(cls)


def derived() -> Iterator[Rule]:
    """Yield the rules that the node classes state."""
    yield from _attributes("behaviour", Behaviour, "Every behaviour", True, set())
    own = set(schema_of(Behaviour).attributes)
    for cls in classes():
        name = prefixed(cls.tag)
        core = cls.tag.startswith((f"{{{CORE}}}", f"{{{EXTENSIONS}}}"))
        chapter = f"<{name}>"
        says = re.sub(r"(<[\w:]+>)", r"`\1`", (cls.__doc__ or "").partition("\n")[0])
        yield Rule(name, chapter, "element", says, core, cls)
        timed = issubclass(cls, Behaviour)
        yield from _attributes(name, cls, chapter, core, own if timed else set())
        for point in cls.sync_points if timed else ():
            yield Rule(f"{name}:{point}", chapter, "sync point", f"`{point}`", core, cls, point)
            yield Rule(f"{name}:{point}.ref", chapter, "reference", f"`{point}`", core, cls, point)


def _attributes(name: str, cls: type[Any], chapter: str, core: bool, without: set[str]) -> Iterator[Rule]:
    for spec in schema_of(cls).attributes.values():
        if spec.name in without:
            continue
        known = prefixed(spec.name)
        ours = core and ":" not in known
        where = "BMLA" if core and known.startswith("bmla:") else chapter
        id = f"{name}.{known}"
        yield Rule(id, where, "attribute", f"`{known}`: {spec.value.wanted}", ours, cls, spec.name)
        for word in spec.value.words:
            yield Rule(f"{id}={word}", where, "value", f"`{known}` = `{word}`", ours, cls, spec.name, word)
        if spec.required:
            yield Rule(f"{id}.required", where, "required", f"`{known}` must be there", ours, cls, spec.name)
        elif spec.default is not None and spec.default != ():
            says = f"without `{known}` it is {_written(spec)}"
            yield Rule(f"{id}.default", where, "default", says, ours, cls, spec.name)


def _written(spec: Attribute) -> str:
    return f"`{spec.value.write(spec.default)}`"


@cache
def _table() -> Mapping[str, Any]:
    return tomllib.loads(_RULES.read_text("utf-8"))


@cache
def rules() -> Mapping[str, Rule]:
    """Every rule, by id; the derived ones after those of rules.toml.

    Raises:
        ValueError: two rules have one id.
    """
    out: dict[str, Rule] = {}
    for chapter in _table()["chapter"]:
        for id, says in chapter["rules"].items():
            if id in out:
                raise ValueError(f"{_RULES.name}: {id} stands there twice")
            core = chapter.get("core", True)
            out[id] = Rule(id, chapter["name"], chapter["kind"], says, core)
    for rule in derived():
        if rule.id in out:
            raise ValueError(f"{_RULES.name}: {rule.id} is read from the nodes already")
        out[rule.id] = rule
    return out


@cache
def proofs() -> Mapping[str, tuple[Case, ...]]:
    """Return rule -> the cases that prove it, those that prove the fewest other rules first."""
    out: dict[str, list[Case]] = {}
    for case in CASES:
        for id in case.proves:
            out.setdefault(id, []).append(case)
    return {id: tuple(sorted(cases, key=lambda c: len(c.proves))) for id, cases in out.items()}


def gaps() -> Mapping[str, str]:
    """Return rule -> why nothing proves it."""
    found: Mapping[str, str] = _table().get("gaps", {})
    return found


def elsewhere() -> Mapping[str, str]:
    """Return rule -> "tests/path.py::test" that proves it, if a document alone cannot."""
    found: Mapping[str, str] = _table().get("elsewhere", {})
    return found


def render() -> str:
    """Return the text of CONFORMANCE.md."""
    known = list(rules().values())
    core = [rule for rule in known if rule.core]
    more = [rule for rule in known if not rule.core]
    lines = [
        "# Conformance to BML 1.0",
        "",
        "Generated by `python -m tests.conformance` from the node classes, `tests/corpus/rules.toml` and the",
        "cases in `tests/corpus/`; a test checks that it is current. Each case is a document (`.xml`) and",
        "the statements about it (`.toml`), and is played from end to end, without a clock and in a session.",
        "",
        "| | rules | proved | gaps |",
        "|---|---|---|---|",
        _total("BML 1.0 and its feedback", core),
        _total("extensions", more),
        f"| *cases* | {len(CASES)} | | |",
        "",
    ]
    if gaps():
        lines += ["## Gaps", "", "| rule | why |", "|---|---|"]
        lines += [f"| {rules()[id].says} | {_cell(why)} |" for id, why in gaps().items()]
        lines.append("")
    for title, group in (("The language", core), ("Extensions", more)):
        lines += [f"## {title}", ""]
        for chapter, members in _by_chapter(group):
            lines += [f"### {_heading(chapter)}", "", "| what | kind | proved by |", "|---|---|---|"]
            lines += _rows(members)
            lines.append("")
    return "\n".join(lines).rstrip() + "\n"


def _by_chapter(group: Iterable[Rule]) -> Iterator[tuple[str, list[Rule]]]:
    chapters: dict[str, list[Rule]] = {}
    for rule in group:
        chapters.setdefault(rule.chapter, []).append(rule)
    yield from chapters.items()


def _rows(members: list[Rule]) -> Iterator[str]:
    """Return a row for each rule; values and sync points with the same cases share one."""

    def alike(rule: Rule) -> tuple[str, str, str]:
        shared = rule.kind in ("value", "lexeme", "sync point", "reference")
        return rule.kind, _proof(rule), rule.name if rule.kind == "value" else "" if shared else rule.id

    for (kind, proof, _), same in groupby(sorted(members, key=_rank), key=alike):
        together = list(same)
        says = ", ".join(rule.says for rule in together)
        if kind == "value":
            says = f"`{prefixed(together[0].name)}` = " + ", ".join(f"`{rule.value}`" for rule in together)
        said = {"sync point": "sync point, set", "reference": "sync point, referred to"}.get(kind, kind)
        yield f"| {_cell(says)} | {said} | {proof} |"


_ORDER = ("element", "attribute", "required", "value", "default", "sync point", "reference")


def _rank(rule: Rule) -> tuple[int, str, str]:
    if rule.kind not in _ORDER:
        return len(_ORDER), "", ""
    proof = _proof(rule) if rule.kind in ("sync point", "reference", "value") else ""
    by_name = rule.kind in ("attribute", "required", "value", "default")
    order = list(schema_of(rule.element).attributes).index(rule.name) if by_name and rule.element else 0
    return _ORDER.index(rule.kind), f"{order:03}", proof


def _proof(rule: Rule) -> str:
    cases = proofs().get(rule.id, ())
    links = [f"[{case.name}](../tests/corpus/{case.name}.toml)" for case in cases[:_MOST_SHOWN]]
    if rule.id in elsewhere():
        path, _, test = elsewhere()[rule.id].partition("::")
        links.append(f"[{test}](../{path})")
    if len(cases) > _MOST_SHOWN:
        links.append(f"{len(cases) - _MOST_SHOWN} more")
    return ", ".join(links) or "**gap**"


def _total(name: str, group: list[Rule]) -> str:
    proved = sum(rule.id in proofs() or rule.id in elsewhere() for rule in group)
    part = f"{100 * proved / len(group):.1f} %" if group else ""
    return f"| {name} | {len(group)} | {proved} ({part}) | {len(group) - proved} |"


def _heading(chapter: str) -> str:
    return f"`{chapter}`" if chapter.startswith("<") else chapter


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


if __name__ == "__main__":
    FILE.write_text(render(), "utf-8")
