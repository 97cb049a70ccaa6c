"""Library functions behind the hooks of the peers' benchmark: {hook name: function with the hook's arguments}."""

from labkit import axxb, handeye


def ax_xb(T_BF, T_ST):
    return axxb.calibrate_hand_eye(T_BF, T_ST).T_FS


def sphere_handeye(T_BF, x_S):
    result = handeye.calibrate_sphere_target(T_BF, x_S)
    return result.T_FS, result.target


HOOKS = {
    "handeye": ax_xb,
    "sphere_handeye": sphere_handeye,
}
