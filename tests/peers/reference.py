"""The three experiments, integrated so finely that nothing of the integration is left, and their records."""

import numpy as np

from robot import RATE, SAMPLES, TRUE, TRUTH, Robot

STANDARD_GRAVITY = 9.80665


class Experiment:
    """What was done at one pose, what the TCP did, and what the sensors read."""

    def __init__(self, index, folder, steps_a_sample, rng):
        self.pose = TRUTH["experiment"][index]["pose"]
        self.folder, self.index, self.steps = folder, index, steps_a_sample
        # The force at every step, and once more at the end.
        force = np.fromfile(folder / f"cut-{index}.f64").reshape(-1, 3)
        self.force = np.vstack([force, force[-1:]])
        assert len(force) == SAMPLES * steps_a_sample

        robot = Robot(self.pose, TRUE, "RK4", 1 / (RATE * steps_a_sample))
        states = robot.states(robot.control((self.force[:-1] + self.force[1:]) / 2))
        # Of rest, and after every step.
        self.states = np.vstack([robot.rest, states])
        self.displacement = robot.displacement(self.states)
        sampled = slice(0, SAMPLES * steps_a_sample, steps_a_sample)
        acceleration = robot.acceleration(self.states[sampled], self.force[sampled])

        quality, half = TRUTH["measurement"], np.sqrt(RATE / 2)
        noise = [
            quality["force_noise_n_per_sqrt_hz"] * half,
            quality["acceleration_noise_g_per_sqrt_hz"] * STANDARD_GRAVITY * half,
        ]
        self.record = np.hstack([self.force[sampled], acceleration])
        self.record += np.repeat(noise, 3) * rng.normal(size=self.record.shape)
        self.record.tofile(folder / f"record-{index}.f64")

    def held(self, step, part):
        """The force of each step of an integration, taken at `part` of the step, one row a step."""
        stride = round(step * RATE * self.steps)
        count = SAMPLES * self.steps // stride
        at = np.arange(count) * stride + part * stride
        before = at.astype(int)
        share = (at - before)[:, None]
        return (1 - share) * self.force[before] + share * self.force[before + 1]

    def displacement_every(self, step):
        """After each step of an integration, one row a step."""
        stride = round(step * RATE * self.steps)
        return self.displacement[stride :: stride]
