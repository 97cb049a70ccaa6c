"""Streams of poses from ROS recordings (ROS 1, ROS 2, MCAP), where the optional package `rosbags` is installed."""

from pathlib import Path

import numpy as np

from ..geometry.frames import matrix_from_quaternion, pose
from ..reading import regular
from .poses import Poses
from .text import FileError

KINDS = ("PoseStamped", "PoseWithCovarianceStamped", "TransformStamped", "Odometry", "TFMessage")


def read_bag(path, topics):
    """One stream of poses for each topic of a recording, positions in m.

    Parameters
    ----------
    path : str or Path
        A .bag or .mcap file, or the folder of a ROS 2 recording.
    topics : sequence of str
        Names of topics with stamped poses, or `PARENT:CHILD`, two frames that tf joins directly.

    Returns
    -------
    list of Poses

    Raises
    ------
    FileError
        When the package is missing, the recording cannot be read, or a topic holds no poses.
    """
    path = Path(path)
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise FileError(f"{path.name}: ROS recordings need the package rosbags: pip install rosbags") from None
    if not path.exists():
        raise FileError(f"{path.name}: there is no such file")
    samples = [[] for _ in topics]
    try:
        recording = path if path.is_dir() else regular(path)
        with AnyReader([recording], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            known = {c.topic: c.msgtype.rpartition("/")[2] for c in reader.connections}
            wanted = {t for t in topics if ":" not in t} | (
                {"/tf", "/tf_static"} if any(":" in t for t in topics) else set()
            )
            chosen = [c for c in reader.connections if c.topic in wanted and known[c.topic] in KINDS]
            for connection, _, data in reader.messages(connections=chosen):
                message = reader.deserialize(data, connection.msgtype)
                for k, topic in enumerate(topics):
                    samples[k] += _samples(message, known[connection.topic], connection.topic, topic)
    except FileError:
        raise
    except Exception as error:  # whatever a spoilt recording makes the reader raise is one sentence
        raise FileError(f"{path.name}: the recording cannot be read: {' '.join(str(error).split())[:160]}") from None
    return [_stream(path.name, topic, found, known) for topic, found in zip(topics, samples)]


def _samples(message, kind, topic, wanted):
    """(time, position, quaternion) of each pose in a message that was asked for."""
    if kind == "TFMessage":
        parent, _, child = wanted.partition(":")
        return [
            _transform(t)
            for t in message.transforms
            if child
            and (t.header.frame_id.strip("/"), t.child_frame_id.strip("/")) == (parent.strip("/"), child.strip("/"))
        ]
    if topic != wanted:
        return []
    if kind == "TransformStamped":
        return [_transform(message)]
    inner = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    return [(_seconds(message.header.stamp), inner.position, inner.orientation)]


def _transform(message):
    return _seconds(message.header.stamp), message.transform.translation, message.transform.rotation


def _seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec


def _stream(name, topic, found, known):
    if not found:
        there = ", ".join(sorted(t for t, kind in known.items() if kind in KINDS)) or "none"
        raise FileError(f"{name}: {topic} holds no stamped poses; topics that do: {there[:160]}")
    found = {time: (p, q) for time, p, q in found}  # one pose a time: a doubled message is the same
    time = np.array(sorted(found))
    p = np.array([[getattr(found[t][0], axis) for axis in "xyz"] for t in time], float)
    q = np.array([[getattr(found[t][1], axis) for axis in "xyzw"] for t in time], float)
    length = np.linalg.norm(q, axis=1)
    bad = ~(np.isfinite(p).all(1) & (np.abs(length - 1) < 0.01))
    if bad.any():
        k = int(np.argmax(bad))
        raise FileError(f"{name}: {topic}, message {k + 1}: the pose is not finite, or its quaternion has not length 1")
    places = tuple(f"message {k + 1}" for k in range(len(time)))
    said = f"{name}: {len(time)} poses of {topic}, m"
    return Poses(name, pose(matrix_from_quaternion(q), p), time, None, places, "bag", "m", said)
