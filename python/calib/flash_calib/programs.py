"""The program flash-calib of this package, as the command that pip installs."""
import os
import pathlib
import sys


def path() -> pathlib.Path:
    """Where the program is."""
    return pathlib.Path(__file__).parent / "bin" / "flash-calib"


def flash_calib():
    """The program takes the place of this process: signals, streams and exit codes are its own."""
    try:
        os.execv(path(), ["flash-calib", *sys.argv[1:]])
    except OSError as error:
        sys.exit(f"flash-calib: {path()}: {error.strerror}")
