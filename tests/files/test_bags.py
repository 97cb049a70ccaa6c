"""ROS recordings, where `rosbags` is installed; the sentence where it is not."""

import sys
from pathlib import Path

import numpy as np
import pytest

from labkit.__main__ import main
from labkit.files.bags import read_bag
from labkit.files.text import FileError
from labkit.geometry.frames import matrix_from_quaternion


def test_without_the_package_one_sentence_says_so(monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    with pytest.raises(FileError, match="drive.mcap: ROS recordings need the package rosbags: pip install rosbags"):
        read_bag("drive.mcap", ["/pose"])


def written(folder, count=20):
    """A ROS 2 recording with stamped poses and tf, written by rosbags itself: positions (count, 3), quaternions."""
    from rosbags.rosbag2 import Writer
    from rosbags.typesys import Stores, get_typestore

    store, rng = get_typestore(Stores.ROS2_HUMBLE), np.random.default_rng(0)
    types = store.types
    Time, Header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
    Point, Vector = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Vector3"]
    Quaternion, Pose = types["geometry_msgs/msg/Quaternion"], types["geometry_msgs/msg/Pose"]
    Stamped, Transform = types["geometry_msgs/msg/PoseStamped"], types["geometry_msgs/msg/Transform"]
    One, Many = types["geometry_msgs/msg/TransformStamped"], types["tf2_msgs/msg/TFMessage"]
    p, q = rng.normal(size=(count, 3)), rng.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    with Writer(folder, version=9) as writer:
        poses = writer.add_connection("/flange", Stamped.__msgtype__, typestore=store)
        frames = writer.add_connection("/tf", Many.__msgtype__, typestore=store)
        for k in range(count):
            stamp = int(1.7e9 * 1e9) + k * 100_000_000
            header = Header(stamp=Time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="base")
            message = Stamped(header=header, pose=Pose(position=Point(*p[k]), orientation=Quaternion(*q[k])))
            writer.write(poses, stamp, store.serialize_cdr(message, Stamped.__msgtype__))
            turned = Transform(translation=Vector(*p[k] + 1), rotation=Quaternion(*q[k]))
            message = Many(transforms=[One(header=header, child_frame_id="tag", transform=turned)])
            writer.write(frames, stamp, store.serialize_cdr(message, Many.__msgtype__))
    return p, q


def test_topics_and_frames_of_a_recording(tmp_path, capsys):
    pytest.importorskip("rosbags", reason="the optional package rosbags is not installed")
    p, q = written(tmp_path / "drive")
    flange, tag = read_bag(tmp_path / "drive", ["/flange", "base:tag"])
    assert np.allclose(flange.T[:, :3, 3], p) and np.allclose(tag.T[:, :3, 3], p + 1)
    assert np.allclose(flange.T[:, :3, :3], matrix_from_quaternion(q))
    assert np.allclose(np.diff(flange.time), 0.1, atol=1e-5) and flange.length == "m"
    words = ["calibrate", "hand-eye", "--bag", str(tmp_path / "drive"), "--robot-topic", "/flange"]
    assert main([*words, "--sensor-topic", "base:tag"]) == 1  # it turns as the flange does
    assert "it seems that the sensor file holds the sensor in the target" in capsys.readouterr().err
    with pytest.raises(FileError, match="/nothing holds no stamped poses; topics that do: /flange, /tf"):
        read_bag(tmp_path / "drive", ["/nothing"])
    with pytest.raises(FileError, match="there is no such file"):
        read_bag(tmp_path / "none.bag", ["/flange"])
    spoilt = next(Path(tmp_path / "drive").glob("*.db3"))
    spoilt.write_bytes(b"nothing")
    with pytest.raises(FileError, match="the recording cannot be read"):
        read_bag(tmp_path / "drive", ["/flange"])
