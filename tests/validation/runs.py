"""Runs of flash-sysid that are kept and not repeated."""
import concurrent.futures
import contextlib
import csv
import json
import math
import pathlib
import subprocess
import sys
import threading
import time


class Runs:
    """Each run has a folder below `out`; one that holds the answer to the same command is left alone."""

    def __init__(self, sysid, out, threads=None, synth_device=None):
        """`synth_device`: where recordings are made, as synth --device has it; of a CUDA device one at a time."""
        self.sysid = str(sysid)
        self.out = pathlib.Path(out)
        self.threads = [] if threads is None else ["--threads", str(threads)]
        self.synth_device = [] if synth_device is None else ["--device", synth_device]
        self.synth_turn = threading.Lock() if synth_device is not None else contextlib.nullcontext()

    def grid(self, name, recordings, *options, horizon=False):
        """The summary of a search, with the rows of results.csv as `rows`. Exit code 3 (finished, but nothing is
        identifiable or the best candidate missed a step) is an answer too."""
        folder = self.out / name
        command = ["grid", *map(str, recordings), *options, *([] if horizon else ["--no-horizon"]), "--quiet", "-o",
                   str(folder)]
        if not self._done(folder, command, "summary.json"):
            begun = self._same(folder, command) and (folder / "results.csv").exists()
            self._call(folder, command, [*self.threads, "--resume" if begun else "--force"])
        summary = json.loads((folder / "summary.json").read_text())
        with open(folder / "results.csv", newline="") as file:
            rows = [{key: _number(text) for key, text in row.items()} for row in csv.DictReader(file)]
        summary["rows"] = sorted(rows, key=lambda row: row["score_m"])
        return summary

    def replay(self, name, recording, parameters, *options, frames="20"):
        """Score, offsets and keyframes of one set of parameters; meshes, clouds and pictures in the folder."""
        folder = self.out / name
        settings = [word for key, value in parameters.items() for word in ("--hold", f"{key}={value!r}")]
        command = ["replay", str(recording), *settings, *options, "--json", "--quiet", "--frames", frames,
                   "-o", str(folder)]
        if not self._done(folder, command, "score.json"):
            text = self._call(folder, command, ["--force"])
            (folder / "score.json").write_text(text)
        return json.loads((folder / "score.json").read_text())

    def predict(self, name, run, recording, *options):
        """What the search `run` expects of a recording that it has not used, and what was observed."""
        folder = self.out / name
        command = ["predict", str(self.out / run), str(recording), *options, "--quiet", "-o", str(folder / "prediction.json")]
        if not self._done(folder, command, "prediction.json"):
            self._call(folder, command, ["--force"])
        return json.loads((folder / "prediction.json").read_text())

    def synth(self, name, asset, *options):
        """The folder of a recording made with known truth."""
        folder = self.out / name
        command = ["synth", "--asset", asset, *options, "--quiet", "-o", str(folder)]
        if not self._done(folder, command, "recording.json"):
            with self.synth_turn:
                self._call(folder, command, [*self.synth_device, "--force"])
        return folder

    def import_clouds(self, name, clouds, *options):
        folder = self.out / name
        command = ["import", str(clouds), *options, "--quiet", "-o", str(folder)]
        if not self._done(folder, command, "recording.json"):
            self._call(folder, command, ["--force"])
        return folder

    def _same(self, folder, command):
        kept = folder / "command.json"
        return kept.exists() and json.loads(kept.read_text()) == command

    def _done(self, folder, command, answer):
        return self._same(folder, command) and (folder / answer).exists()

    def _call(self, folder, command, more):
        folder.mkdir(parents=True, exist_ok=True)
        begin = time.monotonic()
        (folder / "command.json").write_text(json.dumps(command))
        done = subprocess.run([self.sysid, *command, *more], capture_output=True, text=True)
        if done.returncode not in (0, 3):
            sys.exit(f"validate: {' '.join(command)}\n{done.stderr}")
        print(f"{time.monotonic() - begin:6.0f} s  {folder.relative_to(self.out)}", flush=True)
        return done.stdout


def each_in_time(task, items, jobs, minutes=None):
    """Pairs of an item and what `task` makes of it, `jobs` at a time, in the order in which they are done. After so many minutes
    none is begun any more."""
    end = math.inf if minutes is None else time.monotonic() + 60 * minutes
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        begun = {pool.submit(lambda item=item: task(item) if time.monotonic() < end else None): item for item in items}
        for done in concurrent.futures.as_completed(begun):
            if isinstance(done.exception(), SystemExit):
                print(done.exception(), flush=True)  # the others go on
            elif done.result() is not None:
                yield begun[done], done.result()


def _number(text):
    try:
        return float(text)
    except ValueError:
        return text
