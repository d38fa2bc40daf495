"""A scene in many environments, driven step by step."""
import os

import numpy as np
from numpy.typing import ArrayLike

from flash_sim import _core, arguments, cameras
from flash_sim.asset import Asset
from flash_sim.device_array import DeviceArray, DeviceStatus, to_host

STATUS = np.dtype([(name, np.float64) for name in
                   ("steps", "time", "converged", "residual", "penetration", "parts", "lost")])
PUBLISHED_RANGE = (0.5, 1.5)  # factors on what an asset has


class RealtimeSim:
    """A scene in `n_envs` environments that stay alive.

        sim = flash_sim.RealtimeSim(); sim.load_config("scene.json"); sim.set_envs(n_envs=128); sim.initialize()
        sim.add_ee("left", start_pose, size=[0.05] * 3)
        for _ in range(1000):
            sim.move_ee("left", pose); sim.grasp_ee("left", grasp)
            sim.step()

    Units are SI. A pose is x y z qx qy qz qw, of the end effector in the frame of the scene. Numbers may be given as float32
    or integers and are converted to float64. `env_ids` are numbers of environments, or a mask of n_envs bools; None means all.
    What is given holds from the next step on.

    positions, velocities, force and status are live: read-only views on the memory of the simulation, which show the
    end of the last step. Copy what has to stay: flash_sim.to_host(view) does on any device. On the processor they are arrays
    of numpy, of which an old one keeps its last numbers after another initialize(). On a CUDA device they are DeviceArray.
    What is given may be on such a device as well; it is copied through the memory of the processor.

    A refused argument raises ValueError or TypeError with its name, what was found and what was expected, and changes
    nothing. An environment whose step fails is lost: status()["lost"] is not 0, the others go on, and reset brings it back.
    """

    def __init__(self, device: str = "auto", seed: int = 0, threads: int = 0):
        """device: "cpu", "cuda" (the first CUDA device), or by number, as "cuda:1". "auto" is cuda where there is one that can
        step the scene, else cpu. threads: of the processor; 0 takes one per processor."""
        _core.check_device(arguments.text("device", device))
        self._device = device
        self._threads = arguments.whole_number("threads", threads, 0, 1024)
        self._scene = self._simulation = None
        self._n_envs = 1
        self.seed(seed)

    # -- setting up -----------------------------------------------------------------------------------------------------

    def load_config(self, path: str | os.PathLike) -> None:
        """Reads a scene file: the published format, or flash-scene/1. It holds from the next initialize() on."""
        self._scene = _core.load_scene(arguments.path("load_config: path", path, "a scene file"))

    def set_envs(self, n_envs: int) -> None:
        """How many environments the next initialize() makes."""
        self._n_envs = arguments.whole_number("set_envs: n_envs", n_envs, 1, 1_000_000)

    def initialize(self) -> None:
        """Makes the environments, all at the start of the scene. End effectors are added anew after it.

        ValueError where the device cannot step the scene, MemoryError where its memory does not suffice.
        """
        if self._scene is None:
            raise RuntimeError("initialize: found no scene, expected load_config(path) before")
        simulation = _core.Simulation(self._scene, self._n_envs, self._threads, self._device)
        self.close()
        self._simulation = simulation
        self._initialized_envs = self._n_envs
        self._triangles = self._simulation.objects()
        self._assets = self._scene.assets
        self._start_materials = {body: self.material(body) for body in self._triangles}

    def close(self) -> None:
        """Gives back what the environments take, once no array shows it any more. Only initialize() can follow."""
        if self._simulation is not None:
            self._simulation.close()
        self._simulation = None

    def add_ee(self, name: str, start_pose: ArrayLike, size: ArrayLike = (0.05, 0.05, 0.05), reach: float = 0.01,
               friction: float | None = None, collides: bool = True) -> None:
        """Adds an open end effector to every environment, before the first step.

        start_pose: (7,), (n_envs, 7), or (3,), (n_envs, 3) without a turn. size: edges of its box [m]. The box is an
        obstacle that moves, with a Coulomb coefficient `friction`, or that of each material; `collides=False` lets it pass
        through. When it closes it holds all vertices within `reach` [m] of the box.
        """
        simulation = self._ready("add_ee")
        taken = to_host(self.status()["steps"])
        if taken.any():
            raise ValueError(f"add_ee: found {taken.max():.0f} steps taken since initialize() or reset(), expected end effectors to be "
                             "added before the first step of all environments")
        no_turn = np.tile([0.0, 0, 0, 0, 0, 0, 1], (self.n_envs, 1))
        simulation.add_end_effector(
            self._new_name("add_ee: name", name), arguments.poses("add_ee: start_pose", start_pose, no_turn),
            self._above("add_ee: size", size, (3,), 0, equal=False).tolist(),
            float(self._above("add_ee: reach", reach, (), 0, equal=True)), bool(collides),
            None if friction is None else float(self._above("add_ee: friction", friction, (), 0, equal=True)))

    # -- driving --------------------------------------------------------------------------------------------------------

    def move_ee(self, name: str, pose: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """Where an end effector is at the end of the next step, and stays: (7,) or (n, 7); (3,), (n, 3) keep the turn."""
        simulation = self._ready("move_ee")
        self._effector("move_ee: name", name)
        ids = self._ids("move_ee", env_ids)
        simulation.move_end_effector(name, ids, arguments.poses("move_ee: pose", pose, simulation.pose(name)[ids]))

    def grasp_ee(self, name: str, grasp: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """Whether an end effector is closed: bool, or (n,) bool.

        Where it closes, the next step begins by taking the vertices that are within reach then. A closed one takes no
        more: open it first. held() says how many it has.
        """
        simulation = self._ready("grasp_ee")
        self._effector("grasp_ee: name", name)
        ids = self._ids("grasp_ee", env_ids)
        closed = arguments.truths("grasp_ee: grasp", grasp, len(ids))
        simulation.grasp(name, [e for e, c in zip(ids, closed) if c], [e for e, c in zip(ids, closed) if not c])

    def step(self, count: int = 1) -> None:
        """Takes `count` steps of all environments. Other threads of Python run meanwhile.

        Ctrl-C ends it within a step. After that all environments have to be reset or loaded before the next step.
        """
        simulation = self._ready("step")
        simulation.step(arguments.whole_number("step: count", count, 0))

    # -- state ----------------------------------------------------------------------------------------------------------

    def positions(self, body: str | None = None) -> np.ndarray | DeviceArray:
        """Live (n_envs, vertices, 3) [m], in the order of the mesh. A scene of one body needs no name."""
        simulation = self._ready("positions")
        body = self._body("positions: body", body)
        return self._view(lambda: simulation.positions(body))

    def velocities(self, body: str | None = None) -> np.ndarray | DeviceArray:
        """Live (n_envs, vertices, 3) [m/s]."""
        simulation = self._ready("velocities")
        body = self._body("velocities: body", body)
        return self._view(lambda: simulation.velocities(body))

    def force(self, ee: str) -> np.ndarray | DeviceArray:
        """Live (n_envs, 3) [N]: of an end effector on the bodies, by its hold and its surface, or of an obstacle or a hold
        of the scene, by one of the names of `forces`.

        A wrist feels the negative.
        """
        simulation = self._ready("force")
        arguments.one_of("force: ee", ee, simulation.forces())
        return self._view(lambda: simulation.force(ee, True), lambda: np.array(simulation.force(ee, False)))

    def pose(self, ee: str) -> np.ndarray:
        """Live (n_envs, 7): where an end effector has been told to be. Of numpy on any device."""
        simulation = self._ready("pose")
        return simulation.pose(self._effector("pose: ee", ee))

    def held(self, ee: str) -> np.ndarray:
        """(n_envs,) int: how many vertices an end effector carries."""
        simulation = self._ready("held")
        return np.array(simulation.held(self._effector("held: ee", ee)), int)

    def held_places(self, name: str, env_id: int = 0) -> np.ndarray:
        """(k, 3) [m]: where the vertices are that an end effector or a hold of the scene carries. A copy."""
        simulation = self._ready("held_places")
        arguments.one_of("held_places: name", name, simulation.forces())
        return simulation.held_places(name, arguments.whole_number("held_places: env_id", env_id, 0, self._initialized_envs - 1))

    def status(self) -> np.ndarray | DeviceStatus:
        """Live (n_envs,) of named numbers: steps, time [s], converged, residual, penetration [m], parts, lost.

        converged: 0 where a step is not solved to the tolerance of the scene. lost: not 0 where an environment goes no
        further, and why_lost() says why.
        """
        simulation = self._ready("status")
        if self.device == "cpu":
            return simulation.status().view(STATUS)[:, 0]

        def copy(column):
            return np.array(simulation.status().view(STATUS)[:, 0] if column is None else simulation.status(column=column))
        return DeviceStatus(lambda column: simulation.status(True, column), copy, STATUS.names)

    def why_lost(self) -> list[str]:
        """A line for each environment; empty where it is not lost."""
        return self._ready("why_lost").why_lost()

    def reset(self, env_ids: ArrayLike | None = None, positions: ArrayLike | dict[str, ArrayLike] | None = None,
              velocities: ArrayLike | dict[str, ArrayLike] | None = None) -> None:
        """Back to the start of the scene: state and end effectors, but not materials, friction and gravity.

        positions, velocities: (n, vertices, 3) of the environments chosen, or a dict of them by body. A body that is given
        positions alone starts without velocity. Nothing is held.
        """
        simulation = self._ready("reset")
        ids = self._ids("reset", env_ids)
        simulation.reset(ids, self._by_body("reset: positions", positions, ids),
                         self._by_body("reset: velocities", velocities, ids))

    def set_velocities(self, body: str | None, velocities: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """(n, vertices, 3) or (vertices, 3) [m/s]."""
        simulation = self._ready("set_velocities")
        body = self._body("set_velocities: body", body)
        ids = self._ids("set_velocities", env_ids)
        simulation.set_velocities(body, ids, self._rows("set_velocities: velocities", body, velocities, ids))

    def save_state(self, env_ids: ArrayLike | None = None) -> _core.State:
        """The environments as they stand, solvers included: what is loaded goes on bitwise as this does."""
        simulation = self._ready("save_state")
        return simulation.save(self._ids("save_state", env_ids))

    def load_state(self, state: _core.State, env_ids: ArrayLike | None = None) -> None:
        """The i-th environment that was saved goes to the i-th of `env_ids`."""
        simulation = self._ready("load_state")
        if not isinstance(state, _core.State):
            raise TypeError(f"load_state: state: found {type(state).__name__}, expected what save_state gave")
        simulation.load(self._ids("load_state", env_ids), state)

    # -- what differs between environments --------------------------------------------------------------------------------

    def material(self, body: str | None = None) -> dict[str, np.ndarray]:
        """The numbers of a body's material by name, (n_envs,) each.

        Of a sheet: membrane_stiffness = E t [N/m], poissons_ratio, areal_density [kg/m^2], bending_rigidity D [N m],
        friction, air_drag [1/s], stiffness_damping [s], yield_curvature [1/m]. Of a solid: youngs_modulus [Pa],
        poissons_ratio, density [kg/m^3], friction, air_drag, stiffness_damping.
        """
        simulation = self._ready("material")
        return {name: np.array(values) for name, values in simulation.material(self._body("material: body", body))}

    def set_material(self, body: str | None = None, env_ids: ArrayLike | None = None, **values: ArrayLike) -> None:
        """Sets numbers of material(body): one number, or (n,). Energy that a material stores jumps with it.

        `friction` holds against what states no coefficient of its own, and is refused where everything does: set_friction
        sets those.
        """
        simulation = self._ready("set_material")
        body = self._body("set_material: body", body)
        ids = self._ids("set_material", env_ids)
        known = [name for name, _ in simulation.material(body)]
        if "friction" in values and not self._friction_counts(body):
            raise ValueError("set_material: friction: found obstacles that all state their own, so that it would change nothing, "
                             "expected set_friction")
        simulation.set_material(body, ids, [
            (arguments.one_of("set_material", name, known), arguments.per_environment(f"set_material: {name}", value, len(ids)))
            for name, value in values.items()])

    def set_friction(self, body: str | None, obstacle: str, friction: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """The Coulomb coefficient of a body on an obstacle or an end effector: one number, or (n,)."""
        simulation = self._ready("set_friction")
        body = self._body("set_friction: body", body)
        arguments.one_of("set_friction: obstacle", obstacle, simulation.obstacles())
        ids = self._ids("set_friction", env_ids)
        simulation.set_friction(body, obstacle, ids,
                                arguments.per_environment("set_friction: friction", friction, len(ids)))

    def set_gravity(self, gravity: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """(3,) or (n, 3) [m/s^2]."""
        simulation = self._ready("set_gravity")
        ids = self._ids("set_gravity", env_ids)
        given = arguments.numbers("set_gravity: gravity", gravity, (3,), (len(ids), 3))
        simulation.set_gravity(ids, np.array(np.broadcast_to(given, (len(ids), 3))))

    def seed(self, seed: int) -> None:
        """Of what randomize draws. A simulation itself has no chance in it."""
        self._random = np.random.default_rng(arguments.whole_number("seed", seed, 0, 2**63 - 1))

    def randomize(self, how: str, seed: int | None = None,
                  env_ids: ArrayLike | None = None) -> dict[str, dict[str, np.ndarray]]:
        """Materials of all bodies, drawn for each environment. Returns what was set, by body and name.

        "identified": draws of the posterior of each tuned asset, see Asset.draws. "published": what the asset has times
        factors of 0.5 to 1.5, even and independent, for stiffness, bending, density and friction. "none": what the asset has.
        Friction is left out where every obstacle states its own.
        """
        simulation = self._ready("randomize")
        arguments.one_of("randomize: how", how, ("identified", "published", "none"))
        ids = self._ids("randomize", env_ids)
        random = self._random if seed is None else np.random.default_rng(
            arguments.whole_number("randomize: seed", seed, 0, 2**63 - 1))
        drawn = {}
        for body in self.bodies:
            start = {name: np.full(len(ids), values[0]) for name, values in self._start_materials[body].items()}
            if not self._friction_counts(body):
                del start["friction"]
            drawn[body] = start | _drawn(how, self.asset(body), start, len(ids), random)
        for body, values in drawn.items():
            simulation.set_material(body, ids, list(values.items()))
        return drawn

    # -- cameras ----------------------------------------------------------------------------------------------------------

    def add_camera(self, name: str, width: int, height: int, fx: float, fy: float, cx: float, cy: float, pose: ArrayLike,
                   carrier: str | None = None, sees: list[str] | None = None) -> None:
        """Adds a depth camera to every environment, at any time after initialize().

        width, height: of its pictures [px]. fx, fy: focal lengths, and cx, cy: where the optical axis meets the picture [px];
        pixel (0, 0) is the centre of the upper left pixel. The lens has no distortion.
        pose: of the optical frame (x right, y down, z forward) in the base frame, (7,) or (n_envs, 7), or as matrices (4, 4) or
        (n_envs, 4, 4). look_at makes such poses. With a `carrier`, the name of an end effector or of an obstacle that moves,
        the pose is in its frame, and the camera moves with it.
        sees: names of instances; what else there is is not drawn. None: all bodies, and what they collide with.
        """
        simulation = self._ready("add_camera")
        size = [arguments.whole_number(f"add_camera: {what}", value, 1, 16384) for what, value in
                (("width", width), ("height", height))]
        lens = [float(self._above("add_camera: fx", fx, (), 0, equal=False)),
                float(self._above("add_camera: fy", fy, (), 0, equal=False)),
                float(arguments.numbers("add_camera: cx", cx, ())), float(arguments.numbers("add_camera: cy", cy, ()))]
        if not arguments.text("add_camera: name", name) or name in simulation.cameras():
            raise ValueError(f"add_camera: name: found {name!r}, expected a name that no other camera has")
        if carrier is not None and not arguments.text("add_camera: carrier", carrier):
            raise ValueError("add_camera: carrier: found '', expected a name, or None")
        if sees is not None:
            if not isinstance(sees, (list, tuple)) or not sees:
                found = "no name" if isinstance(sees, (list, tuple)) else type(sees).__name__
                raise TypeError(f"add_camera: sees: found {found}, expected a list of names, or None")
            for seen in sees:
                arguments.one_of("add_camera: sees", seen, simulation.instances())
        poses = cameras.poses("add_camera: pose", pose, self._initialized_envs)
        try:
            simulation.add_camera(name, size, lens, poses, carrier or "", list(sees or []))
        except ValueError as error:  # of obstacles only the scene knows which move
            raise ValueError(f"add_camera: {error}") from None

    def set_camera(self, name: str, pose: ArrayLike, env_ids: ArrayLike | None = None) -> None:
        """Where a camera stands from now on: (7,), (n, 7), (4, 4) or (n, 4, 4), as add_camera has it."""
        simulation = self._ready("set_camera")
        arguments.one_of("set_camera: name", name, simulation.cameras())
        ids = self._ids("set_camera", env_ids)
        simulation.set_camera(name, ids, cameras.poses("set_camera: pose", pose, len(ids)))

    def render(self, name: str, pictures: tuple[str, ...] | None = None, env_ids: ArrayLike | None = None,
               out: dict[str, np.ndarray] | None = None) -> dict[str, np.ndarray]:
        """What a camera sees now: a dict of arrays (n, height, width), by the names of `pictures`.

        "depth" is float32, along the optical axis [m], 0 where there is nothing. "distance" is float32, along the ray [m].
        "instance" is uint8, the number of what is seen in sim.instances; 255 is nothing. "triangle" is int32, its row in
        triangles(body), -1 is nothing. "points" is float32 (n, height, width, 3), in the base frame [m], 0 0 0 is nothing.
        None: depth and instance.

        Each call draws the state as it stands then, also after a reset, where it is stepped. The arrays are new ones of numpy,
        which nobody changes, or those of `out`: a dict whose arrays are written to and returned. Then its names are the pictures.
        Of a simulation on a CUDA device they may be there as well, as torch.empty(n, height, width, device="cuda"): nothing goes
        through the memory of the processor. They are complete when it returns.
        Other threads of Python run meanwhile.
        """
        simulation = self._ready("render")
        arguments.one_of("render: name", name, simulation.cameras())
        ids = self._ids("render", env_ids)
        width, height = simulation.camera_size(name)
        drawn = cameras.pictures("render", pictures, (len(ids), height, width), out, self.device)
        simulation.render(name, ids, *(drawn.get(picture) for picture in cameras.PICTURES))
        return drawn

    # -- what it is made of -----------------------------------------------------------------------------------------------

    @property
    def device(self) -> str:
        """Where it is stepped: "cpu", or "cuda:0" with the number of the device."""
        return self._ready("device").device()

    @property
    def n_envs(self) -> int:
        self._ready("n_envs")
        return self._initialized_envs

    @property
    def time_step(self) -> float:
        """[s]"""
        return self._ready("time_step").time_step()

    @property
    def bodies(self) -> list[str]:
        """Names of the objects of the scene."""
        self._ready("bodies")
        return list(self._triangles)

    @property
    def end_effectors(self) -> list[str]:
        """Names of those that were added."""
        return self._ready("end_effectors").end_effectors()

    @property
    def obstacles(self) -> list[str]:
        """Names of what bodies collide with."""
        return self._ready("obstacles").obstacles()

    @property
    def forces(self) -> list[str]:
        """Names that force() knows: obstacles, holds of the scene, end effectors that were added."""
        return self._ready("forces").forces()

    @property
    def cameras(self) -> list[str]:
        """Names of those that were added."""
        return self._ready("cameras").cameras()

    @property
    def instances(self) -> list[str]:
        """What pictures tell apart: a pixel of instance k sees instances[k]. Bodies, obstacles, then added end effectors."""
        return self._ready("instances").instances()

    @property
    def notices(self) -> list[str]:
        """What was understood of the scene and its assets, a line each."""
        return self._ready("notices").notices()

    def triangles(self, body: str | None = None) -> np.ndarray:
        """(triangles, 3) int: the visible triangles by the body's vertices."""
        self._ready("triangles")
        return self._triangles[self._body("triangles: body", body)]

    def surface(self, instance: str, env_id: int = 0) -> tuple[np.ndarray, np.ndarray]:
        """What pictures of an instance are drawn from, as it stands now: vertices (V, 3) in the base frame [m], and triangles
        (T, 3) int by them. Copies. A plane is a square that reaches beyond 100 m; round obstacles have 48 flat sides."""
        simulation = self._ready("surface")
        arguments.one_of("surface: instance", instance, simulation.instances())
        return simulation.surface(instance, arguments.whole_number("surface: env_id", env_id, 0, self._initialized_envs - 1))

    def asset(self, body: str | None = None) -> Asset:
        """The Asset that a body was made of."""
        self._ready("asset")
        return Asset(self._assets[self._body("asset: body", body)])

    # -- arguments --------------------------------------------------------------------------------------------------------

    def _ready(self, call):
        if self._simulation is None:
            raise RuntimeError(f"{call}: found a simulation that is not initialized, expected initialize() before")
        return self._simulation

    def _ids(self, call, env_ids):
        return arguments.environments(f"{call}: env_ids", env_ids, self._initialized_envs)

    def _body(self, what, body):
        if body is None and len(self._triangles) == 1:
            return next(iter(self._triangles))
        return arguments.one_of(what, body, list(self._triangles))

    def _view(self, take, copy=None):
        """What take() gives: an array of numpy, or on a device one that is live."""
        array = take()
        if isinstance(array, np.ndarray):
            return array
        return DeviceArray(take, copy or (lambda: _core.to_host(take())))

    def _effector(self, what, name):
        return arguments.one_of(what, name, self._simulation.end_effectors())

    def _friction_counts(self, body):
        return not self._simulation.obstacles() or self._simulation.uses_material_friction(body)

    def _new_name(self, what, name):
        if not arguments.text(what, name) or name in self._simulation.end_effectors():
            raise ValueError(f"{what}: found {name!r}, expected a name that no other end effector has")
        return name

    def _above(self, what, value, shape, low, equal):
        array = arguments.numbers(what, value, shape)
        if not (array >= low if equal else array > low).all():
            raise ValueError(f"{what}: found {array.min():.6g}, expected {'' if equal else 'above '}{low}"
                             f"{' or more' if equal else ''}")
        return array

    def _rows(self, what, body, value, ids):
        vertices = self._simulation.vertices(body)
        given = arguments.numbers(what, value, (len(ids), vertices, 3), (vertices, 3))
        return np.ascontiguousarray(np.broadcast_to(given, (len(ids), vertices, 3)))

    def _by_body(self, what, given, ids):
        """An array or None for each body."""
        if given is None:
            return []
        if not isinstance(given, dict):
            given = {self._body(f"{what} without a name of a body", None): given}
        for body in given:
            self._body(what, body)
        return [self._rows(f"{what}: {body}", body, given[body], ids) if body in given else None
                for body in self._triangles]


def _drawn(how, asset, start, count, random):
    if how == "none":
        return {}
    if how == "published":
        names = [name for name in ("membrane_stiffness", "youngs_modulus", "bending_rigidity", "areal_density", "density",
                                   "friction") if name in start]
        return {name: start[name] * random.uniform(*PUBLISHED_RANGE, count) for name in names}
    draws = asset.draws(count, int(random.integers(2**63)))
    return {name: values for name, values in asset.as_material(draws).items() if name in start}
