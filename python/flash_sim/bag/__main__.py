"""python -m flash_sim.bag IN -o FOLDER: a recording as a folder that `flash-calib handeye` or `flash-sysid segment` reads."""
import argparse
import os
import shlex
import signal
import sys

import numpy as np

from flash_sim.bag import arrival, choice, hand_eye_folder, lift_folder
from flash_sim.bag.camera import between, open_camera
from flash_sim.bag.containers import Recording
from flash_sim.bag.errors import RecordingError, one_line
from flash_sim.bag.robot_poses import JOINT_KIND, POSE_KINDS, pose_topics, read_robot_poses, read_tum
from flash_sim.bag.staged_folder import StagedFolder
from flash_sim.bag.streams import interval
from flash_sim.bag.transforms import TF_KINDS, read_transforms

NAME = "flash_sim.bag"
DONE, FAILED, BAD_INPUT = 0, 1, 2
EXAMPLES = """examples:
  python -m flash_sim.bag cell.bag                                       lists the topics
  python -m flash_sim.bag cell.mcap -o wrist --base base_link --tool tool0
  flash-calib handeye wrist --setup eye-in-hand --target chessboard:9x6:0.025 -o camera.json
  python -m flash_sim.bag lift.mcap -o lift_raw --for segment --extrinsics camera.json"""


class Said:
    """What people are told on the way."""

    def __init__(self, quiet):
        self._quiet = quiet

    def __call__(self, text):
        if not self._quiet:
            print(text, flush=True)

    def warning(self, text):
        """On stderr, unless it is empty."""
        if text:
            print(one_line(f"{NAME}: warning: {text}"), file=sys.stderr)

    def left_out(self, topic, count, why):
        """Of pictures, where there are any."""
        if count:
            self.warning(f"{topic}: {count} pictures {why} and are left out")


class Parser(argparse.ArgumentParser):
    """Refuses in one line."""

    def error(self, message):
        self.exit(BAD_INPUT, f"{NAME}: {message}\n")


def parser():
    """The command line."""
    p = Parser(prog=f"python -m {NAME}",
               description="Turns a recording (ROS 1 .bag, rosbag2 folder, .db3, .mcap; of ROS, RealSense or Orbbec) into a folder "
               "that flash-calib handeye or flash-sysid segment reads. Needs no ROS.",
               epilog=EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter, allow_abbrev=False)
    p.add_argument("recording", metavar="IN", help="file or folder of a recording; without -o its topics are listed")
    p.add_argument("-o", "--out", metavar="FOLDER", help="folder to write")
    p.add_argument("--list", action="store_true", help="list the topics and end")
    p.add_argument("--for", dest="reader", choices=("handeye", "segment"), default="handeye", help="which program reads the folder")
    p.add_argument("--topics", metavar="TOPIC", nargs="+", default=[], action="extend", help="take these, where several would do")
    p.add_argument("--base", metavar="FRAME", default="", help="base of the robot, in /tf or its description")
    p.add_argument("--tool", metavar="FRAME", default="", help="tool of the robot, in /tf or its description")
    p.add_argument("--urdf", metavar="FILE", default="", help="description of the robot, for joint states")
    p.add_argument("--poses", metavar="FILE", default="", help="poses of the tool from a TUM file, by the clock of the pictures")
    p.add_argument("--without-poses", action="store_true", help="write no poses")
    p.add_argument("--camera-info", metavar="FILE", default="", help="the lens, instead of that of the recording")
    p.add_argument("--extrinsics", metavar="FILE", default="", help="where the camera is on the base, copied for segment")
    p.add_argument("--depth-scale", metavar="METRES", type=number(1e-7, 1),
                   help="metres per count of depth, instead of the recording's")
    p.add_argument("--views", metavar="N", type=int,
                   help="at most N views of handeye, of those where the robot stands still")
    p.add_argument("--every", metavar="SECONDS", type=number(0, 3600),
                   help="take pictures of a moving arm at least this far apart, with the poses over time")
    p.add_argument("--from", dest="start", metavar="SECONDS", type=number(0, 1e9),
                   help="leave out what is before, since the first picture")
    p.add_argument("--until", dest="end", metavar="SECONDS", type=number(0, 1e9), help="leave out what is after")
    p.add_argument("--setup", choices=("eye-in-hand", "eye-to-hand"), default="", help="written to target.json")
    p.add_argument("--target", metavar="TEXT", default="", help="the target, as chessboard:9x6:0.025, written to target.json")
    p.add_argument("--force", action="store_true", help="write over what is there")
    p.add_argument("--quiet", action="store_true", help="print warnings and errors only")
    return p


def number(low, high):
    """A type of options: a number between two."""
    def parse(text):
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if not low <= value <= high:
            raise argparse.ArgumentTypeError(f"found \"{text}\", expected a number from {low:g} to {high:g}")
        return value
    return parse


def list_topics(recording):
    """Prints each topic with its type, its count and what it is taken for."""
    pictures = {picture.name: picture for picture in choice.survey(recording)}
    width = max((len(name) for name in recording.topics), default=0)
    for topic in recording.topics.values():
        print(one_line(f"{topic.name:{width}}  {topic.count:6d}  {topic.kind}{_taken_for(topic, pictures)}"))


