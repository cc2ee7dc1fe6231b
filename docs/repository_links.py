#!/usr/bin/env python3
"""A preprocessor of mdBook: a link to a file outside docs/ works on a forge only, and becomes its text and path in the book."""

import json
import re
import sys

LINK = re.compile(r"\[([^\[\]]*)\]\(\.\./([^)#\s]+)[^)]*\)")


def plain(match):
    text, path = match.groups()
    return f"`{path}`" if text.strip("`") == path else f"{text} (`{path}`)"


def walk(items):
    for item in items:
        if chapter := item.get("Chapter") if isinstance(item, dict) else None:
            # A page below docs/control-laws/ has its neighbours one folder up.
            if "/" not in (chapter["path"] or ""):
                chapter["content"] = LINK.sub(plain, chapter["content"])
            walk(chapter["sub_items"])


if sys.argv[1:2] == ["supports"]:
    sys.exit(sys.argv[2] != "html")
_, book = json.load(sys.stdin)
walk(book.get("items") or book["sections"])
json.dump(book, sys.stdout)
