"""Recordings made by flash-sysid itself with known truth: whether the stated intervals hold it."""
import json
import math
import random

# A towel of 0.3 m. The truth is solved on half the cell of the search.
ASSET = {"schema": "flash-asset/1", "mesh": "sheet:0.3x0.3:0.0125", "element_type": "TRIANGLE",
         "mechanical_props": {"areal_density": 0.2, "young": 50.0, "poisson": 0.3, "constitutive": "TRI_COROTATED",
                              "bending_rigidity": 2e-4, "friction": 0.3}}
TRUTH_MESH, FIT_MESH = "sheet:0.3x0.3:0.01875:alternating_by_row", "sheet:0.3x0.3:0.01875"
LIFT = ("--kind", "corner_lift", "--displacement", "-0.05,-0.05,0.12", "--duration", "1.2", "--rate", "10", "--grasp-within", "0.0376", "--camera",
        "0.15,-0.55,0.6", "--camera", "0.75,0.7,0.5", "--resolution", "48x36", "--noise", "0.001")
# name: lowest, highest, values
RANGES = {"young": (10, 100, 5), "bending": (2e-4, 2e-3, 6), "friction": (0.15, 0.6, 6)}
TWINS = 100


def write_asset(out, name="towel.json", **properties):
    asset = json.loads(json.dumps(ASSET))
    asset["mechanical_props"].update(properties)
    path = out / name
    path.write_text(json.dumps(asset, indent=2) + "\n")
    return str(path)


def settings(parameters):
    return [word for key, value in parameters.items() for word in ("--set", f"{key}={value!r}")]


def axes(ranges):
    return [word for key, (low, high, count) in ranges.items() for word in (f"--{key}", f"{low}:{high}:{count}:log")]


def truth_of(seed):
    """Log-uniform over the searched range."""
    draw = random.Random(seed)
    return {name: low * (high / low) ** draw.random() for name, (low, high, _) in RANGES.items()}


def coverage(runs, twins=TWINS):
    """Each twin searched for all three parameters; the candidates' motions are the same for all and simulated once."""
    asset = write_asset(runs.out)
    found = []
    for seed in range(1, twins + 1):
        truth = truth_of(seed)
        recording = runs.synth(f"coverage/recording_{seed:03d}", asset, "--mesh", TRUTH_MESH, *LIFT, "--seed", str(seed),
                               *settings(truth))
        summary = runs.grid(f"coverage/run_{seed:03d}", [recording], "--asset", asset, "--mesh", FIT_MESH, *axes(RANGES),
                            "--rollouts", str(runs.out / "coverage" / "rollouts"))
        found.append({"seed": seed, "truth": truth, "parameters": summary["parameters"]})
    return found


def holds(finding, truth):
    """Whether the interval holds the truth; a bound is one: open on the side that it does not exclude."""
    low, high = finding["interval95"]
    verdict = finding["identifiable"]
    if verdict == "no":
        return None
    return ((verdict == "upper_bound" or low <= truth) and (verdict == "lower_bound" or truth <= high))


def coverage_rows(found):
    rows = []
    for name in RANGES:
        verdicts = [twin["parameters"][name]["identifiable"] for twin in found]
        held = [holds(twin["parameters"][name], twin["truth"][name]) for twin in found]
        two_sided = [twin["parameters"][name] for twin in found if twin["parameters"][name]["identifiable"] == "yes"]
        factors = sorted(math.sqrt(f["interval95"][1] / f["interval95"][0]) for f in two_sided)
        errors = sorted(abs(math.log(twin["parameters"][name]["estimate"] / twin["truth"][name])) for twin in found)
        rows.append({"name": name, "twins": len(found), "held": sum(h is not False for h in held),
                     "no": verdicts.count("no"), "one_sided": len(found) - verdicts.count("yes") - verdicts.count("no"),
                     "factor": factors[len(factors) // 2] if factors else math.nan,
                     "error": math.exp(errors[len(errors) // 2]) - 1})
    return rows


# Lifts with friction known: fitted on cells of 12.5 mm, true ones of 7.5 mm.
GENTLE_FIT, GENTLE_TRUTH, SEEDS = "sheet:0.3x0.3:0.0125", "sheet:0.3x0.3:0.0075", 20
BENDING = {1e-4: ("5e-5:2e-4:7:log", 0.15), 1e-5: ("4e-6:2.5e-5:7:log", 0.30)}  # searched, allowed error
BAR = ("--kind", "bar_pull", "--forces", "--mesh", TRUTH_MESH, "--duration", "0.6", "--rest", "0.2", "--rate", "10",
       "--camera", "0.15,0.0,0.6", "--camera", "0.35,0.35,0.5", "--resolution", "96x72", "--noise", "0.001")


def lift(runs, bending, seed):
    """A lift searched for D and nu. The motions are the same for all seeds, noise and occlusion are not."""
    asset = write_asset(runs.out)
    name = f"lift_{bending:g}"
    recording = runs.synth(f"{name}/recording_{seed:02d}", asset, "--mesh", GENTLE_TRUTH, *LIFT, "--seed", str(seed),
                           "--set", f"bending={bending!r}")
    return runs.grid(f"{name}/run_{seed:02d}", [recording], "--asset", asset, "--mesh", GENTLE_FIT, "--bending",
                     BENDING[bending][0], "--poisson", "0:0.45:3", "--fix", "friction=0.3", "--rollouts",
                     str(runs.out / name / "rollouts"))


def bar_pull(runs, seed):
    asset = write_asset(runs.out)
    recording = runs.synth(f"bar_pull/recording_{seed:02d}", asset, *BAR, "--seed", str(seed))
    return runs.grid(f"bar_pull/run_{seed:02d}", [recording], "--asset", asset, "--mesh", "sheet:0.3x0.3:0.025",
                     "--young", "25:100:7:log", "--poisson", "0.1:0.45:6", "--fix", "friction=0.3", "--rollouts",
                     str(runs.out / "bar_pull" / "rollouts"))


def experiment_rows(runs, seeds=SEEDS):
    rows = []
    for bending, (_, allowed) in BENDING.items():
        found = [lift(runs, bending, seed)["parameters"] for seed in range(1, seeds + 1)]
        errors = [abs(f["bending"]["estimate"] / bending - 1) for f in found]
        rows.append([f"lift, D = {bending:g}", "D", sum(e <= allowed for e in errors),
                     sum(holds(f["bending"], bending) is not False for f in found), max(errors)])
        rows.append([f"lift, D = {bending:g}", "nu not identifiable",
                     sum(f["poisson"]["identifiable"] == "no" for f in found), seeds, math.nan])
    found = [bar_pull(runs, seed)["parameters"] for seed in range(1, seeds + 1)]
    for name, truth, allowed in (("young", 50.0, 0.03 * 50), ("poisson", 0.3, 0.03)):
        errors = [abs(f[name]["estimate"] - truth) for f in found]
        sure = [f[name]["identifiable"] == "yes" for f in found]
        rows.append(["bar pull", name, sum(e <= allowed and s for e, s in zip(errors, sure)),
                     sum(holds(f[name], truth) is not False for f in found), max(errors) / truth])
    return rows
