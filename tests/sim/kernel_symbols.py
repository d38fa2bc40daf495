"""Fails where an object file defines a symbol, other than a local one, outside of some namespaces: the linker could take
it for code of the same name in sources that have to run on every machine."""
import argparse
import subprocess
import sys


def mangled(namespace):
    return "".join(f"{len(part)}{part}" for part in namespace.split("::"))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--nm", required=True)
    parser.add_argument("--namespaces", nargs="+", required=True, help="flash::sim::v3, say")
    parser.add_argument("--objects", nargs="+", required=True)
    options = parser.parse_args()
    # A function or a variable of a namespace, or one local to such a function.
    prefixes = tuple(kind + mangled(name) for kind in ("_ZN", "_ZNK", "_ZZN") for name in options.namespaces)
    count, outside = 0, []
    for path in options.objects:
        listing = subprocess.run([options.nm, "--defined-only", path], check=True, capture_output=True, text=True).stdout
        symbols = [line.split()[-2:] for line in listing.splitlines()]
        shared = [name for kind, name in symbols if kind.isupper() or kind in "vwu"]
        if not shared:
            sys.exit(f"{path}: found no symbol, expected kernels")
        count += len(shared)
        outside += [f"{path}: {name}" for name in shared if not name.startswith(prefixes)]
    if outside:
        sys.exit("outside of " + ", ".join(options.namespaces) + ":\n" + "\n".join(outside))
    print(f"{count} symbols, all in " + ", ".join(options.namespaces))


if __name__ == "__main__":
    main()
