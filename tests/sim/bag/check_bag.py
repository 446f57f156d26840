"""Reads our bags with Debian's rosbag and compares every value with the formulas of sample_data.h.

Usage: check_bag.py WRITE_BAG
"""

import filecmp
import math
import os
import struct
import subprocess
import sys
import tempfile

import genpy.dynamic
import rosbag
import roslib.message

ZERO = 1  # ns: ROS knows no time zero
IMU, SCAN, DEPTH = 5_000_000, 100_000_000, 33_333_333
XYZI = [("x", 0, 7, 1), ("y", 4, 7, 1), ("z", 8, 7, 1), ("intensity", 12, 7, 1)]
# By layout: how a point is packed, and the message's fields.
GENERIC = (struct.Struct("<ffffIBB"),
           XYZI + [("t", 16, 6, 1), ("ring", 20, 2, 1), ("tag", 21, 2, 1)])
DRIVER2 = (struct.Struct("<ffffBBd"),
           XYZI + [("tag", 16, 2, 1), ("line", 17, 2, 1), ("timestamp", 18, 8, 1)])
CUSTOM = {"livox_custom": "livox_ros_driver", "livox_custom2": "livox_ros_driver2"}
TOPICS = {"/imu/data": ("sensor_msgs/Imu", 200), "/imu/mag": ("sensor_msgs/MagneticField", 200),
          "/livox/imu": ("sensor_msgs/Imu", 200),
          "/livox/lidar": ("sensor_msgs/PointCloud2", 10),
          "/livox/frame_end": ("sensor_msgs/TimeReference", 10),
          "/tf": ("tf2_msgs/TFMessage", 200), "/truth": ("nav_msgs/Odometry", 200), "/camera/depth": ("sensor_msgs/Image", 3),
          "/camera/camera_info": ("sensor_msgs/CameraInfo", 3),
          "/tf_static": ("tf2_msgs/TFMessage", 1),
          "/map": ("nav_msgs/OccupancyGrid", 1), "/map_cloud": ("sensor_msgs/PointCloud2", 1),
          "/local_grid": ("sensor_msgs/PointCloud2", 1), "/path": ("nav_msgs/Path", 1),
          "/plan": ("nav_msgs/Path", 1), "/targets": ("visualization_msgs/MarkerArray", 1),
          "/decisions": ("visualization_msgs/MarkerArray", 1),
          "/vehicle": ("visualization_msgs/MarkerArray", 1), "/rosout": ("rosgraph_msgs/Log", 1)}
LATCHED = {"/tf_static", "/map", "/map_cloud", "/targets", "/vehicle"}
END = 199 * IMU


def expect(actual, wanted, what):
    if actual != wanted:
        sys.exit(f"{what}: {actual!r}, expected {wanted!r}")


def xyz(v):
    return (v.x, v.y, v.z)


def check_header(header, index, stamp, frame, what):
    expect((header.seq, header.stamp.to_nsec(), header.frame_id),
           (index, max(stamp, ZERO), frame), what)


def arrival_of_scan(i):
    return (i + 1) * SCAN + IMU if i < 9 else 199 * IMU


def check_imu(i, time, m):
    check_header(m.header, i, i * IMU, "base_link", f"imu {i}")
    expect(time, max(i * IMU, ZERO), f"imu {i} recorded")
    expect(xyz(m.angular_velocity), (0.25 * i, -0.5 * i, 1.0 + i), f"gyro {i}")
    expect(xyz(m.linear_acceleration), (0.125, -0.0625 * i, 9.75 + i), f"accel {i}")
    expect((m.orientation.w,) + xyz(m.orientation), (1, 0, 0, 0), f"orientation {i}")
    expect(m.orientation_covariance, (-1,) + 8 * (0,), f"orientation covariance {i}")
    expect(m.angular_velocity_covariance + m.linear_acceleration_covariance, 18 * (0,),
           f"imu covariance {i}")


def check_field(i, time, m):
    check_header(m.header, i, i * IMU, "base_link", f"field {i}")
    expect(time, max(i * IMU, ZERO), f"field {i} recorded")
    expect(xyz(m.magnetic_field), (1e-4 * 0.5, 1e-4 * (0.25 * i), 1e-4 * -0.125), f"field {i}")
    expect(m.magnetic_field_covariance, 9 * (0,), f"field covariance {i}")


def check_points(m, i, points, packing):
    for k, point in enumerate(points):
        x, y, z, intensity, t, line, tag = packing(point)
        expect((x, y, z, intensity, t, line, tag),
               (0.25 * k, -i, 0.5 - k, k % 256, 5000 * k, k % 4, k % 17), f"scan {i} point {k}")


