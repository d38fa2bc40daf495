"""The programs flash-sim and flash-sysid of this package, as the commands that pip installs. flash_sim.bag needs none of it."""
import os
import pathlib
import sys


def path(name: str) -> pathlib.Path:
    """Where the program "flash-sim" or "flash-sysid" is."""
    return pathlib.Path(__file__).parent / "bin" / name


def flash_sim():
    _become("flash-sim")


def flash_sysid():
    _become("flash-sysid")


def _become(name):
    """The program takes the place of this process: signals, streams and exit codes are its own."""
    try:
        os.execv(path(name), [name, *sys.argv[1:]])
    except OSError as error:
        sys.exit(f"{name}: {path(name)}: {error.strerror}")
