#!/usr/bin/env python3
"""Checks the wording of comments, documents and messages: words that readers may not understand, and typos.

    tools/words/check.py [FILE...]

`words.tsv` has a pattern per line, where it applies (comments, documents, strings), and what to write instead.
`exceptions.txt` has lines that may stay: a file, a tab, a part of the line. Exits with 1 if a line matches.
"""
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parent.parent
COMMENT = {".rs": re.compile(r"(?:^|\s)//[/!]?\s?(.*)"), ".ts": re.compile(r"(?:^|\s)//\s?(.*)"),
           ".py": re.compile(r"(?:^|\s)#\s?(.*)"), ".sh": re.compile(r"(?:^|\s)#\s?(.*)")}
STRING = re.compile(r'"((?:[^"\\]|\\.)*)"')
SKIPPED = ("crates/view/page/dist/", "fuzz/corpus/", "tests/data/", "docs/measurements/", "tools/words/")


def patterns():
    """The rules: a regular expression, the kinds of text that it is for, the replacement."""
    for line in (HERE / "words.tsv").read_text().splitlines():
        if line and not line.startswith("#"):
            pattern, kinds, instead = line.split("\t")
            yield re.compile(pattern, re.IGNORECASE), kinds.split(","), instead


def texts(path, line):
    """The parts of a line that people read, each with its kind."""
    if path.suffix == ".md":
        yield "documents", line
        return
    comment = COMMENT.get(path.suffix)
    if comment is None:
        return
    # A slash or a hash in a string begins no comment.
    bare = STRING.sub('""', line)
    for match in comment.finditer(bare):
        yield "comments", match[1]
    if path.suffix == ".rs":
        for match in STRING.finditer(line):
            yield "strings", match[1]


def main():
    rules = list(patterns())
    exceptions = [line.split("\t") for line in (HERE / "exceptions.txt").read_text().splitlines() if line]
    names = sys.argv[1:] or subprocess.run(
        ["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout.split()
    found = 0
    for name in names:
        path = ROOT / name
        if name.startswith(SKIPPED) or path.suffix not in {*COMMENT, ".md"} or not path.is_file():
            continue
        in_code = False
        for number, line in enumerate(path.read_text(errors="replace").splitlines(), 1):
            if path.suffix == ".md" and line.startswith("```"):
                in_code = not in_code
            if in_code or any(name == file and part in line for file, part in exceptions):
                continue
            for kind, text in texts(path, line):
                for rule, kinds, instead in rules:
                    match = rule.search(text)
                    if kind in kinds and match:
                        found += 1
                        print(f"{name}:{number}: `{match[0]}`: {instead}\n    {line.strip()[:150]}")
    if found:
        print(f"{found} lines to rewrite (or to name in tools/words/exceptions.txt)")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
