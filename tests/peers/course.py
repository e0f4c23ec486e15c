"""Joint angles along straight lines: the feed grows and falls in ramps, the tool stops at each point."""

import numpy as np
from scipy.interpolate import CubicSpline

# Time before the first line and after the last one, s.
REST_S = 1.0
# Time of a ramp of the feed, s.
RAMP_S = 0.2
# Points of a line at which its joint angles are solved.
POINTS = 401


class Course:
    """What the drives do in one experiment. Times in s, angles in rad."""

    def __init__(self, kinematics, pose, points_m, feed_m_per_s, cutting_s):
        """`points_m` are the ends of a line, relative to the TCP at `pose`, base axes; the tool goes forth and back.

        `kinematics` has `place(angles)` and `angles(place, near)`. At a feed of 0 the robot stands.
        """
        self.pose, self.feed = np.array(pose), feed_m_per_s
        self.begin_s, self.lines = REST_S, []
        if feed_m_per_s == 0.0:
            self.cut_s = (REST_S, REST_S + cutting_s)
            self.duration_s = cutting_s + 2 * REST_S
            return
        start = kinematics.place(pose)
        length = np.linalg.norm(points_m)
        self.line_s = length / feed_m_per_s + RAMP_S
        count = max(1, round(cutting_s / self.line_s))
        shares, angles = np.linspace(0.0, 1.0, POINTS), [self.pose]
        for share in shares[1:]:
            angles.append(kinematics.angles(start.moved(share * np.array(points_m)), angles[-1]))
        self.length, self.spline = length, CubicSpline(length * shares, np.array(angles))
        self.lines = list(range(count))
        moves_s = count * self.line_s
        self.cut_s = (REST_S + RAMP_S, REST_S + moves_s - RAMP_S)
        self.duration_s = moves_s + 2 * REST_S

    def at(self, times):
        """Angles, rates and accelerations of the drives: three arrays, a row a time, a column a joint."""
        angles = np.tile(self.pose, (len(times), 1))
        rates, accelerations = np.zeros_like(angles), np.zeros_like(angles)
        for line in self.lines:
            since = times - self.begin_s - line * self.line_s
            now = since > 0.0
            s, v, a = self.law(np.clip(since[now], 0.0, self.line_s))
            if line % 2:
                s, v, a = self.length - s, -v, -a
            slope = self.spline(s, 1)
            angles[now] = self.spline(s)
            rates[now] = slope * v[:, None]
            accelerations[now] = self.spline(s, 2) * v[:, None] ** 2 + slope * a[:, None]
        return angles, rates, accelerations

    def law(self, time):
        """Distance, speed and acceleration along a line: m, m/s and m/s². A ramp's acceleration is a sine squared."""

        def ramp(time):
            part = np.clip(time / RAMP_S, 0.0, 1.0)
            beyond = np.maximum(time - RAMP_S, 0.0)
            turns = 2 * np.pi * part
            s = RAMP_S * (part**2 / 2 - (1 - np.cos(turns)) / (4 * np.pi**2)) + beyond
            return s, part - np.sin(turns) / (2 * np.pi), 2 / RAMP_S * np.sin(turns / 2) ** 2

        up, down = ramp(time), ramp(self.line_s - time)
        early = time < self.line_s / 2
        return (
            np.where(early, self.feed * up[0], self.length - self.feed * down[0]),
            self.feed * np.where(early, up[1], down[1]),
            self.feed * np.where(early, up[2], -down[2]),
        )
