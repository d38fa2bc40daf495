"""Cloth and soft bodies in many environments, on assets that were identified from recordings.

RealtimeSim steps a scene; Asset reads what was identified; sysid replays recordings and reads answers; calib, which comes with a
wheel of its own, says where cameras are. All numbers are in SI units, all arrays float64. The compiled part is loaded with the
first of these names; flash_sim.bag needs none of it.
"""
import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flash_sim._core import State, __version__
    from flash_sim.asset import Asset
    from flash_sim.cameras import look_at
    from flash_sim.depth_noise import DepthNoise, add_depth_noise, jitter_poses
    from flash_sim.device_array import DeviceArray, to_host
    from flash_sim.realtime_sim import RealtimeSim

_MODULES = {"State": "_core", "__version__": "_core", "Asset": "asset", "look_at": "cameras", "DeviceArray": "device_array",
            "to_host": "device_array", "DepthNoise": "depth_noise", "add_depth_noise": "depth_noise",
            "jitter_poses": "depth_noise", "RealtimeSim": "realtime_sim"}
__all__ = ["Asset", "DepthNoise", "DeviceArray", "RealtimeSim", "State", "__version__", "add_depth_noise", "jitter_poses",
           "look_at", "to_host"]


def __getattr__(name):
    """Of this package, or a module of it that the names above come from, as flash_sim.asset."""
    if name in _MODULES:
        value = getattr(importlib.import_module(f"{__name__}.{_MODULES[name]}"), name)
        globals()[name] = value
        return value
    if name in {*_MODULES.values(), "arguments", "calib", "programs", "sysid"}:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__():
    return sorted({*globals(), *__all__, "calib", "sysid"})
