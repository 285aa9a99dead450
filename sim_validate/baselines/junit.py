"""Writes the findings of a check as a JUnit file, which build servers show as test results."""

from collections.abc import Iterable
from xml.etree import ElementTree

from sim_validate.baselines.compare import Finding, Status, failing
from sim_validate.baselines.entries import fields_of, properties_of


def junit_text(name: str, findings: Iterable[Finding], *, strict: bool) -> str:
    """Write a JUnit file with a case for each grasp."""
    listed = list(findings)
    suite = ElementTree.Element("testsuite", name=_printable(name), tests=str(len(listed)))
    failures = errors = 0
    for finding in listed:
        case = ElementTree.SubElement(suite, "testcase", name=finding.id, classname="graspproof")
        said = _printable("; ".join(finding.reasons))
        if finding.status in failing(strict=strict):
            failures += 1
            ElementTree.SubElement(case, "failure", type=finding.status.value, message=said)
        elif finding.status is Status.NOT_COMPARABLE:
            errors += 1
            ElementTree.SubElement(case, "error", type=finding.status.value, message=said)
        if finding.after is not None:
            kept = ElementTree.SubElement(case, "properties")
            for key, value in properties_of(fields_of(finding.after)).items():
                ElementTree.SubElement(kept, "property", name=key, value=str(value))
    suite.set("failures", str(failures))
    suite.set("errors", str(errors))
    ElementTree.indent(suite)
    return ElementTree.tostring(suite, encoding="unicode", xml_declaration=True) + "\n"


def _printable(text: str) -> str:
    """Replace characters that XML cannot hold."""
    return "".join(letter if letter.isprintable() else " " for letter in text)
