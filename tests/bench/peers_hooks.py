"""Library functions behind the hooks of the peers' benchmark: {hook name: function with the hook's arguments}."""

from labkit import axxb


def handeye(T_BF, T_ST):
    return axxb.calibrate_hand_eye(T_BF, T_ST).T_FS


HOOKS = {
    "handeye": handeye,
}
