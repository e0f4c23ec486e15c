"""The force of a milling cutter, band-limited, at every step of an integration."""

import numpy as np
from scipy.signal import fftconvolve, firwin, kaiserord

# The low-pass, Hz: it passes what is below the first and stops what is above the second.
EDGES_HZ = (500.0, 800.0)
ATTENUATION_DB = 100.0


def force(cutting, feed, spindle_rpm, cut_s, step_s, steps, rng):
    """Force on the robot along the TCP's axes, N, a row a step. `cutting` is `[force]` of the scenario.

    The spindle speed grows evenly over the cut. The roughness is white up to 1 kHz.
    """
    time = step_s * np.arange(steps)
    begin, end = cut_s
    within = np.clip(time - begin, 0.0, end - begin)
    first, last = (2 * np.pi / 60 * rpm for rpm in spindle_rpm)
    angle = first * within + (last - first) * within**2 / (2 * (end - begin))
    along = np.zeros((steps, 3))
    for tooth in range(cutting["teeth"]):
        turned = (angle + 2 * np.pi * tooth / cutting["teeth"]) % (2 * np.pi)
        tangential = cutting["peak_tangential_n"] * np.sin(turned)
        tangential[turned > np.radians(cutting["immersion_deg"])] = 0.0
        radial, axial = cutting["radial_ratio"] * tangential, cutting["axial_ratio"] * tangential
        along[:, 0] -= tangential * np.cos(turned) + radial * np.sin(turned)
        along[:, 1] += tangential * np.sin(turned) - radial * np.cos(turned)
        along[:, 2] += axial
    roughness = cutting["roughness"] * np.sqrt(0.5 / step_s / 1000.0)
    along *= (1 + roughness * rng.normal(size=steps))[:, None]
    along[(time < begin) | (time >= end)] = 0.0
    # Along the feed, across it, and along the tool.
    axes = np.roll(along, "xyz".index(feed), axis=1)
    nyquist = 0.5 / step_s
    taps, beta = kaiserord(ATTENUATION_DB, (EDGES_HZ[1] - EDGES_HZ[0]) / nyquist)
    low_pass = firwin(taps | 1, sum(EDGES_HZ) / 2, window=("kaiser", beta), fs=1 / step_s)
    return fftconvolve(axes, low_pass[:, None], mode="same", axes=0)


def knots(force, step_s):
    """Values that, with straight lines between them, have the spectrum of `force` below EDGES_HZ."""
    frequencies = np.fft.rfftfreq(len(force), step_s)[:, None]
    spectrum = np.fft.rfft(force, axis=0) / np.sinc(frequencies * step_s) ** 2
    return np.fft.irfft(spectrum, len(force), axis=0)
