"""A scene that is simulated while people look: what moves, what it meets, and with which forces."""
import time

import numpy as np

from flash_sim.device_array import to_host
from flash_sim.realtime_sim import RealtimeSim
from flash_sim.view import page
from flash_sim.view.drawn import BODIES, HELD, RIGID, Arrow, Points, Surface, table

ENDLESS = 50.0  # [m]: what is larger is a plane or a cylinder without ends
DRAWN_HALF = 1.0  # diagonal of a plane's square, over the size of what lies about it
SUNK = 2e-3  # by which a plane is drawn lower, likewise, so that what lies on it shows
WEIGHT_ARROW = 0.25  # length of the arrow of the weight of all bodies, over their size
EARTH = 9.81  # [m/s^2]


def start(path, envs=1, randomize="none", seed=0, device="auto"):
    """A RealtimeSim of a scene file, as its first step finds it. ValueError in one line where the file is none."""
    sim = RealtimeSim(device)
    sim.load_config(path)
    sim.set_envs(envs)
    sim.initialize()
    if randomize != "none":
        sim.randomize(randomize, seed=seed)
    return sim


def drawn_surface(sim, instance, env, box):
    """(vertices, triangles) of an instance; a plane as a square about what lies in `box`."""
    vertices, triangles = sim.surface(instance, env)
    if len(vertices) == 4 and _is_endless(vertices):
        normal = np.cross(vertices[1] - vertices[0], vertices[2] - vertices[0])
        normal /= np.linalg.norm(normal)
        corners = vertices - vertices[0]
        middle = box.middle - normal * (normal @ (box.middle - vertices[0]))
        ways = corners - corners.mean(axis=0)
        vertices = middle + DRAWN_HALF * box.size * ways / np.linalg.norm(ways, axis=1)[:, None] - SUNK * box.size * normal
    return vertices, triangles


def box_of(sim):
    """The Box about all that has ends."""
    surfaces = [sim.surface(instance)[0] for instance in sim.instances]
    return page.box_about([vertices for vertices in surfaces if not _is_endless(vertices)])


def _is_endless(vertices):
    return np.ptp(vertices, axis=0).max() > ENDLESS


def weight_of(sim, env=0):
    """Of all bodies by their surfaces, under the earth's gravity [N]; 1 where their assets weigh vertices."""
    weight = 0.0
    for body in sim.bodies:
        vertices, triangles = sim.surface(body, env)
        a, b, c = (vertices[triangles[:, k]] for k in range(3))
        material = {name: values[env] for name, values in sim.material(body).items()}
        if "areal_density" in material:
            weight += EARTH * material["areal_density"] * 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
        else:
            weight += EARTH * material["density"] * abs(np.einsum("ij,ij->i", a, np.cross(b, c)).sum()) / 6
    return weight or 1.0


def forces_of(sim, env):
    """{name: (3,) [N]} of what acts on the bodies by its hold or its surface."""
    return {name: to_host(sim.force(name))[env] for name in sim.forces}


def words_of(sim, env, forces, weight, arrow):
    """Markdown: the state of an environment, and the forces on its bodies. arrow: how long that of `weight` is [m]."""
    status = to_host(sim.status())[env] if sim.device == "cpu" else sim.status().numpy()[env]
    lost = sim.why_lost()[env]
    solved = f"lost: {lost}" if lost else "solved" if status["converged"] else f"not solved, residual {status['residual']:.1e}"
    rows = [(name, *(f"{value:.3f}" for value in force)) for name, force in forces.items()]
    return (f"**Time:** {status['time']:.3f} s, step {status['steps']:.0f}\n\n**Step:** {solved}, deepest "
            f"{1e3 * status['penetration']:.2f} mm below a surface\n\n**Forces on the bodies [N]**\n\n"
            + table(("of", "x", "y", "z"), rows) + f"\n\nAn arrow of {1e3 * arrow:.0f} mm is {weight:.3g} N. Green: what is held.")


def show(server, sim):
    """Puts a scene on the page; what is to be called again and again, which takes the steps."""
    box = box_of(sim)
    fixed = [instance for instance in sim.instances if instance not in sim.bodies]
    page.furnish(server, box, ground=False)
    weight, arrow = weight_of(sim), WEIGHT_ARROW * box.size
    which = server.gui.add_slider("environment", 0, max(sim.n_envs - 1, 1), 1, 0, visible=sim.n_envs > 1)
    controls = _Controls(server)
    with_arrows = server.gui.add_checkbox("forces", True)
    words = server.gui.add_markdown("")
    surfaces = {body: Surface(server, f"/body/{body}", BODIES[k % len(BODIES)]) for k, body in enumerate(sim.bodies)}
    surfaces |= {name: Surface(server, f"/rigid/{name}", RIGID, opacity=0.6) for name in fixed}
    arrows = {name: Arrow(server, f"/force/{name}", box.size) for name in sim.forces}
    held = {name: Points(server, f"/held/{name}", 0.007 * box.size, HELD) for name in sim.forces}
    shown = None

    def draw(env, with_forces):
        forces, middles = forces_of(sim, env), {}
        for name, surface in surfaces.items():
            vertices, triangles = drawn_surface(sim, name, env, box)
            surface.show(vertices, triangles)
            middles[name] = vertices.mean(axis=0)
        for name, force in forces.items():
            places = sim.held_places(name, env)
            held[name].show(places)
            start = places.mean(axis=0) if len(places) else middles.get(name, box.middle)
            arrows[name].show(start, arrow / weight * force, with_forces)
        words.content = words_of(sim, env, forces, weight, arrow)

    def tick():
        nonlocal shown
        if controls.wants_reset():
            sim.reset()
        if controls.wants_step(sim.time_step):
            sim.step()
        env = min(int(which.value), sim.n_envs - 1)
        wanted = (env, with_arrows.value, controls.changes)
        if wanted != shown:
            draw(env, with_arrows.value)
            shown = wanted
    return tick


class _Controls:
    """Buttons to play, to step and to reset. `changes` counts what came of them."""

    def __init__(self, server):
        self._play, self._step, self._reset = (server.gui.add_button(label) for label in ("Play", "Step", "Reset"))
        self._playing = self._one = self._back = False
        self._due, self.changes = 0.0, 0

        @self._play.on_click
        def _(_):
            self._playing = not self._playing
            self._play.label = "Pause" if self._playing else "Play"

        @self._step.on_click
        def _(_):
            self._one = True

        @self._reset.on_click
        def _(_):
            self._back = True

    def wants_reset(self):
        """Whether all environments are to go back to the start now."""
        wanted, self._back = self._back, False
        self.changes += wanted
        return wanted

    def wants_step(self, time_step):
        """Whether a step is to be taken now; while it plays, not faster than time goes by."""
        now = time.monotonic()
        wanted = self._one or (self._playing and now >= self._due)
        self._one = False
        if wanted:
            self._due = max(self._due + time_step, now - time_step)
        self.changes += wanted
        return wanted