def check_scan(i, time, m):
    check_header(m.header, i, i * SCAN, "livox_frame", f"scan {i}")
    expect(time, arrival_of_scan(i), f"scan {i} recorded")
    count = 0 if i == 9 else 20_000 - i
    if not hasattr(m, "fields"):
        expect((m.timebase, m.point_num, m.lidar_id, bytes(m.rsvd), len(m.points)),
               (i * SCAN, count, 0, bytes(3), count), f"scan {i} size")
        check_points(m, i, m.points, lambda p: (p.x, p.y, p.z, p.reflectivity, p.offset_time,
                                                p.line, p.tag))
        return
    driver2 = m.point_step == 26
    point, fields = DRIVER2 if driver2 else GENERIC
    expect((m.height, m.width, m.point_step, m.row_step, len(m.data)),
           (1, count, point.size, point.size * count, point.size * count), f"scan {i} size")
    expect((m.is_bigendian, m.is_dense), (False, True), f"scan {i} flags")
    expect([(f.name, f.offset, f.datatype, f.count) for f in m.fields], fields, f"scan {i} fields")
    check_points(m, i, point.iter_unpack(m.data),
                 (lambda p: p[:4] + (p[6] - i * SCAN, p[5], p[4])) if driver2 else lambda p: p)


def check_frame_end(i, time, m):
    check_header(m.header, i, i * SCAN, "livox_frame", f"frame end {i}")
    expect((time, m.time_ref.to_nsec(), m.source),
           (arrival_of_scan(i), (i + 1) * SCAN, "frame_end"), f"frame end {i}")


def check_tf(i, time, m):
    expect(time, max(i * IMU, ZERO), f"tf {i} recorded")
    transform, = m.transforms
    check_header(transform.header, i, i * IMU, "odom", f"tf {i}")
    expect((transform.child_frame_id, xyz(transform.transform.translation)),
           ("base_link", (0.5 * i, -0.25 * i, 1.5)), f"tf {i}")


def check_truth(i, time, m):
    check_header(m.header, i, i * IMU, "odom", f"truth {i}")
    expect(time, max(i * IMU, ZERO), f"truth {i} recorded")
    expect(m.child_frame_id, "base_link", f"truth {i} child")
    expect(xyz(m.pose.pose.position), (0.5 * i, -0.25 * i, 1.5), f"position {i}")
    q = m.pose.pose.orientation
    for actual, wanted in zip((q.x, q.y, q.z, q.w), (0, 0, math.sqrt(0.5), math.sqrt(0.5))):
        if abs(actual - wanted) > 1e-15:
            sys.exit(f"orientation {i}: {q}")
    # B's x lies along O's y, its y against O's x.
    expect(xyz(m.twist.twist.linear), (2.0, -i, -0.5), f"velocity {i}")
    expect(xyz(m.twist.twist.angular), (0.5, 0.25 * i, -3), f"rate {i}")
    expect(m.pose.covariance + m.twist.covariance, 72 * (0,), f"truth covariance {i}")


def check_depth(i, time, m):
    check_header(m.header, i, i * DEPTH, "camera_depth_optical_frame", f"depth {i}")
    expect(time, max(i * IMU, ZERO), f"depth {i} recorded")
    expect((m.width, m.height, m.encoding, m.is_bigendian, m.step, len(m.data)),
           (8, 6, "32FC1", 0, 32, 192), f"depth {i} layout")
    for k, (z,) in enumerate(struct.iter_unpack("<f", m.data)):
        wanted = 0.125 * (k + i)
        if k % 5 == i or wanted == 0:
            expect(math.isnan(z), True, f"depth {i} pixel {k} unmeasured")
        else:
            expect(z, wanted, f"depth {i} pixel {k}")


def check_camera_info(i, time, m):
    check_header(m.header, i, i * DEPTH, "camera_depth_optical_frame", f"camera info {i}")
    expect(time, max(i * IMU, ZERO), f"camera info {i} recorded")
    expect((m.width, m.height, m.distortion_model, m.D), (8, 6, "plumb_bob", 5 * (0,)), "camera")
    expect(m.K, (4.5, 0, 3.5, 0, 4.25, 2.75, 0, 0, 1), "camera K")
    expect(m.R, (1, 0, 0, 0, 1, 0, 0, 0, 1), "camera R")
    expect(m.P, (4.5, 0, 3.5, 0, 0, 4.25, 2.75, 0, 0, 0, 1, 0), "camera P")
    expect((m.binning_x, m.binning_y, m.roi.x_offset, m.roi.y_offset, m.roi.height, m.roi.width,
            m.roi.do_rectify), (0, 0, 0, 0, 0, 0, False), "camera binning and region")


