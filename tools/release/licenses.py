#!/usr/bin/env python3
"""Prints the licenses of the font and all crates in the binaries of some packages: licenses.py TARGET FEATURES PACKAGE...

Most licenses require their text next to the binary. Crates with the same text are listed together above it.
"""

import json
import pathlib
import subprocess
import sys

TEXTS = ("LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE")
MUSL = """The binaries contain parts of the C library musl (MIT license, copyright 2005-2020 Rich Felker and others).
"""


def cargo(*arguments):
    return subprocess.run(["cargo", *arguments], check=True, stdout=subprocess.PIPE, text=True).stdout


def crates(target, features, packages):
    """Yields names and versions of the third-party crates that the packages link."""
    selection = [word for package in packages for word in ("--package", package)]
    edges = ["--edges", "normal", "--target", target, "--prefix", "none", "--format", "{p}"]
    for line in set(cargo("tree", "--locked", *selection, "--features", features, *edges).splitlines()):
        words = line.split()
        # A path after the version marks a crate of this repository.
        if len(words) >= 2 and not any(word.startswith("(/") for word in words):
            yield words[0], words[1].removeprefix("v")


def texts(folder):
    """Returns the text of each license file of a crate."""
    paths = sorted(path for path in folder.iterdir() if path.name.upper().startswith(TEXTS) and path.is_file())
    return [path.read_text(encoding="utf-8", errors="replace").strip("\r\n") for path in paths]


def section(names, text):
    return "\n".join(["=" * 80, *names, "=" * 80, "", text, ""])


def main(target, features, *packages):
    metadata = json.loads(cargo("metadata", "--locked", "--all-features", "--format-version", "1"))
    known = {(package["name"], package["version"]): package for package in metadata["packages"]}
    # Compared by words: the same license occurs with different line breaks.
    named, without = {}, []
    for crate in sorted(set(crates(target, features, packages))):
        package = known[crate]
        name = f"{crate[0]} {crate[1]} ({package['license'].strip()})"
        found = texts(pathlib.Path(package["manifest_path"]).parent)
        for text in found:
            named.setdefault(" ".join(text.split()), (text, []))[1].append(name)
        if not found:
            without.append(name)
    font = pathlib.Path(__file__).parents[2] / "crates/render/assets/LICENSE-OFL"
    print(section(["The font of the pictures (OFL-1.1)"], font.read_text(encoding="utf-8").strip()))
    if target.endswith("-musl"):
        print(MUSL)
    for text, names in sorted(named.values(), key=lambda entry: entry[1]):
        print(section(names, text))
    if without:
        print(section(without, "These crates have no license text; the license is in brackets."))


if __name__ == "__main__":
    main(*sys.argv[1:])
