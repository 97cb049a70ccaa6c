"""Library functions behind the hooks of the peers' benchmark: {hook name: function with the hook's arguments}."""

import hooks_particles
import numpy as np

from labkit.fast import ax_xb, hand_eye, pivot
from labkit.fast.ekf import ekf_localize
from labkit.fast.kalman import filter_steps
from labkit.geometry import chaining, frames

POSE_NOISE = (np.deg2rad(0.1), 0.2)  # rad and mm, as the benchmark draws them


def handeye(T_BF, T_ST):
    return ax_xb.calibrate_hand_eye(T_BF, T_ST).T_FS


def sphere_handeye(T_BF, x_S):
    result = hand_eye.calibrate_sphere_target(T_BF, x_S)
    return result.T_FS, result.target


def plain_pivot(T):
    result = pivot.calibrate_pivot(T)
    return result.tip, result.pivot


def robust_pivot(T):
    result = pivot.calibrate_pivot(T, *POSE_NOISE, robust=True)
    return result.tip, result.pivot


def kalman(F, Q, H, R, x0, P0, z):
    return filter_steps(z, F, H, R, x0, P0, cov_v=Q).x


def ekf(u, z, marks, x0, P0, Q, R):
    std_range, std_bearing = np.sqrt(np.diag(R))
    return ekf_localize(u, z, marks, x0, P0, 0.1, std_range, std_bearing, cov_v=Q).x


HOOKS = {
    "handeye": handeye,
    "sphere_handeye": sphere_handeye,
    "pivot": plain_pivot,
    "pivot_robust": robust_pivot,
    "frames": frames.frame_from_points,
    "chain": lambda A, B, C: chaining.chain((A, B, C)),
    "kalman": kalman,
    "ekf": ekf,
    **hooks_particles.HOOKS,
}
