"""Joins the pages to what the project already says: the README's sources, and every [Key]."""

import re
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"
SOURCES = "sources.md"
KEY = r"\[([A-Z][A-Za-z]+\d{4})\]"
ENTRY = re.compile(rf"^\* {KEY}", re.M)


def on_page_markdown(markdown, page, config, files):
    """Citations lead to their sources; the sources' page is the README's section of them."""
    if page.file.src_uri == SOURCES:
        section = README.read_text(encoding="utf-8").partition("## Sources")[2]
        entries = ENTRY.sub(r'* <a id="\1"></a>**\1**', section.partition("\n## ")[0])
        return f"{markdown}\n{entries}"
    return re.sub(KEY, _link(page), markdown)


def on_page_content(html, page, config, files):
    """The same in docstrings, where they are written [Key]_."""
    return re.sub(rf"{KEY}_", _link(page), html)


def _link(page):
    """A citation as a link from `page`; what the sources lack stays words."""
    known = ENTRY.findall(README.read_text(encoding="utf-8"))
    way = "../" * page.url.count("/") + "sources/"

    def link(found):
        key = found.group(1)
        return f'<a href="{way}#{key}">[{key}]</a>' if key in known else f"[{key}]"

    return link
