"""What was identified of a material."""
import json
import os

import numpy as np

from flash_sim import _core, arguments

# Names of a tuned asset's parameters, and of the numbers of a material that they are.
MATERIAL = {"poisson": "poissons_ratio", "bending": "bending_rigidity", "areal_density": "areal_density", "density": "density",
            "friction": "friction", "air_drag": "air_drag", "stiffness_damping": "stiffness_damping",
            "yield_curvature": "yield_curvature"}


class Asset:
    """An asset file. Of one that `flash-sysid export` has tuned, what was found and how well it is known."""

    def __init__(self, path: str | os.PathLike):
        self.path = arguments.path("Asset: path", path, "an asset file")
        _core.check_asset(self.path)
        with open(self.path, encoding="utf-8") as file:
            self._file = json.load(file)
        self._found = self._file.get("identification") or {}

    @property
    def values(self) -> dict[str, float]:
        """The numbers of the file by name."""
        return {name: value for name, value in self._file["mechanical_props"].items()
                if isinstance(value, (int, float)) and not isinstance(value, bool)}

    @property
    def units(self) -> dict[str, str]:
        """The unit of each number, where the file states them; "1" for a number without one."""
        return dict(self._found.get("units") or {})

    @property
    def is_identified(self) -> bool:
        """Whether it holds draws of a posterior."""
        return bool((self._found.get("samples") or {}).get("values"))

    @property
    def intervals(self) -> dict[str, tuple[float, float]]:
        """95 % intervals (low, high) of the parameters that were identified, by name."""
        return {name: tuple(interval) for name, interval in (self._found.get("interval95") or {}).items() if interval}

    @property
    def verdicts(self) -> dict[str, str]:
        """Whether the recordings told each parameter that was searched: "yes", "no", "lower_bound" or "upper_bound"."""
        return dict(self._found.get("identifiable") or {})

    @property
    def caveats(self) -> list[str]:
        """What to know of the intervals, a line each."""
        return list(self._found.get("caveats") or [])

    def draws(self, n: int, seed: int = 0) -> dict[str, np.ndarray]:
        """n joint draws of the posterior: a dict of (n,) arrays, in the units of the file.

        The file holds some draws of all parameters together (64 as `flash-sysid export` writes them). These are rows of them:
        each once, in a random order, before any is taken again. Correlations stay. Raises ValueError where it has none.
        """
        n = arguments.whole_number("draws: n", n, 0)
        random = np.random.default_rng(arguments.whole_number("draws: seed", seed, 0, 2**63 - 1))
        if not self.is_identified:
            raise ValueError(f"{self.path}: identification.samples: found none, expected those of flash-sysid export")
        samples = self._found["samples"]
        rows = arguments.numbers(f"{self.path}: identification.samples.values", samples["values"],
                                 (None, len(samples["parameters"])))
        order = np.concatenate([random.permutation(len(rows)) for _ in range(-(-n // len(rows)) or 1)])[:n]
        return {name: rows[order, k] for k, name in enumerate(samples["parameters"])}

    def as_material(self, draws: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
        """Draws under the names and units of RealtimeSim.set_material; what a material has no number for is left out."""
        material = {MATERIAL[name]: np.asarray(values) for name, values in draws.items() if name in MATERIAL}
        if "young" in draws:
            young = np.asarray(draws["young"])
            material["youngs_modulus"] = young
            material["membrane_stiffness"] = young * self.values.get("thickness", 1.0)  # E t without a thickness
        return material
