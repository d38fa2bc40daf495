"""What a search of flash-sysid found, read from its folder."""
import dataclasses
import json
import os
import pathlib

import numpy as np

from flash_sim import _core, arguments


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Answer:
    """A finished search. Dicts are by name of a parameter, in the units of `units`."""
    path: str  # of summary.json
    values: dict[str, float]  # every parameter of the estimate, those that were held included
    estimates: dict[str, float]  # of what was searched, also where the verdict is "no"; without those that have none
    intervals: dict[str, tuple[float, float]]  # 95 %, of what was searched and is not "no"; of a bound one end is the range's
    verdicts: dict[str, str]  # of what was searched: "yes", "no", "lower_bound" or "upper_bound"
    notes: dict[str, str]  # why, in a line
    bits: dict[str, float]  # log2 of the usual range over the interval
    units: dict[str, str]  # of values; "1" for a number without one
    held: dict[str, dict]  # what was not searched: value, source and, where stated, deviation
    samples: np.ndarray  # (draws,) structured: a field a parameter that was searched, and "weight"
    score: float  # of the estimate on the mesh that was searched [m]
    recordings: list[dict]  # as in summary.json
    warnings: list[str]
    usable: bool  # False: flash-sysid ended with exit code 3, and the first warning says why
    summary: dict  # all of summary.json

    def __repr__(self):
        found = ", ".join(f"{name}: {verdict}" for name, verdict in self.verdicts.items())
        return f"Answer({self.path!r}: {found}, usable={self.usable})"


def answer(folder: str | os.PathLike) -> Answer:
    """Reads the folder of a search (grid, fit), or its summary.json. ValueError where there is none, or where it was edited.

    samples: the draws of the posterior that the folder keeps (64), as a structured array. Their `weight` is the share of the
    posterior that each stands for; draws are alike likely, so all are 1 / len(samples). Where the weight of the object was
    not measured, there is a field "areal_density" too (of a solid "density"): motion tells stiffnesses as ratios to it. An
    answer without a posterior has none.
    """
    path = pathlib.Path(arguments.path("answer: folder", folder, "the folder of a search"))
    if path.is_dir():
        path = path / "summary.json"
    if not path.is_file():
        raise ValueError(f"answer: folder: found no {path}, expected the folder of a finished search; flash-sysid grid --resume "
                         "finishes one")
    _core.check_summary(str(path))
    summary = json.loads(path.read_text(encoding="utf-8"))
    found, names = summary["parameters"], summary["axes"]
    values = summary["best"]["parameters"]

    def of_each(field, names=names):
        return {name: found[name][field] for name in names if found[name].get(field) is not None}

    told = [name for name in names if found[name]["identifiable"] != "no"]
    return Answer(
        path=str(path), values=values, estimates=of_each("estimate"),
        intervals={name: tuple(interval) for name, interval in of_each("interval95", told).items()},
        verdicts=of_each("identifiable"), notes=of_each("note"), bits=of_each("bits"),
        units={name: _unit(name, summary["settings"]) for name in dict.fromkeys([*values, *names])},
        held=summary["fixed"], samples=_samples(summary), score=summary["best"].get("score_on_mesh", summary["best"]["score"]),
        recordings=summary["recordings"], warnings=summary["warnings"], usable=summary["exit_code"] == 0, summary=summary)


def _unit(name, settings):
    if name == "young":  # E of a solid and of a sheet of known thickness, else E t
        return "Pa" if "thickness_m" in settings or "element_type" in settings else "N/m"
    return next((unit or "1" for known, unit, *_ in _core.parameters() if known == name), "1")


def _samples(summary):
    count = len(summary["samples"])
    columns = dict(zip(summary["axes"], np.array(summary["samples"], float).reshape(count, len(summary["axes"])).T))
    if summary.get("sample_weights"):
        columns["density" if "element_type" in summary["settings"] else "areal_density"] = np.array(summary["sample_weights"], float)
    samples = np.zeros(count, [(name, np.float64) for name in [*columns, "weight"]])
    for name, column in columns.items():
        samples[name] = column
    samples["weight"] = 1 / count if count else 0
    return samples
