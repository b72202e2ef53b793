"""Tests of CONFORMANCE.md and of the claims of corpus cases."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from lxml import etree

from bml_schema import EXTENSIONS
from bml_schema.nodes import core
from realizer.behaviours.registry import VOCABULARY
from tests.cases import CASES, Case
from tests.conformance import FILE, elsewhere, gaps, proofs, render, rules

ROOT = Path(__file__).parent.parent


def test_conformance_file_is_current() -> None:
    assert FILE.read_text("utf-8") == render(), "run: python -m tests.conformance"


def test_conformance_cases_prove_known_rules() -> None:
    for case in CASES:
        assert case.proves, "a case names the rules that it proves"
        assert len(set(case.proves)) == len(case.proves)
        unknown = ", ".join(sorted(set(case.proves) - rules().keys()))
        assert not unknown, (
            f"{case.path}: `proves` names unknown rules: {unknown}. Those of elements and attributes come "
            "from the node classes; others have a row in tests/corpus/rules.toml"
        )


def test_conformance_gaps_have_a_reason() -> None:
    proved = proofs().keys() | elsewhere().keys()
    missing = sorted(rules().keys() - proved - gaps().keys())
    assert not missing, f"add cases to tests/corpus whose `proves` names: {', '.join(missing)}"


def test_conformance_gaps_and_other_tests_are_of_known_rules() -> None:
    assert gaps().keys() | elsewhere().keys() <= rules().keys()
    assert not gaps().keys() & (proofs().keys() | elsewhere().keys())
    assert all(gaps().values()), "a gap has a reason"


def test_conformance_tests_elsewhere_exist() -> None:
    for rule in sorted(elsewhere()):
        path, _, test = elsewhere()[rule].partition("::")
        assert f"def {test}(" in (ROOT / path).read_text("utf-8")


CLAIMS = [
    (case, rules()[id]) for case in CASES for id in case.proves if id in rules() and rules()[id].element
]


def test_conformance_claims_are_in_the_documents_of_cases() -> None:
    for case, rule in CLAIMS:
        found = elements(case, rule.element)
        assert found, f"no <{rule.element.tag}>"
        expectations = case.path.read_text("utf-8")
        ids = [e.get("id", "") for e in found]
        match rule.kind:
            case "attribute":
                assert any(rule.name in e.attrib for e in found)
            case "value":
                assert any(e.get(rule.name, "").strip() == rule.value for e in found)
            case "default":
                assert any(rule.name not in e.attrib for e in found)
                assert {"as_if", "face", "reads", "at", "lasts", "log"} & case.wanted.keys()
            case "required":
                assert any(rule.name not in e.attrib for e in found)
                assert case.wanted.get("refused") or case.wanted.get("warnings")
            case "sync point":
                placed = [e.get("id", "") for e in found if rule.name in e.attrib]
                assert any(f"{id}:{rule.name}" in expectations for id in placed)
            case "reference":
                values = [str(v) for e in root(case).iter("*") for v in e.attrib.values()]
                assert any(
                    re.search(rf"(^|[:\s]){re.escape(f'{id}:{rule.name}')}\b", v)
                    for id in ids
                    for v in values
                )


def root(case: Case) -> Any:
    """Return all documents of a case under one element; broken ones are repaired."""
    text = re.sub(rb"<\?xml[^>]*\?>|<!DOCTYPE[^>]*>", b"", case.document)
    return etree.fromstring(b"<all>" + text + b"</all>", etree.XMLParser(recover=True, remove_comments=True))


def elements(case: Case, cls: type[Any] | None) -> list[Any]:
    """Return the elements of a class in the documents of a case, with a namespace or without.

    For the base class of behaviours, these are all behaviours.
    """
    assert cls is not None
    tag = getattr(cls, "tag", None)
    everything = list(root(case).iter("*"))
    if tag is None:
        known = {name.rpartition("}")[2] for name in VOCABULARY}
        return [e for e in everything if str(e.tag).rpartition("}")[2] in known]
    space, _, name = tag[1:].rpartition("}")
    names = {tag, name} if tag == core(name) or space == EXTENSIONS else {tag}
    return [e for e in everything if e.tag in names]
