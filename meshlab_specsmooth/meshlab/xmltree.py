"""XML with line numbers, for files from strangers: no entities, no DTD content, bounded size."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from meshlab_specsmooth.errors import InvalidXml

LARGEST_FILE = 4 * 2**20  # bytes; a filter script of a thousand filters has one to three million
DEEPEST_NESTING = 32


@dataclass(slots=True)
class Element:
    """One element: its attributes in order, its children, its text, and the line it starts on."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""


def parse(data: bytes, source: str) -> Element:
    """The root element of an XML document.

    Raises
    ------
    InvalidXml
        Malformed, too large, too deeply nested, or with an entity or element declaration in it.
    """
    if len(data) > LARGEST_FILE:
        raise InvalidXml(source, 1, f"has {len(data)} bytes; at most {LARGEST_FILE} are read")
    parser = expat.ParserCreate()
    parser.buffer_text = True
    root = Element("", {}, 0)
    open_elements = [root]
    # joined at the end: expat hands over a piece a line, and a text that grows is copied at every piece
    open_texts: list[list[str]] = [[]]

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > DEEPEST_NESTING:
            raise InvalidXml(source, parser.CurrentLineNumber, f"elements nest deeper than {DEEPEST_NESTING}")
        element = Element(tag, dict(attributes), parser.CurrentLineNumber)
        open_elements[-1].children.append(element)
        open_elements.append(element)
        open_texts.append([])

    def end(_tag: str) -> None:
        open_elements.pop().text = "".join(open_texts.pop())

    def characters(text: str) -> None:
        open_texts[-1].append(text)

    def declaration(*_: Any) -> None:
        raise InvalidXml(source, parser.CurrentLineNumber, "declares entities or elements, which is not allowed here")

    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.CharacterDataHandler = characters
    parser.EntityDeclHandler = declaration
    parser.ElementDeclHandler = declaration
    parser.AttlistDeclHandler = declaration
    parser.SkippedEntityHandler = declaration  # of a DTD elsewhere, which is not read
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InvalidXml(source, error.lineno, f"is not well-formed XML ({expat.ErrorString(error.code)})") from error
    except InvalidXml:
        raise
    except (LookupError, ValueError) as error:  # the encoding that it says it has is none, or none that expat reads
        raise InvalidXml(source, 1, f"cannot be decoded ({error})") from error
    return root.children[0]
