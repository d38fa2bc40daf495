"""Cloth and soft bodies in many environments, on assets that were identified from recordings.

RealtimeSim steps a scene; Asset reads what was identified. All numbers are in SI units, all arrays float64.
"""
from flash_sim._core import State, __version__
from flash_sim.asset import Asset
from flash_sim.realtime_sim import RealtimeSim

__all__ = ["Asset", "RealtimeSim", "State", "__version__"]
