"""Fields are documented beside the field: their comments are their docstrings in the reference."""

import re

import griffe

COMMENT = re.compile(r"#\s*(?!noqa|type:)(.+)$")


class Fields(griffe.Extension):
    """Gives every attribute the comment at the end of its line."""

    def on_attribute_instance(self, *, attr, **kwargs):
        """An attribute has been read."""
        if attr.docstring or attr.lineno is None:
            return
        line = attr.lines_collection[attr.filepath][attr.endlineno - 1]
        if found := COMMENT.search(line):
            attr.docstring = griffe.Docstring(found.group(1), lineno=attr.lineno, parent=attr)
