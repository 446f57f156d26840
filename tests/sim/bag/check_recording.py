"""Has bags of Debian's rosbag read by us, and compares what comes with what rosbag reads of them.

Usage: check_recording.py READ_RECORDING
"""

import os
import subprocess
import sys
import tempfile
import zlib

import genpy
import rosbag
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import Imu, PointCloud2


def expect(actual, wanted, what):
    if actual != wanted:
        sys.exit(f"{what}: {actual!r}, expected {wanted!r}")


def write(file, compression):
    """Small chunks, two topics, and times that run backwards now and then, across chunks as well."""
    with rosbag.Bag(file, "w", compression=compression, chunk_threshold=4096) as bag:
        for i in range(300):
            imu = Imu()
            imu.header.seq = i
            imu.header.stamp = genpy.Time(100, 5_000_000 * i % 1_000_000_000)
            imu.header.frame_id = "imu"
            imu.angular_velocity.x = 0.25 * i
            recorded = genpy.Time(100 + (i - 40 * (i % 7 == 0)) // 100, 1000 * (i % 100))
            bag.write("/imu", imu, recorded)
            if i % 10 == 0:
                cloud = PointCloud2(width=i, height=1, point_step=16, data=bytes(range(256)) * i)
                bag.write("/points", cloud, recorded)
        bag.write("/late", PoseStamped(), genpy.Time(50, 1))


def lines_of_rosbag(file):
    lines = []
    with rosbag.Bag(file) as bag:
        for topic, (datatype, data, *_), time in bag.read_messages(raw=True):
            lines.append(f"{time.to_nsec()} {topic} {datatype} {len(data)} {zlib.crc32(data)}")
    return lines


def lines_of_ours(program, file):
    done = subprocess.run([program, file], check=True, capture_output=True, text=True)
    return done.stdout.splitlines()


def in_groups(lines):
    """Messages recorded at one moment have no order."""
    return sorted(lines, key=lambda line: (int(line.split()[0]), line))


def main():
    program = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        for compression in ("none", "bz2", "lz4"):
            file = os.path.join(folder, compression + ".bag")
            write(file, compression)
            wanted = lines_of_rosbag(file)
            expect(len(wanted), 331, "messages that rosbag reads")
            ours = lines_of_ours(program, file)
            expect(ours[-1], "damaged 0", compression)
            times = [int(line.split()[0]) for line in ours[:-1]]
            expect(times, sorted(times), f"{compression}: order of time")
            expect(in_groups(ours[:-1]), in_groups(wanted), compression)


main()
