#!/usr/bin/env python3
"""Every call of a program in a block of the documents has a verb that there is, and options that its --help lists."""
import argparse
import re
import subprocess
import sys

import commands


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    for name in commands.PROGRAMS:
        parser.add_argument(f"--{name[6:]}", required=True, help=f"the program {name}")
    options = vars(parser.parse_args())
    known, wrong, count = {}, [], 0

    def helped(name, verb):
        if (name, verb) not in known:
            done = subprocess.run([options[name[6:]], verb, "--help"], capture_output=True, text=True)
            # Abbreviations are not listed, and none is to be in a document.
            known[name, verb] = set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", done.stdout)) if done.returncode == 0 else None
        return known[name, verb]

    for path in commands.documents():
        for _, lines, _ in commands.blocks(path.read_text()):
            for words in commands.calls(lines):
                count += 1
                listed = helped(words[0], words[1])
                where = f"{path.relative_to(commands.ROOT)}: {' '.join(words)}"
                if listed is None:
                    wrong.append(f"{where}: no verb {words[1]}")
                    continue
                used = {word.split("=")[0] for word in words[2:] if re.match(r"--?[a-zA-Z]", word)}
                wrong += [f"{where}: {words[1]} --help does not list {option}" for option in sorted(used - listed)]
    if wrong or count < 30:
        sys.exit("\n".join(wrong) or f"only {count} calls were found")
    print(f"{count} calls in the documents have options that there are")


if __name__ == "__main__":
    main()
