"""Cloth and soft bodies in many environments, on assets that were identified from recordings.

RealtimeSim steps a scene; Asset reads what was identified. All numbers are in SI units, all arrays float64.
"""
from flash_sim._core import State, __version__
from flash_sim.asset import Asset
from flash_sim.cameras import look_at
from flash_sim.device_array import DeviceArray, to_host
from flash_sim.depth_noise import DepthNoise, add_depth_noise, jitter_poses
from flash_sim.realtime_sim import RealtimeSim

__all__ = ["Asset", "DepthNoise", "DeviceArray", "RealtimeSim", "State", "__version__", "add_depth_noise", "jitter_poses", "look_at",
           "to_host"]
