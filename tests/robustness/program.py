"""The programs under test, and recordings that they make themselves."""
import functools
import json
import shutil
import subprocess

ASSET = {"schema": "flash-asset/1", "mesh": "sheet:0.2x0.2:0.05:alternating", "element_type": "TRIANGLE",
         "mechanical_props": {"areal_density": 0.2, "thickness": 0.001, "young": 5e4, "poisson": 0.3,
                              "constitutive": "TRI_COROTATED", "bending_rigidity": 1e-4, "friction": 0.3}}


def call(program, *words, **options):
    return subprocess.run([str(program), *map(str, words)], capture_output=True, text=True, errors="replace", **options)


def must(program, *words):
    done = call(program, *words)
    if done.returncode != 0:
        raise SystemExit(f"{program} {' '.join(map(str, words))}: exit code {done.returncode}\n{done.stderr}")
    return done


@functools.lru_cache(maxsize=1)
def contents(folder):
    """The files of a folder that stays as it is, and its folders as None."""
    return {path.relative_to(folder): path.read_bytes() if path.is_file() else None for path in sorted(folder.rglob("*"))}


def renew(sound, folder):
    """Makes `folder` what `sound` is, which stays as it is. Only what differs is written: ext4 is slow to make files where others
    were just removed."""
    known = contents(sound)
    folder.mkdir(exist_ok=True)
    for path in sorted(folder.rglob("*"), reverse=True):  # what is in a folder before it
        name = path.relative_to(folder)
        as_known = name in known and not path.is_symlink() and (path.is_dir() if known[name] is None else path.is_file())
        if not as_known:
            path.rmdir() if path.is_dir() and not path.is_symlink() else path.unlink()
    for name, content in known.items():
        path = folder / name
        if content is None:
            path.mkdir(exist_ok=True)
        elif not path.exists() or path.read_bytes() != content:
            path.write_bytes(content)
            shutil.copystat(sound / name, path)


def conclude(results):
    """Prints what does not hold of (holds, complaint), and how much does; the exit status."""
    for holds, complaint in results:
        if not holds:
            print(complaint, flush=True)
    wrong = sum(not holds for holds, _ in results)
    print(f"{len(results) - wrong} of {len(results)} statements hold")
    return 1 if wrong else 0


def rotation_of(q):
    """The matrix of a unit quaternion x y z w."""
    x, y, z, w = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def synthesize(sysid, folder, *options, seed=1, mesh=ASSET["mesh"], duration=0.6):
    """An asset and a recording of it, a short corner lift."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "asset.json").write_text(json.dumps(ASSET, indent=1))
    must(sysid, "synth", "--asset", folder / "asset.json", "--kind", "corner_lift", "--mesh", mesh, "--duration", duration,
         "--seed", seed, "--quiet", *options, "-o", folder / "recording")
    return folder / "asset.json", folder / "recording"
