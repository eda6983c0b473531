"""What tests ask of a page."""

import re
from collections.abc import Collection
from html.parser import HTMLParser


class Page(HTMLParser):
    """Reads a page; one whose elements are not closed in order is an error."""

    VOID = ("meta", "img", "link", "br", "source")

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.images: list[str] = []
        self.references: list[str] = []
        self.names: list[str] = []
        self.title = ""
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        if tag == "img":
            self.images.append(known["src"] or "")
        self.references += [value or "" for key, value in attrs if key in ("src", "href")]
        self.names += [value or "" for key, value in attrs if key == "id"]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open[-1:] == ["title"]:
            self.title += data
        elif self.open[-1:] != ["style"]:
            self.words += data.replace("\N{NO-BREAK SPACE}", " ")


def stands_alone(text: str, beside: Collection[str] = ()) -> Page:
    """Check that a page is whole, and needs no network and no file but those `beside` it."""
    page = Page(text)
    assert page.open == []
    assert page.title
    assert all(image.startswith("data:image/") for image in page.images)
    anchors = {f"#{name}" for name in page.names}
    links = {link for link in page.references if not link.startswith("data:")}
    assert links <= anchors | set(beside)
    assert not re.search(r"@import|url\(|<script|<link", text)
    assert not re.search(r"\b(None|nan|Undefined)\b", page.words)
    return page
