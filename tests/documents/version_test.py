#!/usr/bin/env python3
"""The version stands in CMakeLists.txt; the programs, the citation, the changelog and the image of a container have the same."""
import argparse
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]


def found(name, pattern):
    match = re.search(pattern, (ROOT / name).read_text(), re.MULTILINE)
    return match[1] if match else f"none by {pattern}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="*", help="programs to ask for --version")
    options = parser.parse_args()
    version = found("CMakeLists.txt", r"^project\(flash VERSION ([0-9]+\.[0-9]+\.[0-9]+) ")
    others = {"CITATION.cff": found("CITATION.cff", r"^version: (.*)$"),
              "Containerfile": found("Containerfile", r'image\.version="([0-9.]+)"'),
              "CHANGELOG.md": found("CHANGELOG.md", r"^## ([0-9.]+)"),
              "tests/consumer": version if found("tests/consumer/CMakeLists.txt", r"^find_package\(flash ([0-9.]+) ") ==
              version.rpartition(".")[0] else "another one",
              "pyproject.toml": version if "\nversion" not in (ROOT / "pyproject.toml").read_text() else "one of its own"}
    for program in options.programs:
        said = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
        others[program] = (re.search(r"\d+\.\d+\.\d+", said) or ["none"])[0]
    wrong = [f"{name}: found version {other}, CMakeLists.txt has {version}" for name, other in others.items() if other != version]
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"{version} in {', '.join(others)}")


if __name__ == "__main__":
    main()
