"""How many metres a count of a depth picture is."""
import re

from flash_sim.bag.errors import refusal

MILLIMETRES = 0.001  # of 16UC1 by ROS, and where nothing else is known
# RealSense cameras whose counts are no millimetres; its own recordings name the camera.
BY_NAME = {"L515": 0.00025, "D405": 0.0001}


def depth_scale(recording, topic):
    """(metres a count, where that is from) of a topic of depth: an option of RealSense's own recordings, else the camera's name
    there, else millimetres. Throws RecordingError where the option is no scale."""
    sensor = re.match(r"/device_\d+/sensor_\d+", topic)
    if not sensor:
        return MILLIMETRES, "millimetres, as 16UC1 is in ROS"
    for name in recording.topics:
        if re.fullmatch(re.escape(sensor[0]) + "/option/depth[ _]units/value", name, re.IGNORECASE):
            value = float(f"{float(recording.first(name).data):.6g}")  # of a float32
            if not 1e-6 < value < 0.1:
                raise refusal(recording.path, name, f"found {value:g} m a count, expected as 0.001")
            return value, name
    device = topic.split("/")[1]
    for _, message in recording.messages([f"/{device}/info"]):
        for model, scale in BY_NAME.items():
            if str(getattr(message, "key", "")).lower() == "name" and model in str(message.value):
                return scale, f"the camera's name, {message.value}"
    return MILLIMETRES, "millimetres, as no option Depth Units is recorded"
