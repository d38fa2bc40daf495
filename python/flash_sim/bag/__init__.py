"""python -m flash_sim.bag: recordings of ROS, RealSense and Orbbec as the folders that flash-calib and flash-sysid read."""