def check_static_tf(_, time, m):
    expect(time, ZERO, "static tf recorded")
    # models/arex: the LiDAR leans forward by 45 degrees; the camera looks ahead.
    mounts = [("livox_frame", (0.15, 0, 0.01),
               (0, math.sin(math.pi / 8), 0, math.cos(math.pi / 8))),
              ("camera_depth_optical_frame", (0.14, 0, 0.07), (-0.5, 0.5, -0.5, 0.5))]
    expect(len(m.transforms), len(mounts), "transforms")
    for i, (t, (frame, position, rotation)) in enumerate(zip(m.transforms, mounts)):
        check_header(t.header, i, 0, "base_link", frame)
        expect((t.child_frame_id, xyz(t.transform.translation)), (frame, position), frame)
        q = t.transform.rotation
        dot = sum(a * b for a, b in zip((q.x, q.y, q.z, q.w), rotation))
        if abs(abs(dot) - 1) > 1e-14:
            sys.exit(f"{frame}: rotation {q}")


def check_map(_, time, m):
    check_header(m.header, 0, END, "odom", "map")
    expect((time, m.info.map_load_time.to_nsec(), m.info.resolution, m.info.width, m.info.height,
            xyz(m.info.origin.position), m.info.origin.orientation.w, m.data),
           (END, END, 0.5, 3, 2, (-1, -2, 0), 1, (-1, 0, 100, 0, 100, -1)), "map")


def check_cloud(points):
    def check(_, time, m):
        check_header(m.header, 0, END, "odom", "cloud")
        expect((m.height, m.width, m.point_step, m.row_step),
               (1, len(points), 12, 12 * len(points)), "cloud")
        expect([(f.name, f.offset, f.datatype, f.count) for f in m.fields], XYZI[:3], "its fields")
        expect(list(struct.iter_unpack("<fff", m.data)), points, "its points")
    return check


def check_path(frame_times, positions):
    def check(_, time, m):
        check_header(m.header, 0, END, "odom", "path")
        expect([(p.header.frame_id, p.header.stamp.to_nsec(), xyz(p.pose.position))
                for p in m.poses],
               [("odom", t, p) for t, p in zip(frame_times, positions)], "path")
    return check


def check_markers(frame, wanted):
    """Of each: name, number, shape, position, size, text; the first takes away what was shown."""
    def check(_, time, m):
        markers = m.markers
        if frame == "odom":
            expect(markers[0].action, 3, "the first marker deletes all")
            markers = markers[1:]
        expect([(k.ns, k.id, k.type, xyz(k.pose.position), xyz(k.scale), k.text)
                for k in markers], wanted, "markers")
        for k in markers:
            expect((k.header.frame_id, k.header.stamp.to_nsec(), k.action, k.frame_locked,
                    k.lifetime.to_nsec(), k.pose.orientation.w, k.color.a > 0),
                   (frame, END, 0, True, 0, 1, True), k.ns)
    return check


BOX, SPHERE, CYLINDER, LINE, TEXT = 1, 2, 3, 4, 9
SMALL, LARGE, LETTERS = 3 * (0.3,), 3 * (0.6,), 3 * (0.35,)
TARGETS = [("reached", 0, SPHERE, (4, 5, 6), SMALL, ""),
           ("numbers", 0, TEXT, (4, 5, 6.3), LETTERS, "1"),
           ("goal", 0, SPHERE, (1.5, 2, 3), LARGE, "")]
DECISION = [("near_obstacle", 0, SPHERE, (0, 1, 1.5), SMALL, ""),
            ("kept", 1, SPHERE, (2, 3, 1.5), LARGE, ""),
            ("chosen", 1, LINE, (0, 0, 0), (0.05, 0, 0), ""),
            ("kept", 2, SPHERE, (4, 3, 1.5), SMALL, ""),
            ("revenue", 2, TEXT, (4, 3, 1.8), LETTERS, "1.25"),
            ("decision", 0, TEXT, (2, 3, 1.8), LETTERS,
             "new_target\nrevenue 3.75\nf_I 12.2 m2, f_N 4.5 m, f_D 0.50")]
VEHICLE = [("vehicle", 0, CYLINDER, (0.25, 0, -0.5), (0.5, 0.5, 0.125), "")]


def check_decision(i, time, m):
    check_markers("odom", DECISION)(i, time, m)
    expect([xyz(p) for p in m.markers[3].points], [(2, 2, 1.5), (2, 3, 1.5)], "the line of sight")


def check_log(_, time, m):
    check_header(m.header, 0, END, "", "log")
    expect((time, m.level, m.name, m.msg, m.topics), (END, m.ERROR, "arex", "stuck: no_path", []),
           "log")


