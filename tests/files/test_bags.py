"""ROS recordings, where `rosbags` is installed; the sentence where it is not."""

import contextlib
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


@contextlib.contextmanager
def recording(path, kind):
    """What writes a recording of one kind, by rosbags itself: (types, add a topic, write a message, has `seq`)."""
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    first = kind == "ROS 1"
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    if first:  # its store knows no tf
        store.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage"))
    pack = store.serialize_ros1 if first else store.serialize_cdr
    plugin = StoragePlugin.MCAP if kind == "MCAP" else StoragePlugin.SQLITE3
    with Writer1(path) if first else Writer(path, version=9, storage_plugin=plugin) as writer:

        def add(topic, message_type):
            connection = writer.add_connection(topic, message_type.__msgtype__, typestore=store)
            return lambda stamp, message: writer.write(connection, stamp, pack(message, message.__msgtype__))

        yield store.types, add, {"seq": 0} if first else {}


def written(path, kind, count=20):
    """A recording with stamped poses and tf: positions (count, 3), quaternions (count, 4)."""
    rng = np.random.default_rng(0)
    p, q = rng.normal(size=(count, 3)), rng.normal(size=(count, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True)
    with recording(path, kind) as (types, add, numbered):
        Time, Header = types["builtin_interfaces/msg/Time"], types["std_msgs/msg/Header"]
        Point, Vector = types["geometry_msgs/msg/Point"], types["geometry_msgs/msg/Vector3"]
        Quaternion, Pose = types["geometry_msgs/msg/Quaternion"], types["geometry_msgs/msg/Pose"]
        Stamped, Transform = types["geometry_msgs/msg/PoseStamped"], types["geometry_msgs/msg/Transform"]
        One, Many = types["geometry_msgs/msg/TransformStamped"], types["tf2_msgs/msg/TFMessage"]
        flange, tf = add("/flange", Stamped), add("/tf", Many)
        for k in range(count):
            stamp = int(1.7e9 * 1e9) + k * 100_000_000
            header = Header(**numbered, stamp=Time(sec=stamp // 10**9, nanosec=stamp % 10**9), frame_id="base")
            flange(stamp, Stamped(header=header, pose=Pose(position=Point(*p[k]), orientation=Quaternion(*q[k]))))
            turned = Transform(translation=Vector(*p[k] + 1), rotation=Quaternion(*q[k]))
            tf(stamp, Many(transforms=[One(header=header, child_frame_id="tag", transform=turned)]))
    return p, q


@pytest.mark.parametrize("kind, file", [("ROS 1", "drive.bag"), ("ROS 2", "drive"), ("MCAP", "drive/drive.mcap")])
def test_every_kind_of_recording_gives_the_same_streams(kind, file, tmp_path):
    pytest.importorskip("rosbags", reason="the optional package rosbags is not installed")
    p, q = written(tmp_path / file.partition("/")[0], kind)
    flange, tag = read_bag(tmp_path / file, ["/flange", "base:tag"])
    assert np.allclose(flange.T[:, :3, 3], p) and np.allclose(tag.T[:, :3, 3], p + 1)
    assert np.allclose(flange.T[:, :3, :3], matrix_from_quaternion(q))
    assert np.allclose(np.diff(flange.time), 0.1, atol=1e-5) and flange.length == "m"


def test_what_is_wrong_with_a_recording_is_one_sentence(tmp_path, capsys):
    pytest.importorskip("rosbags", reason="the optional package rosbags is not installed")
    written(tmp_path / "drive", "ROS 2")
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
