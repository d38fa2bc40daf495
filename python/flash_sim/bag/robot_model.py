"""The kinematics of a robot from its URDF."""
import xml.etree.ElementTree
from dataclasses import dataclass

import numpy as np

from flash_sim.bag import rigid
from flash_sim.bag.errors import refusal


@dataclass(frozen=True)
class Joint:
    """A joint of a chain."""

    name: str
    kind: str           # revolute, continuous, prismatic or fixed
    origin: np.ndarray  # (4, 4), T_parent_joint at zero
    axis: np.ndarray    # (3,), unit


class RobotModel:
    """The joints of a robot from one link to another."""

    def __init__(self, joints, base, tip):
        self._joints, self.base, self.tip = joints, base, tip

    @property
    def moving(self):
        """Names of the joints that move, from the base on."""
        return [joint.name for joint in self._joints if joint.kind != "fixed"]

    @property
    def turning(self):
        """Which of `moving` turn, bool."""
        return np.array([joint.kind != "prismatic" for joint in self._joints if joint.kind != "fixed"])

    def pose(self, angles):
        """T_base_tip (4, 4) of the values of `moving` [rad, m]."""
        product, values = np.eye(4), iter(angles)
        for joint in self._joints:
            product = product @ joint.origin
            if joint.kind == "prismatic":
                product = product @ rigid.transform(np.eye(3), next(values) * joint.axis)
            elif joint.kind != "fixed":
                product = product @ rigid.transform(turn(joint.axis, next(values)), np.zeros(3))
        return product


def turn(axis, angle):
    """The rotation (3, 3) by an angle [rad] about a unit axis."""
    return rigid.rotation_of([*(np.sin(angle / 2) * np.asarray(axis)), np.cos(angle / 2)])


def robot_model(text, where, base="", tip="", usual_tips=()):
    """The RobotModel of a URDF from the link `base` to the link `tip`. Empty: the link without a parent; the only one without
    children, else the first of `usual_tips` that is there. Throws RecordingError, which begins with `where`."""
    try:
        root = xml.etree.ElementTree.fromstring(text)
    except xml.etree.ElementTree.ParseError as error:
        raise refusal(where, f"found no XML ({error}), expected a URDF") from error
    if root.tag != "robot":
        raise refusal(where, f"found an element {root.tag}, expected robot, as of a URDF")
    carried = {}
    for element in root.findall("joint"):
        links = [element.find(name).get("link") for name in ("parent", "child") if element.find(name) is not None]
        if len(links) == 2:
            carried[links[1]] = (links[0], element)
    parents = {parent for parent, _ in carried.values()}
    base = base or _only(parents - set(carried), where, "the base", "--base")
    leaves = set(carried) - parents
    usual = [] if len(leaves) == 1 else [name for name in usual_tips if name in carried]
    tip = tip or (usual or [_only(leaves, where, "the tool", "--tool")])[0]
    joints, link = [], tip
    while link != base:
        if link not in carried or len(joints) > len(carried):
            raise refusal(where, f"found no chain of joints from link {base} to link {tip}, expected one of "
                                 f"{', '.join(sorted(parents | set(carried)))}")
        link, element = carried[link]
        joints.append(_joint(element, where))
    return RobotModel(joints[::-1], base, tip)


def _only(links, where, what, option):
    if len(links) != 1:
        raise refusal(where,
                      f"found {len(links)} links that can be {what} ({', '.join(sorted(links))}), expected one: state {option}")
    return next(iter(links))


def _joint(element, where):
    name, kind = element.get("name", ""), element.get("type", "")
    where = f"{where}: joint {name}"
    if kind not in ("revolute", "continuous", "prismatic", "fixed"):
        raise refusal(where, f"found type {kind}, expected revolute, continuous, prismatic or fixed")
    origin, axis = element.find("origin"), element.find("axis")
    roll, pitch, yaw = _three(origin, "rpy", (0, 0, 0), where)
    rotation = turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll)
    direction = _three(axis, "xyz", (1, 0, 0), where)
    if kind != "fixed" and element.find("mimic") is not None:
        raise refusal(where, "follows another joint (mimic), expected one that moves by itself")
    if not np.linalg.norm(direction) > 1e-6:
        raise refusal(where, "found an axis of no length")
    return Joint(name, kind, rigid.transform(rotation, _three(origin, "xyz", (0, 0, 0), where)),
                 direction / np.linalg.norm(direction))


def _three(element, name, otherwise, where):
    text = element.get(name) if element is not None else None
    try:
        values = np.array([float(word) for word in text.split()] if text else otherwise, np.float64)
    except ValueError:
        values = np.empty(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise refusal(where, f"found {name} \"{text}\", expected three numbers")
    return values
