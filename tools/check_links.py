#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Check the documentation: check_links.py [PROJECT]. Every relative link and picture in a .md file leads to a file of the project."""
import pathlib
import re
import sys

project = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else ".").resolve()
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")

broken = []
for page in (*project.glob("*.md"), *project.glob("docs/**/*.md")):
    text = re.sub(r"^```.*?^```", lambda code: "\n" * code[0].count("\n"), page.read_text(), flags=re.S | re.M)
    for number, line in enumerate(text.splitlines(), 1):
        for link in LINK.findall(line):
            if "://" not in link and not (page.parent / link).exists():
                broken.append(f"{page.relative_to(project)}:{number}: there is no {link}")
if broken:
    sys.exit("\n".join(broken))
