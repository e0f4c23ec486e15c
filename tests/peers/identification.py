"""The same identification with mujoco.sysid: the same records, bounds and parameters."""

import io
import time

import mujoco
import numpy as np
from mujoco import sysid

from robot import DOFS, DURATION, JOINTS, RATE, SAMPLES, TRUE, bounds, parameter_deviation, xml

# Where an identification starts that is given the basin: every parameter off by about so much.
OFF = 0.1
# Samples left out at the end of a record, where its spectrum wraps around.
MARGIN = 64

SENSOR = '<framelinvel name="velocity" objtype="site" objname="tcp"/>'
# Along the TCP's axes.
ACTUATOR = "".join(
    f'<motor name="force_{axis}" site="tcp" gear="{gear} 0 0 0"/>'
    for axis, gear in zip("xyz", ["1 0 0", "0 1 0", "0 0 1"])
)


class OutOfTime(Exception):
    """The identification has had its time."""


class Identification:
    """How one went."""

    def __init__(self, engine, experiments, start, limit_s):
        self.engine, self.experiments = engine, experiments
        self.iterations = self.evaluations = 0
        self.begun, self.limit_s = time.process_time(), limit_s
        parameters = sysid.ParameterDict()
        lower, upper = np.log(bounds())
        for joint, values in enumerate(np.log(start)):
            name = JOINTS[joint]
            parameters.add(
                sysid.Parameter(name, values, lower[joint], upper[joint], modifier=bush(name))
            )
        residual = sysid.build_residual_fn(
            models_sequences=[self.sequence(one) for one in experiments],
            modify_residual=self.modify_residual,
            n_threads=1,
            resample_true=False,
        )
        self.found, self.settled = start, False
        try:
            found, _ = sysid.optimize(
                parameters,
                self.counted(residual),
                optimizer="mujoco",
                verbose=False,
                output=io.StringIO(),  # else it prints every iteration
                max_iters=100,
                x_scale="jac",
                xtol=1e-4,
                iter_callback=self.iterated,
            )
            self.found, self.settled = np.exp(found.as_vector()).reshape(TRUE.shape), True
        except OutOfTime:
            pass
        self.seconds = time.process_time() - self.begun
        self.deviation = parameter_deviation(self.found)

    def sequence(self, experiment):
        """What mujoco.sysid fits: the force at the middle of each step, and what the accelerometer says."""
        step = self.engine.step
        name = f"experiment {experiment.index}"
        spec = mujoco.MjSpec.from_string(
            xml(experiment.pose, TRUE, self.engine.integrator, step, SENSOR, ACTUATOR)
        )
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        axes = data.site("tcp").xmat.reshape(3, 3)
        times = step * np.arange(round(DURATION / step))
        force = every_step(experiment.record[:, :3], step, averaged=False)
        acceleration = every_step(experiment.record[:, 3:], step, averaged=True) @ axes.T
        mapping = sysid.TimeSeries.compute_all_sensor_mapping(model)
        return sysid.ModelSequences(
            name,
            spec,
            name,
            sysid.create_initial_state(model, data.qpos, data.qvel, data.act),
            sysid.TimeSeries(times, force),
            sysid.TimeSeries(times, acceleration, mapping),
        )

    def modify_residual(self, _parameters, predicted, measured, _model, _all, **_):
        """Mean acceleration over each step: the change of the velocity, which MuJoCo tells from before each."""
        count = len(predicted.data) - 1 - MARGIN
        modelled = np.diff(predicted.data, axis=0)[:count] / self.engine.step
        measured = sysid.TimeSeries(
            measured.times[:count], measured.data[:count], measured.signal_mapping
        )
        modelled = sysid.TimeSeries(measured.times, modelled, measured.signal_mapping)
        return (modelled.data - measured.data) / np.std(measured.data), modelled, measured

    def counted(self, residual):
        """Counts the evaluations, one a column. A guess that is not stable has no residual."""
        rows = 0

        def counted(x, parameters, **rest):
            nonlocal rows
            self.evaluations += x[0].size
            try:
                found = residual(x, parameters, **rest)
                rows = sum(len(one) for one in found[0])
            except ValueError as error:  # mujoco.sysid finds that the time stands still
                if not rows or "times" not in str(error):
                    raise
                found = [np.full((rows, x[0].size), np.inf)], [], []
            return found

        return counted

    def iterated(self, trace):
        """Keeps where it stands, and stops it when its time is up."""
        self.iterations += 1
        self.found = np.exp(trace[-1].candidate).reshape(TRUE.shape)
        if time.process_time() - self.begun > self.limit_s:
            raise OutOfTime


def bush(joint):
    """Sets stiffness and damping of a joint's bushing from their logarithms."""

    def modifier(spec, parameter):
        values = np.exp(parameter.value)
        for dof, name in enumerate(DOFS):
            one = spec.joint(f"{joint}_{name}")
            one.stiffness[0], one.damping[0] = values[dof], values[6 + dof]

    return modifier


def every_step(samples, step, averaged):
    """The signal behind the samples, at the middle of each step or averaged over it; nothing of it is lost."""
    frequencies = np.fft.rfftfreq(SAMPLES, 1 / RATE)[:, None]
    spectrum = np.fft.rfft(samples, axis=0) * np.exp(1j * np.pi * frequencies * step)
    if averaged:
        spectrum *= np.sinc(frequencies * step)
    return np.fft.irfft(spectrum, SAMPLES, axis=0)[:: round(step * RATE)]


def starts(rng):
    """Where identifications start: in the middle of the bounds, and close to the truth."""
    yield "the middle of the bounds", np.sqrt(np.prod(bounds(), axis=0))
    lower, upper = bounds()
    yield "10 % off the truth", np.clip(TRUE * np.exp(OFF * rng.normal(size=TRUE.shape)), lower, upper)