def _taken_for(topic, pictures):
    picture = pictures.get(topic.name)
    if picture:
        return f"  {'depth' if picture.depth else 'pictures'}, {picture.encoding}, frame {picture.frame}"
    if topic.kind in (*TF_KINDS, *POSE_KINDS, JOINT_KIND):
        return "  poses"
    return {choice.INFO_KIND: "  lens", choice.CLOUD_KIND: "  clouds"}.get(topic.kind, "")


def convert(recording, settings, said):
    """Writes the folder; how many views or frames it has."""
    choice.expect_topics(recording, settings.topics)
    read = [path for path in (settings.recording, settings.urdf, settings.poses, settings.camera_info, settings.extrinsics) if path]
    folder = StagedFolder(settings.out, settings.force, read)
    tree = read_transforms(recording)
    stream, topic = _robot(recording, tree, settings, said)
    if settings.extrinsics and settings.reader != "segment":
        said.warning(f"--extrinsics {settings.extrinsics}: is not used, since it is for segment")
    colour, depth = choice.choose_pictures(recording.path, choice.survey(recording), settings.topics)
    if settings.reader == "segment" and depth is None:
        cloud = choice.choose_cloud(recording, settings.topics)
        if cloud:
            with folder:
                return lift_folder.write_clouds(recording, cloud, stream, tree, folder, settings, said)
    if not (colour or depth):
        raise RecordingError(f"{recording.path}: found no pictures and no depth, expected sensor_msgs/Image or CompressedImage")
    camera = open_camera(recording, colour, depth, tree, settings.depth_scale, bool(settings.camera_info))
    camera = between(recording.path, camera, settings.start, settings.end)
    _say_camera(camera, said)
    if topic:
        main = camera.main.name
        said.warning(arrival.doubt(camera.stamps[main].delay, arrival.delay_of(recording, topic), main, topic))
    with folder:
        if settings.reader == "segment":
            return lift_folder.write_lift(recording, camera, stream, tree, folder, settings, said)
        return hand_eye_folder.write_hand_eye(recording, camera, stream, folder, settings, said)


def _robot(recording, tree, settings, said):
    """The stream of T_base_tool, None where it is left out; and its topic, if it has one."""
    if settings.without_poses:
        return None, ""
    if settings.poses:
        return read_tum(settings.poses), ""
    topics = pose_topics(recording, tree, settings.topics)
    stream = read_robot_poses(recording, tree, topics, settings.base, settings.tool, settings.urdf)
    said(f"poses: {stream.source}, {len(stream.times)} of them{_rate(stream.times)}")
    if settings.urdf and recording.topics[topics[0]].kind != JOINT_KIND:
        said.warning(f"--urdf {settings.urdf}: is not used, since the poses are no joints")
    return stream, topics[0]


def _say_camera(camera, said):
    for picture in filter(None, (camera.colour, camera.depth)):
        scale = f", {camera.scale:g} m a count" if picture is camera.depth else ""
        said(f"{'depth' if picture.depth else 'pictures'}: {picture.name}, {picture.count} of {picture.encoding}"
             f"{_rate(camera.stamps[picture.name].times)}{scale}")
    if camera.align is not None:
        said(f"depth is reprojected onto {camera.colour.name} by the recording's extrinsics")


def _rate(times):
    step = interval(times)
    return f", {1e9 / step:.1f} a second" if step else ""


def _next(settings, count):
    """What was written, and the command that reads it."""
    out = shlex.quote(settings.out)
    if settings.reader == "segment":
        poses = "" if settings.without_poses else f" --trajectory {out}/gripper.tum"
        return f"{count} frames\nnext: flash-sysid segment {out}/{lift_folder.VIEW}{poses} --times {out}/times.csv -o segmented"
    if settings.without_poses:
        return f"{count} pictures, named by their times; put the robot's poses beside them, poses.tum"
    offset = " --time-offset" if settings.every is not None else ""
    setup, target = settings.setup or "eye-in-hand", settings.target or "chessboard:9x6:0.025"
    yours = "" if settings.setup and settings.target else ", with your setup and target"
    return f"{count} views\nnext{yours}: flash-calib handeye {out} --setup {setup} --target {target}{offset} -o camera.json"


def run(settings):
    """The exit code."""
    if settings.out is None or settings.list:
        with Recording(settings.recording) as recording:
            list_topics(recording)
        return DONE
    if settings.views is not None and (settings.views <= 0 or settings.every is not None):
        raise RecordingError("--views: expected a number above 0, without --every")
    said = Said(settings.quiet)
    with Recording(settings.recording) as recording:
        count = convert(recording, settings, said)
    said(_next(settings, count))
    return DONE


def main(arguments=None):
    """Runs the command line `arguments`; the exit code. Whatever is refused is one line on stderr and 2."""
    settings = parser().parse_args(arguments)
    try:
        with np.errstate(all="ignore"):  # numbers that are none are refused where they count
            return run(settings)
    except RecordingError as error:
        print(f"{NAME}: {error}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        print(f"{NAME}: stopped", file=sys.stderr)
        return FAILED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except OSError as error:
        print(one_line(f"{NAME}: {error.filename or settings.out}: {error.strerror}"), file=sys.stderr)
        return FAILED


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    sys.exit(main())
