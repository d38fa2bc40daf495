#!/usr/bin/env python3
"""Searches that several programs share, two of which are killed (SIGKILL) and begun again. What they leave is
that of one program: results.csv, registrations.csv and keyframes.csv byte by byte, summary.json but for its seconds. Shares without
a disk in common are brought together by merge. The recipes of docs/how_to/more_than_one_machine.md run as they stand."""
import argparse
import json
import os
import pathlib
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time

import program
from killed_and_resumed import contents

AXES = ["--bending", "2e-5:5e-4:5:log", "--no-horizon", "--no-plan"]
PAGE = pathlib.Path(__file__).parents[2] / "docs" / "how_to" / "more_than_one_machine.md"


def begin(command, *more):
    return subprocess.Popen([*map(str, command), *map(str, more)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def ended(process):
    """Its exit code and last words."""
    out, error = process.communicate(timeout=600)
    return process.returncode, (out + error).strip()


def shared(command, count, out, draw):
    """`count` programs beside each other, two of which are killed and begun again: exit codes and words."""
    words = [[*command, "--resume", "--shard", f"{k + 1}/{count}", "-o", out] for k in range(count)]
    running = [begin(line) for line in words]
    for k in draw.sample(range(count), min(2, count)):
        time.sleep(draw.uniform(0.2, 1.0))
        running[k].kill()
        running[k].communicate()
        running[k] = begin(words[k])
    return [ended(process) for process in running]


def same(out, alone):
    found = contents(out)
    return [name for name, expected in alone.items() if found[name] != expected]


def counted(results, command, alone, root, counts, draw):
    for count in counts:
        out = root / f"shared_{count}"
        codes = shared(command, count, out, draw)
        results.append((all(code == 0 for code, _ in codes), f"{count} shares: exit codes and words {codes}"))
        results.append((not same(out, alone), f"{count} shares: {same(out, alone)} differ from those of one program"))
        left = [path for path in out.rglob("*.tmp") if path.parent.name != "motions"]  # which another may be writing
        results.append((not left, f"{count} shares: left {left}"))


def merged(results, command, alone, root):
    """Shares with folders of their own."""
    runs = [root / f"own_{k + 1}" for k in range(3)]
    for k, run in enumerate(runs):
        code, said = ended(begin(command, "--resume", "--own-share", "--shard", f"{k + 1}/3", "-o", run))
        results.append((code == 0 and not (run / "summary.json").exists(), f"share {k + 1} by itself: exit code {code}: {said}"))
    out = root / "merged"
    program.must(command[0], "merge", *runs, "-o", out, "--quiet")
    program.must(*command, "--resume", "-o", out)
    results.append((not same(out, alone), f"merged shares: {same(out, alone)} differ from those of one program"))


def gone(results, command, alone, root):
    """A share that never comes is simulated by the others."""
    out = root / "two_of_three"
    running = [begin(command, "--resume", "--patience", 3, "--shard", f"{k}/3", "-o", out) for k in (1, 3)]
    codes = [ended(process) for process in running]
    waits = sum(said.count("simulated here") for _, said in codes)
    results.append((waits <= 2, f"a share that does not come is given up {waits} times by two"))
    results.append((all(code == 0 for code, _ in codes), f"two of three shares: {codes}"))
    results.append(("simulated here" in codes[0][1] + codes[1][1], f"a share that does not come is not told: {codes}"))
    results.append((not same(out, alone), f"two of three shares: {same(out, alone)} differ"))


def refused(results, command, root, recording, sysid):
    def says(words, *expected):
        done = program.call(*words)
        results.append((done.returncode == 2 and all(word in done.stderr for word in expected) and done.stderr.count("\n") == 1,
                        f"{words[1:]}: exit code {done.returncode}: {done.stderr}"))

    out = root / "refused"
    says([*command, "-o", out, "--shard", "4/3"], "--shard", "4/3", "I/N")
    says([*command, "-o", out, "--shard", "slurm"], "SLURM_ARRAY_TASK_MIN unset")
    says([*command, "-o", out, "--own-share"], "--own-share", "--shard")
    says([*command, "-o", out, "--shard", "1/3", "--force"], "--force", "--resume")
    says([*command, "-o", out, "--shard", "1/3", "--patience", "-1"], "--patience")
    says([sysid, "merge", root / "none", "-o", out], "none", "no search")
    says([sysid, "merge", recording, "-o", out], "no search")
    says([*command, "--resume", "--tolerance", "1e-2", "--shard", "1/3", "-o", root / "own_2"], "--shard", "another search", "tolerance")
    held = begin(command, "--resume", "--patience", 600, "--shard", "2/2", "-o", root / "held")
    while not list((root / "held").glob("shards/2/grid.json")):
        time.sleep(0.05)
    says([*command, "-o", root / "held"], "held", "another run is writing")
    says([*command, "--resume", "--shard", "2/2", "-o", root / "held"], "held", "another run is writing")
    held.kill()
    held.communicate()
    mine = root / "held" / "shards" / "mine"
    mine.mkdir()
    program.must(*command, "--force", "-o", root / "held")
    results.append(([path.name for path in mine.parent.iterdir()] == ["mine"], f"--force left {list(mine.parent.iterdir())} of shares"))
    mine.rmdir()
    program.must(*command, "--force", "-o", root / "held")
    results.append((not mine.parent.exists(), "--force leaves an empty folder of shares"))
    says([sysid, "merge", root / "own_2", "-o", recording], "holds a recording")
    done = program.must(*command, "--json", "--resume", "--own-share", "--shard", "2/3", "-o", root / "told")
    results.append((json.loads(done.stdout)["missing"] > 0, f"a share that ends says {done.stdout}"))
    program.must(sysid, "merge", root / "own_2", "-o", root / "own_1", "--quiet")
    other = [*command, "--tolerance", "1e-2", "--shard", "2/3", "--own-share", "-o", root / "other"]
    program.must(*other)
    says([sysid, "merge", root / "own_1", root / "other", "-o", out], "not the search of", "tolerance")
    results.append((not out.exists(), "what was refused has made its folder"))


def recipes(results, command, alone, root):
    """Those of the page, with the programs and words of this test, on this machine."""
    text = PAGE.read_text()
    found = dict(re.findall(r"<!-- recipe: (\w+) -->\n```\w+\n(.*?)```", text, re.S))
    results.append((set(found) >= {"slurm", "parallel", "snakemake", "ray"}, f"recipes: {sorted(found)}"))
    for name, recipe in found.items():
        lines = [line for line in recipe.splitlines() if line.strip()]
        results.append((len(lines) <= 15, f"{name}: {len(lines)} lines"))
        folder = root / name
        folder.mkdir()
        recipe = re.sub(r"\bflash-sysid grid[^\n]*?(?= --resume)", " ".join(map(str, command)), recipe)
        recipe = recipe.replace("num_cpus=1", "num_cpus=0.25")  # all at the same time, on however few processors
        path = folder / {"snakemake": "Snakefile", "ray": "shards.py"}.get(name, "job.sh")
        path.write_text(recipe)
        if name == "slurm":
            tasks = [subprocess.Popen(["bash", path], cwd=folder, env=os.environ | {
                "SLURM_ARRAY_TASK_ID": str(k), "SLURM_ARRAY_TASK_MIN": "0", "SLURM_ARRAY_TASK_COUNT": "2"}) for k in range(2)]
            codes = [task.wait(timeout=600) for task in tasks]
        else:
            if not available(name):
                print(f"{name}: not installed, its recipe is not run")
                continue
            words = {"parallel": ["bash", path], "snakemake": ["snakemake", "--cores", "4", "-s", path], "ray": [sys.executable, path]}
            done = program.call(*words[name], cwd=folder)
            codes = [done.returncode]
            if done.returncode != 0:
                print(done.stdout, done.stderr)
        results.append((not any(codes), f"{name}: exit codes {codes}"))
        results.append((not same(folder / "run", alone), f"{name}: {same(folder / 'run', alone)} differ"))


def available(name):
    if name == "ray":
        return program.call(sys.executable, "-c", "import ray").returncode == 0
    return shutil.which(name) is not None


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sysid", required=True, help="the program flash-sysid")
    parser.add_argument("--counts", type=int, nargs="+", default=[3], help="programs that share a search")
    parser.add_argument("--seed", type=int, default=1, help="of the moments of the kills")
    options = parser.parse_args()
    sysid = pathlib.Path(options.sysid).resolve()
    results = []
    with tempfile.TemporaryDirectory() as temporary:
        root = pathlib.Path(temporary)
        asset, recording = program.synthesize(sysid, root)
        command = [sysid, "grid", recording, "--asset", asset, *AXES, "--threads", "1", "--quiet"]
        program.must(*command, "-o", root / "alone")
        alone = contents(root / "alone")
        counted(results, command, alone, root, options.counts, random.Random(options.seed))
        merged(results, command, alone, root)
        gone(results, command, alone, root)
        refused(results, command, root, recording, sysid)
        recipes(results, command, alone, root)
    return program.conclude(results)


if __name__ == "__main__":
    sys.exit(main())
