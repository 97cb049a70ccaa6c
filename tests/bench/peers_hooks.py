"""Library functions behind the hooks of the peers' benchmark: {hook name: function with the hook's arguments}."""

from labkit import handeye


def sphere_handeye(T_BF, x_S):
    result = handeye.calibrate_sphere_target(T_BF, x_S)
    return result.T_FS, result.target


HOOKS = {
    "sphere_handeye": sphere_handeye,
}
