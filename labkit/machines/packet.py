"""The packets a tracker sends, encoded, checked and decoded.

E is the frame of the tracker, W the frame in which it reports (its own pose at the moment its axes were reset), so a
reading is `T_WE`. Packets speak meters, as the report does; poses are in mm and rad.
Source: report "Kalibrace a testovani systemu OTUS tracker", ZCU Plzen 2018: section 2, table 1.
"""

import struct

import numpy as np

from ..checks import as_finite, as_points, as_transforms, fit_together
from ..documented import documented
from ..geometry.frames import matrix_from_quaternion, pose, quaternion_from_matrix

# ---- the packet ------------------------------------------------------------------------------------------------------

# The one assumption about types: table 1 gives 8 bytes a field and nothing else. All 23 are taken as IEEE doubles,
# little-endian, lengths in meters (appendix D prints meters), time in seconds, angles in radians; identifier and
# buttons too.
PACKET = struct.Struct("<23d")
FIELDS = (
    "device", "time", "x", "y", "z", "vx", "vy", "vz", "ax", "ay", "az", "qx", "qy", "qz", "qw",
    "wx", "wy", "wz", "alpha_x", "alpha_y", "alpha_z", "button_1", "button_2",
)  # fmt: skip
TIME, POSITION, VELOCITY, QUATERNION, ANGULAR_VELOCITY = 1, slice(2, 5), slice(5, 8), slice(11, 15), slice(15, 18)
MAX_POSITION = 10.0  # m: twice the tracking area of the data sheet (5 x 5 m); farther away nothing is tracked
MAX_TIME = 1e10  # s, three centuries: no clock of a tracker has run that long
IMPLAUSIBLE = "the time stamp is implausible"
UNIT_TOLERANCE = 1e-3  # how far the length of a quaternion may be from 1


def encode_packet(values):
    """184 bytes of one reading; values, shape (23,), in the order of `FIELDS`."""
    values = as_finite(values, "values")
    if values.shape != (len(FIELDS),):
        raise ValueError(f"values must have shape (23,), one number per field of table 1, got {values.shape}")
    return PACKET.pack(*values)


@documented
def decode_packet(data):
    """The 23 numbers of a packet, in the order of `FIELDS`.

    Parameters
    ----------
    data : bytes, length 184

    Returns
    -------
    values : array, shape (23,)

    Raises
    ------
    ValueError
        When the length is wrong, a number is not finite, the quaternion is not of length 1, the time stamp is beyond
        1e10 s or the position is more than 10 m away.

    Source: report, section 2, table 1.
    """
    values, fault = check_packet(data)
    if fault:
        raise ValueError(f"not a packet of the tracker: {fault}")
    return np.array(values)


def check_packet(data):
    """(values, "") of a good packet, (None, reason) of a bad one; plain Python, since the receiver calls it for every
    datagram."""
    if not isinstance(data, bytes) or len(data) != PACKET.size:
        return None, f"length: expected {PACKET.size} bytes"
    values = PACKET.unpack(data)
    total = sum(values)
    if total - total != 0.0:  # infinite or NaN
        return None, "a number is not finite"
    qx, qy, qz, qw = values[11:15]
    if abs(qx * qx + qy * qy + qz * qz + qw * qw - 1.0) > 2 * UNIT_TOLERANCE:
        return None, "the quaternion is not of length 1"
    if abs(values[TIME]) > MAX_TIME:
        return None, IMPLAUSIBLE
    if max(map(abs, values[2:5])) > MAX_POSITION:
        return None, f"the position is more than {MAX_POSITION:g} m away"
    return values, ""


def packet_from_pose(T_WE, time, device=1, velocity=(0.0, 0.0, 0.0), angular_velocity=(0.0, 0.0, 0.0)):
    """The 23 numbers of a packet for a pose.

    Parameters
    ----------
    T_WE : array-like, shape (..., 4, 4)
        mm.
    time : array-like, shape (...), s
    device : array-like, shape (...)
    velocity, angular_velocity : array-like, shape (..., 3)
        mm/s and rad/s.

    Returns
    -------
    values : array, shape (..., 23)
        In the order of `FIELDS`.

    Raises
    ------
    ValueError
        Shapes that do not fit the poses.
    """
    T_WE, device, time = as_transforms(T_WE, "T_WE"), as_finite(device, "device"), as_finite(time, "time")
    velocity, angular_velocity = as_points(velocity, "velocity"), as_points(angular_velocity, "angular_velocity")
    leading = {"device": device.shape, "time": time.shape, "velocity": velocity.shape[:-1]}
    leading["angular_velocity"] = angular_velocity.shape[:-1]
    if fit_together(T_WE=T_WE.shape[:-2], **leading) != T_WE.shape[:-2]:
        raise ValueError(f"there must be one pose, or one per reading, got T_WE {T_WE.shape} and {leading}")
    values = np.zeros((*T_WE.shape[:-2], len(FIELDS)))
    values[..., 0], values[..., TIME] = device, time
    values[..., POSITION] = T_WE[..., :3, 3] / 1000
    values[..., VELOCITY] = velocity / 1000
    values[..., QUATERNION] = quaternion_from_matrix(T_WE[..., :3, :3])
    values[..., ANGULAR_VELOCITY] = angular_velocity
    return values


def poses_from_packets(values):
    """Poses T_WE in mm of decoded packets; (..., 23) -> (..., 4, 4)."""
    values = as_points(values, "values", dim=len(FIELDS))
    return pose(matrix_from_quaternion(values[..., QUATERNION]), 1000 * values[..., POSITION])
