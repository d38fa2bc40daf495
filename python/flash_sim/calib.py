"""Hand-eye calibration: the package flash_calib under this name. It comes with a wheel of its own, as it needs Ceres."""
try:
    from flash_calib import *  # noqa: F403
    from flash_calib import __all__, __doc__  # noqa: F401
except ModuleNotFoundError as error:
    if error.name != "flash_calib":
        raise
    raise ModuleNotFoundError("flash_sim.calib: found no package flash_calib, expected that of the wheel flash-calib "
                              "(pip install ./python/calib of a checkout)", name="flash_calib") from None