CHECKS = {"/map": check_map,
          "/map_cloud": check_cloud([(0.25, 0, 1), (0.5, -1, 1), (0.75, -2, 1)]),
          "/local_grid": check_cloud([(1.25, 2.75, 3.25), (1.75, 2.75, 3.75)]),
          "/path": check_path((ZERO, END), [(0, 0, 1.5), (0.5, -0.25, 1.5)]),
          "/plan": check_path((END, END), [(1, 2, 3), (1.5, 2, 3)]),
          "/targets": check_markers("odom", TARGETS), "/decisions": check_decision,
          "/vehicle": check_markers("base_link", VEHICLE), "/rosout": check_log,
          "/imu/data": check_imu, "/livox/imu": check_imu, "/imu/mag": check_field,
          "/livox/lidar": check_scan, "/livox/frame_end": check_frame_end, "/truth": check_truth,
          "/camera/depth": check_depth, "/camera/camera_info": check_camera_info,
          "/tf": check_tf, "/tf_static": check_static_tf}


def check_types(bag):
    """The definitions in the bag are those of Debian's message packages."""
    for c in bag._get_connections():
        stored = genpy.dynamic.generate_dynamic(c.datatype, c.msg_def)[c.datatype]
        expect(stored._md5sum, c.md5sum, f"{c.datatype} md5 of the stored definition")
        debian = roslib.message.get_message_class(c.datatype)
        if debian is None:
            # Of the drivers, as `rosmsg md5` says where they are installed.
            expect(c.md5sum, "e4d6829bdfe657cb6c21a746c86b21a6", f"{c.datatype} md5")
        else:
            expect(c.md5sum, debian._md5sum, f"{c.datatype} md5")
        expect(c.header.get("latching"), b"1" if c.topic in LATCHED else None,
               f"{c.topic} latching")


def check_messages(bag):
    seen = dict.fromkeys(TOPICS, 0)
    last = 0
    for topic, message, time in bag.read_messages():
        if time.to_nsec() < last:
            sys.exit(f"{topic}: read out of order at {time}")
        last = time.to_nsec()
        CHECKS[topic](seen[topic], last, message)
        seen[topic] += 1
    expect(seen, {topic: count for topic, (_, count) in TOPICS.items()}, "messages read")


def check_bag(file, compression, layout):
    with rosbag.Bag(file) as bag:
        info = bag.get_type_and_topic_info().topics
        topics = dict(TOPICS)
        if layout in CUSTOM:
            topics["/livox/lidar"] = (CUSTOM[layout] + "/CustomMsg", 10)
        expect({t: (i.msg_type, i.message_count) for t, i in info.items()}, topics, "topics")
        expect((bag.version, bag.get_compression_info().compression), (200, compression), "format")
        expect((bag.get_start_time(), bag.get_end_time()), (1e-9, 0.995), "span")
        check_types(bag)
        check_messages(bag)


def check_killed(file):
    """What a killed run leaves: rosbag refuses it until reindexed, then has every whole chunk."""
    try:
        rosbag.Bag(file)
        sys.exit("an unfinished bag opens as if it were whole")
    except rosbag.ROSBagUnindexedException:
        pass
    with rosbag.Bag(file, "a", allow_unindexed=True) as bag:
        for _ in bag.reindex():
            pass
    seen = dict.fromkeys(TOPICS, 0)
    with rosbag.Bag(file) as bag:
        for topic, message, time in bag.read_messages():
            CHECKS[topic](seen[topic], time.to_nsec(), message)
            seen[topic] += 1
    # Two scans fill a chunk: the ninth, and what followed it, was still in memory.
    expect((seen["/livox/lidar"], seen["/imu/data"] >= 160, seen["/imu/data"] < 200),
           (8, True, True), "left by a killed run")


def check_misses(file):
    """Firings without a return have their time and line, and zeros."""
    with rosbag.Bag(file) as bag:
        (_, scan, _), = bag.read_messages("/livox/lidar")
    expect(scan.width, 192, "firings")
    for k, point in enumerate(GENERIC[0].iter_unpack(scan.data)):
        time = (1000, 381_000)[k // 96] + 5000 * (k % 96)
        wanted = (1 + k, 2, 3, 7, time, k % 4, 5) if k % 5 == 0 else (0, 0, 0, 0, time, k % 4, 0)
        expect(point, wanted, f"firing {k}")


def main():
    write_bag = sys.argv[1]
    with tempfile.TemporaryDirectory() as folder:
        def write(compression, end, name, layout="generic"):
            file = os.path.join(folder, name)
            subprocess.run([write_bag, compression, end, layout, file], check=True)
            return file

        plain = write("none", "close", "plain.bag")
        check_bag(plain, "none", "generic")
        check_bag(write("lz4", "close", "lz4.bag"), "lz4", "generic")
        for layout in ("livox_driver2", "livox_custom", "livox_custom2"):
            check_bag(write("none", "close", layout + ".bag", layout), "none", layout)
        expect(filecmp.cmp(plain, write("none", "close", "again.bag"), shallow=False), True,
               "the same bytes again")
        check_misses(write("none", "misses", "misses.bag"))
        check_killed(write("none", "kill", "killed.bag") + ".active")


main()
