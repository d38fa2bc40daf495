#!/usr/bin/env python3
"""Whether a test notices each number of sim/newton/step_numbers.h, which the processor and a device share.

Usage: tests/robustness/step_numbers.py --build BUILD [--filter TESTS]

Each number, doubled, has to make a test of the processor fail. Prints a row a number and ends with 1 where one
survives. What includes the header is compiled once more, with numbers that the program reads from its environment, and
once each for those that are lengths of arrays; nothing in the tree or in BUILD changes. Takes some minutes, by hand."""
import argparse
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor

ROOT = pathlib.Path(__file__).resolve().parents[2]
HEADER = "sim/newton/step_numbers.h"
NUMBER = re.compile(r"inline constexpr (double|int) ([^;]*);")
LENGTHS = ("most_directions", "most_halvings")  # of arrays
TESTS = "LineSearch.*:NewtonLoop.*:StepEnd.*:StepProblem.*:Krylov.*"
READ = """
#include <cstdlib>
#include <cstring>
namespace flash::sim {
inline double changed(const char* name, double number) {
  const char* which = std::getenv("FLASH_DOUBLED");
  return which != nullptr && std::strcmp(which, name) == 0 ? 2 * number : number;
}
}  // namespace flash::sim
"""


def numbers_of(text):
    """(type, name, value) of each."""
    found = []
    for kind, rest in NUMBER.findall(text):
        for one in rest.split(","):
            name, value = map(str.strip, one.split("="))
            found.append((kind, name, value))
    return found


def with_read_numbers(text):
    def read(match):
        kind = match.group(1)
        lines = []
        for one in match.group(2).split(","):
            name, value = map(str.strip, one.split("="))
            if name in LENGTHS:
                lines.append(f"inline constexpr {kind} {name} = {value};")
            else:
                lines.append(f'inline const {kind} {name} = static_cast<{kind}>(changed("{name}", {value}));')
        return "\n".join(lines)

    return NUMBER.sub(read, text).replace("#pragma once\n", "#pragma once\n" + READ)


def with_doubled(text, name):
    return re.sub(rf"(\b{name} = )([^,;]*)", r"\1 2 * (\2)", text)


class Program:
    """The tests of sim, as BUILD has them but for what includes the header."""

    def __init__(self, build):
        self.build = build
        self.objects = self.dependent_objects()
        entries = json.loads((build / "compile_commands.json").read_text())
        outputs = {re.search(r" -o (\S+)", entry["command"]).group(1): entry["command"] for entry in entries}
        self.commands = {output: outputs[output] for output in self.objects}
        last = subprocess.run(["ninja", "-C", build, "-t", "commands", "tests/sim_tests"], check=True, text=True,
                              capture_output=True).stdout.splitlines()
        self.link = next(line for line in reversed(last) if " -o tests/sim_tests " in line)

    def dependent_objects(self):
        listing = subprocess.run(["ninja", "-C", self.build, "-t", "deps"], check=True, text=True,
                                 capture_output=True).stdout
        objects = set()
        for block in listing.split("\n\n"):
            target = block.split(":", 1)[0].strip()
            if HEADER in block and target.startswith(("sim/", "tests/CMakeFiles/sim_tests.dir/")):
                objects.add(target)
        return sorted(objects)

    def make(self, folder, header, jobs):
        """The program with another header; returns where it is."""
        include = folder / "include" / HEADER
        include.parent.mkdir(parents=True)
        include.write_text(header)
        made = {}

        def compile_one(place):
            number, output = place
            made[output] = folder / f"{number}.o"
            words = shlex.split(self.commands[output])
            words[words.index("-o") + 1] = str(made[output])
            first = next(k for k, word in enumerate(words) if word.startswith("-I"))
            words.insert(first, f"-I{folder / 'include'}")
            subprocess.run(words, cwd=self.build, check=True)

        with ThreadPoolExecutor(jobs) as pool:
            list(pool.map(compile_one, enumerate(self.objects)))
        # Objects come before the library, whose own then are not asked for.
        before = [str(made[o]) for o in self.objects if o.startswith("sim/")]
        link = self.link.replace(" -o tests/sim_tests ", f" {' '.join(before)} -o {folder / 'tests'} ")
        for output in self.objects:
            if not output.startswith("sim/"):
                link = link.replace(f" {output} ", f" {made[output]} ")
        subprocess.run(link, shell=True, cwd=self.build, check=True)
        return folder / "tests"


def failures(program, tests, doubled):
    environment = dict(os.environ, RC_PARAMS="seed=20 max_success=60", FLASH_DOUBLED=doubled)
    run = subprocess.run([program, f"--gtest_filter={tests}", "--gtest_brief=1"], text=True, capture_output=True,
                         env=environment)
    failed = re.findall(r"^\[  FAILED  \] (\S+)", run.stdout, re.M)
    if run.returncode != 0 and not failed:
        failed = [f"the program, with {run.returncode}"]
    return list(dict.fromkeys(name for name in failed if not name.isdigit()))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=pathlib.Path, required=True, help="a build with its tests")
    parser.add_argument("--filter", default=TESTS, help="tests, as of GoogleTest")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    text = (ROOT / HEADER).read_text()
    program = Program(arguments.build.resolve())
    survivors = 0
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        read = program.make(folder / "read", with_read_numbers(text), arguments.jobs)
        if failed := failures(read, arguments.filter, ""):
            sys.exit(f"tests fail as things are: {', '.join(failed)}")
        print(f"{'number':24} {'value':>8}  tests that fail where it is doubled")
        for _, number, value in numbers_of(text):
            own = read
            if number in LENGTHS:
                own = program.make(folder / number, with_doubled(text, number), arguments.jobs)
            failed = failures(own, arguments.filter, number)
            survivors += not failed
            others = f" and {len(failed) - 1} more" if len(failed) > 1 else ""
            print(f"{number:24} {value:>8}  {failed[0] + others if failed else 'NONE'}", flush=True)
    sys.exit(1 if survivors else 0)


if __name__ == "__main__":
    main()
