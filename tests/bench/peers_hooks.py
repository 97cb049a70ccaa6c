"""Library functions behind the hooks of the peers' benchmark: {hook name: function with the hook's arguments}."""

import numpy as np

from labkit import axxb
from labkit import kalman as filters


def handeye(T_BF, T_ST):
    return axxb.calibrate_hand_eye(T_BF, T_ST).T_FS


def kalman(F, Q, H, R, x0, P0, z):
    return filters.filter_series(z, F, H, Q, R, x0, P0)


def ekf(u, z, marks, x0, P0, Q, R):
    std_range, std_bearing = np.sqrt(np.diag(R))
    return filters.ekf_localize(u, z, marks, x0, P0, 0.1, std_range, std_bearing, cov_v=Q).x


HOOKS = {
    "handeye": handeye,
    "kalman": kalman,
    "ekf": ekf,
}
