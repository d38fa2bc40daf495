"""The commands of the documents. A block ```sh is run, by tours.py, as it stands; commands in other blocks are examples."""
import pathlib
import re
import shlex

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAMS = ("flash-calib", "flash-sysid", "flash-sim")
RUN = "sh"


def documents():
    return [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(path for name in ("docs", "examples") for path in sorted((ROOT / name).rglob("*.md")))]


def blocks(text):
    """(language, lines, prose before it) of each fenced block."""
    found, prose, inside = [], [], None
    for line in text.splitlines():
        fence = re.match(r"\s*```(\S*)", line)
        if fence and inside is None:
            inside = (fence[1], [])
        elif fence:
            found.append((*inside, "\n".join(prose)))
            prose, inside = [], None
        elif inside is not None:
            inside[1].append(line)
        else:
            prose.append(line)
    return found


def calls(lines):
    """The words of each call of a program of ours in the lines of a block, continued lines joined."""
    for line in re.sub(r"\\\n\s*", " ", "\n".join(lines)).splitlines():
        if line.split(" ")[0] in PROGRAMS:
            yield shlex.split(re.split(r"\s(?:#|\||>|2>|&&|;)(?:\s|$)", line)[0])
