#!/usr/bin/env python3
"""Kills while a program writes, and signals before anything has begun: each ends at once, with one line where it can say one,
and leaves nothing half written."""
import fcntl
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time

import program
from misuse import FAILED, HANG, run_checks


def temporary_folders(folder):
    return sorted(path.name for path in folder.rglob("*-0.tmp") if path.is_dir())


def check_kills(options, folder):
    """What a killed segment leaves beside its output, or in it, the next one removes, but not what others write to."""
    words = [options.sysid, "segment", folder / "many", "--no-table", "--force", "--quiet", "-o", folder / "kept" / "out"]
    (folder / "kept").mkdir()
    for where in ("beside", "in"):  # the first run makes the output
        job = subprocess.Popen([*map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        while not temporary_folders(folder / "kept") and job.poll() is None:
            time.sleep(0.001)
        job.kill()
        error = job.communicate()[1]
        yield job.returncode == -signal.SIGKILL, f"segment ended before it was killed: {job.returncode} {error}"
        foreign = folder / "kept" / "output.2-0.tmp"
        left = [name for name in temporary_folders(folder / "kept") if name != foreign.name]
        yield len(left) == 1, f"a killed segment {where}: {left}"
        held = folder / "kept" / ("out.1-0.tmp" if where == "beside" else "out/.1-0.tmp")
        for path in (held, foreign):
            path.mkdir(exist_ok=True)
        lock = os.open(held, os.O_RDONLY)
        fcntl.flock(lock, fcntl.LOCK_EX)
        done = program.call(*words)
        yield done.returncode == 0, f"segment after a kill: exit code {done.returncode}: {done.stderr}"
        found = temporary_folders(folder / "kept")
        yield found == sorted([held.name, foreign.name]), f"after a kill, {where}: {found}"
        os.close(lock)
    program.must(*words)
    yield temporary_folders(folder / "kept") == ["output.2-0.tmp"], f"in the end: {temporary_folders(folder / 'kept')}"
    shutil.rmtree(folder / "kept")


def catches(job):
    lines = pathlib.Path(f"/proc/{job.pid}/status").read_text().splitlines()
    return int(dict(line.split(":", 1) for line in lines if ":" in line).get("SigCgt", "0"), 16)


def check_early_signals(options, folder):
    """A signal as soon as the program catches any, before it has read its first file."""
    search = ["recording", "--asset", "asset.json", "-o", "early"]
    grid = ["grid", *search, "--bending", "1e-4,2e-4"]
    jobs = [[options.sysid, *words] for words in
            (grid, ["replay", *search], ["plan", *search], ["fit", *search, "--start", "run"],
             ["synth", "--asset", "cloth.json", "--duration", "5", "--mesh", "sheet:0.2x0.2:0.005", "-o", "early"],
             ["segment", "many", "--no-table", "-o", "early"])]
    jobs += [[options.sim, "run", "slow.json", "-o", "early"], [options.sim, "bench", "--vertices", "5000"]]
    for words in jobs:
        for number in (signal.SIGINT, signal.SIGTERM):
            job = subprocess.Popen([*map(str, words)], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
                                   text=True)
            while job.poll() is None and not catches(job) & 1 << (number - 1):
                pass
            job.send_signal(number)
            error = job.communicate(timeout=HANG)[1]
            where = f"{words[1]}, {number.name} at the start"
            yield job.returncode == FAILED, f"{where}: exit code {job.returncode}: {error}"
            # On a busy machine the signal may come later: what is left then is named.
            lines = re.findall(r"^flash-\w+: (?:warning: )?(?:stopped|the signal came) .*$", error, re.MULTILINE)
            yield len(lines) == 1, f"{where}: says {error}"
            named = any(word in error for word in ("kept in early", "it is written"))
            yield not (folder / "early").exists() or named, f"{where}: leaves something: {error}"
            shutil.rmtree(folder / "early", ignore_errors=True)


if __name__ == "__main__":
    sys.exit(run_checks(__doc__, "kills and signals", [check_kills, check_early_signals]))
