"""XML parser with line numbers, for untrusted files: no entities, no DTD content, bounded size and depth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from meshlab_specsmooth.errors import InvalidXml

MAX_FILE_SIZE = 4 * 2**20  # bytes; a filter script of a thousand filters has 1 to 3 MB
MAX_DEPTH = 32


@dataclass(slots=True)
class Element:
    """An element: tag, attributes in order, line of its start tag, children and text."""

    tag: str
    attributes: dict[str, str]
    line: int
    children: list[Element] = field(default_factory=list)
    text: str = ""


def parse(data: bytes, source: str) -> Element:
    """Parse an XML document and return its root element.

    Raises
    ------
    InvalidXml
        Malformed, too large, nested too deeply, or with an entity or element declaration.
    """
    if len(data) > MAX_FILE_SIZE:
        raise InvalidXml(source, 1, f"has {len(data)} bytes; at most {MAX_FILE_SIZE} are allowed")
    parser = expat.ParserCreate()
    parser.buffer_text = True
    root = Element("", {}, 0)
    open_elements = [root]
    # joined at the end, in linear time: expat passes one piece of text per line
    open_texts: list[list[str]] = [[]]

    def start(tag: str, attributes: dict[str, str]) -> None:
        if len(open_elements) > MAX_DEPTH:
            raise InvalidXml(source, parser.CurrentLineNumber, f"elements nest deeper than {MAX_DEPTH}")
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
    parser.SkippedEntityHandler = declaration  # defined in an external DTD, which is not read
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise InvalidXml(source, error.lineno, f"is not well-formed XML ({expat.ErrorString(error.code)})") from error
    except InvalidXml:
        raise
    except (LookupError, ValueError) as error:  # unknown encoding, or one that expat does not support
        raise InvalidXml(source, 1, f"cannot be decoded ({error})") from error
    return root.children[0]
