"""Recordings of ROS 1, ROS 2, RealSense and Orbbec as the folders that flash-calib and flash-sysid read: python -m flash_sim.bag."""
