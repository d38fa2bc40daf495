"""A folder that readers see whole or not at all."""
import contextlib
import os
import pathlib
import re
import shutil

from flash_sim.bag.errors import refusal

NUMBERED = re.compile(r"\d{3,}(\.\d+)?\.(png|jpg|npy|ply)")


class StagedFolder:
    """A context manager: files go to a folder beside, which takes its place when all are there. What fails leaves nothing."""

    def __init__(self, path, force=False, read=()):
        """Throws RecordingError where something is there already, unless `force`, or where one of `read` would be written over."""
        self.final = pathlib.Path(os.path.realpath(path))
        self._named = str(path)
        for name in map(os.path.realpath, read):
            if self.final == pathlib.Path(name) or pathlib.Path(name) in self.final.parents:
                raise refusal(path, f"is read by this run, as {name} is; choose another name")
        if self.final.exists() and not self.final.is_dir():
            raise refusal(path, "exists already, and is no folder; choose another name")
        if self.final.exists() and any(self.final.iterdir()) and not force:
            raise refusal(path, "exists already; choose another name, or --force to overwrite")
        self.path = self.final.with_name(f"{self.final.name}.{os.getpid()}-0.tmp")
        self._made = [parent for parent in self.final.parents if not parent.exists()]

    def __enter__(self):
        try:
            self.path.mkdir(parents=True)
        except OSError as error:
            raise refusal(self._named, f"cannot be written: {error.strerror}") from error
        return self

    def __exit__(self, kind, error, trace):
        try:
            if kind is None:
                self._publish()
        finally:
            shutil.rmtree(self.path, ignore_errors=True)
            for parent in self._made if kind is not None else ():
                with contextlib.suppress(OSError):  # something is in it
                    parent.rmdir()

    def write(self, name, content):
        """A file below the folder, of text or bytes."""
        path = self.path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)

    def _publish(self):
        if not self.final.exists():
            self.path.rename(self.final)
        else:
            _move_over(self.path, self.final)


def _move_over(source, target):
    """Files of the same names are replaced, numbered pictures of an earlier run go, whatever else is there stays."""
    if not source.is_dir() or not target.is_dir():
        if target.is_dir():
            shutil.rmtree(target)
        source.replace(target)
        return
    for old in target.iterdir():
        if NUMBERED.fullmatch(old.name):
            old.unlink()
    for entry in list(source.iterdir()):
        _move_over(entry, target / entry.name)
