"""One evaluation of the loss: flexid's, and MuJoCo's `mj_step` over the same three experiments."""

import time

import mujoco
import numpy as np

from robot import BAND, DURATION, RATE, TRUE, Robot

# αT: how far the end of a record is damped where spectra are compared.
DECAY = 7.0
# Samples before the cut, from which the sensors' zero is read.
REST = 64


class Engine:
    """An integrator of MuJoCo, with a step, and the part of the step where its force is best taken."""

    def __init__(self, name, integrator, step, part):
        self.name, self.integrator, self.step, self.part = name, integrator, step, part

    def robots(self, experiments, parameters):
        """A robot for each experiment, and what moves it."""
        for one in experiments:
            robot = Robot(one.pose, parameters, self.integrator, self.step)
            yield robot, robot.control(one.held(self.step, self.part))


ENGINES = [
    Engine("implicitfast, 1 ms", "implicitfast", 1e-3, 0.0),
    Engine("RK4, 0.5 ms", "RK4", 5e-4, 0.5),
]


class Evaluation:
    """Shortest times of one engine over the experiments, s, and how wrong it is."""

    def __init__(self, engine, experiments, guess):
        self.engine, self.experiments = engine, experiments
        self.prepared = list(engine.robots(experiments, TRUE))
        self.in_loop = self.from_python = np.inf
        self.error = np.median([error(engine, one, engine.part) for one in experiments])
        self.alone = np.median([integration_error(engine, one) for one in experiments])
        pairs = zip(engine.robots(experiments, guess), experiments)
        self.loss = np.mean([loss(*prepared, one) for prepared, one in pairs])

    def time(self):
        """Once more; processor time, so that a busy machine does not count against the longer runs."""
        start = time.process_time()
        for robot, control in self.prepared:
            robot.states(control)
        self.in_loop = min(self.in_loop, time.process_time() - start)

        start = time.process_time()
        for robot, control in self.prepared:
            data = mujoco.MjData(robot.model)
            for force in control[0, :, -6:]:
                data.xfrc_applied[-1] = force
                mujoco.mj_step(robot.model, data)
        self.from_python = min(self.from_python, time.process_time() - start)


def band_error(found, true, step):
    """RMS(x − x̂) / RMS(x) in the band, per direction."""
    frequencies = np.fft.rfftfreq(len(true), step)
    inside = (frequencies >= BAND[0]) & (frequencies <= BAND[1])
    size = lambda series: np.linalg.norm(np.fft.rfft(series, axis=0)[inside], axis=0)
    return size(found - true) / size(true)


def error(engine, experiment, part):
    """Of the displacement, against the fine integration of the true force."""
    robot = Robot(experiment.pose, TRUE, engine.integrator, engine.step)
    found = robot.displacement(robot.states(robot.control(experiment.held(engine.step, part))))
    return band_error(found, experiment.displacement_every(engine.step), engine.step)


def integration_error(engine, experiment):
    """Of the displacement, against a fine integration under the force as the engine holds it."""
    held = experiment.held(engine.step, 0.5)
    coarse = Robot(experiment.pose, TRUE, engine.integrator, engine.step)
    times = round(engine.step * RATE * experiment.steps)
    fine = Robot(experiment.pose, TRUE, "RK4", engine.step / times)
    found = coarse.displacement(coarse.states(coarse.control(held)))
    true = fine.displacement(fine.states(fine.control(np.repeat(held, times, axis=0))))
    return band_error(found, true[times - 1 :: times], engine.step)


def loss(robot, control, experiment):
    """SSP of measured and modelled acceleration on the complex-frequency line, mean over directions and bins."""
    alpha, step = DECAY / DURATION, robot.model.opt.timestep
    displacement = robot.displacement(robot.states(control))
    bins = np.arange(np.ceil(BAND[0] * DURATION), np.floor(BAND[1] * DURATION) + 1).astype(int)
    s = (alpha + 2j * np.pi * bins / DURATION)[:, None]

    def spectrum(series, step):
        weights = np.exp(-alpha * step * np.arange(len(series)))
        return step * np.fft.rfft(series * weights[:, None], axis=0)[bins]

    measured = experiment.record[:, 3:]
    measured = spectrum(measured - measured[:REST].mean(axis=0), 1 / RATE)
    # From second differences, whose spectrum is known by the displacement's: the end of the record counts for less.
    differences = np.diff(displacement, n=2, axis=0, prepend=np.zeros((2, 3)))
    modelled = s**2 / (2 * np.cosh(s * step) - 2) * spectrum(differences, step)
    return np.mean(abs(measured - modelled) ** 2 / (abs(measured) ** 2 + abs(modelled) ** 2))
