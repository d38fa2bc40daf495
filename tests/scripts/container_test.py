#!/usr/bin/env python3
"""What of the Containerfile can be told without an engine: the version is the project's, what is copied is there and not left out by
.dockerignore, packages come by the project's own scripts, and its last stage does not run as root."""
import argparse
import fnmatch
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
GROUPS = ("build", "run", "test", "bench", "check", "site")


def instructions():
    """Name and words of each instruction, continued lines joined, comments left out."""
    text = "".join(line for line in (ROOT / "Containerfile").read_text().splitlines(keepends=True) if not line.startswith("#"))
    for line in re.sub(r"\\\n\s*", " ", text).splitlines():
        if line.strip():
            name, _, words = line.partition(" ")
            yield name, words.strip()


def left_out(path):
    ignored = (ROOT / ".dockerignore").read_text().split()
    return any(fnmatch.fnmatch(part, pattern.removeprefix("**/")) for pattern in ignored for part in path.parts)


def complaints():
    found = list(instructions())
    stages = [words for name, words in found if name == "FROM"]
    if len(stages) != 2 or not stages[0].endswith(" AS build"):
        yield f"found the stages {stages}, expected one AS build and a last one"
    version = re.search(r"^project\(flash VERSION ([0-9.]+) ", (ROOT / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
    label = re.search(r'org\.opencontainers\.image\.version="([^"]*)"', " ".join(words for name, words in found if name == "LABEL"))
    if not label or label[1] != version:
        yield f"found the version {label and label[1]}, CMakeLists.txt has {version}"
    for name, words in found:
        if name == "COPY" and "--from" not in words:
            for source in words.split()[:-1]:
                path = pathlib.Path(source)
                if not (ROOT / path).exists() or left_out(path):
                    yield f"COPY {source}: is not in the checkout, or .dockerignore leaves it out"
        for script in re.findall(r"\bscripts/[\w-]+", words if name == "RUN" else ""):
            if not (ROOT / script).exists():
                yield f"RUN {script}: is not in the checkout"
        for groups in re.findall(r"scripts/install-packages((?: \w+)*)", words if name == "RUN" else ""):
            if unknown := [group for group in groups.split() if group not in GROUPS]:
                yield f"scripts/install-packages: unknown groups {unknown}"
        # A name of a package stands in packages.txt alone: here are lists from there, and NVIDIA's own.
        for installed in re.findall(r"apt-get install ((?:-\S+ )*)(.*?)(?: &&|;|$)", words if name == "RUN" else ""):
            if not re.fullmatch(r"\$\(cat \S+\)|\$CUDA_PACKAGES", installed[1].strip()):
                yield f"apt-get install {installed[1]}: expected names from packages.txt or CUDA_PACKAGES"
    last = found[max(k for k, (name, _) in enumerate(found) if name == "FROM"):]
    if dict(last).get("USER", "root") in ("root", "0"):
        yield "the last stage runs as root"
    entry = re.findall(r'"([^"]+)"', dict(last).get("ENTRYPOINT", ""))
    if not entry or not (ROOT / "scripts" / entry[0]).exists():
        yield f"ENTRYPOINT {entry}: expected a program of scripts/"


def packages_complaints(programs):
    """Packages that programs need to run: their C++ library and those of the group run, each a package of the system."""
    done = subprocess.run([ROOT / "scripts/runtime-packages", *programs], capture_output=True, text=True)
    names = done.stdout.split()
    listed = [line.split()[0] for line in (ROOT / "packages.txt").read_text().splitlines()
              if not line.startswith("#") and len(line.split()) > 1 and "run" in line.split()[1].split(",")]
    if done.returncode or not {"libstdc++6", *listed} <= {*names}:
        yield f"scripts/runtime-packages: found {names}, expected libstdc++6 and {listed}; {done.stderr}"


def entry_complaints():
    def run(*words):
        return subprocess.run(["sh", ROOT / "scripts/container-entry", *words], capture_output=True, text=True)
    for words in ((), ("--help",)):
        help_text = run(*words)
        if help_text.returncode or "flash-calib" not in help_text.stdout or help_text.stderr:
            yield f"of {words}: {help_text}"
    for word in ("flash-clib", "cd", "if", "/", "-c", ""):
        unknown = run(word)
        if unknown.returncode != 2 or unknown.stderr.count("\n") != 1 or f"{word}: no such program" not in unknown.stderr:
            yield f"of no program: {unknown}"
    program = run("sh", "-c", "exit 3")
    if program.returncode != 3:
        yield f"the exit code of a program is not passed on: {program}"


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("programs", nargs="*", help="programs whose packages are looked for, where dpkg is here")
    options = parser.parse_args()
    wrong = [*complaints(), *entry_complaints()]
    if pathlib.Path("/usr/bin/dpkg-query").exists() and options.programs:
        wrong += packages_complaints(options.programs)
    if wrong:
        sys.exit("\n".join(f"Containerfile: {line}" for line in wrong))
    print("Containerfile: version, copied files, packages, entry")


if __name__ == "__main__":
    main()
