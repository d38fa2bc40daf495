"""Where a camera is, on the gripper or beside the robot, and how sure that is.

handeye_pairs calibrates from poses of the target that something else has found, handeye_corners from its corners in pictures. load
reads what flash-calib or Calibration.save wrote. The numbers are those of the program flash-calib. All arrays are float64 in SI
units; pixels are counted from the middle of the upper left one.

    answer = flash_calib.handeye_pairs("eye-in-hand", T_base_gripper, T_camera_target)
    print(answer.T, answer.sd, answer.usable, answer.warnings)

A pose T_parent_child takes points of the child's frame into the parent's. A covariance is of (dx, dy, dz, rx, ry, rz) [m, rad] in
T [Exp(r), d]: along and about the axes of the child.
"""
from flash_calib._core import __version__
from flash_calib.cameras import Camera, load_camera
from flash_calib.handeye import handeye_corners, handeye_pairs, target_points
from flash_calib.results import Calibration, HeldOut, Lens, Noise, Size, Weakest, load

__all__ = ["Calibration", "Camera", "HeldOut", "Lens", "Noise", "Size", "Weakest", "__version__", "handeye_corners", "handeye_pairs",
           "load", "load_camera", "target_points"]
