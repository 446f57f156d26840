// Reads an MCAP file of write_bag with the readers of MCAP's and Foxglove's own packages and compares
// its values with the formulas of sample_data.h.
//
// Usage: node check_mcap.mjs FILE LAYOUT
import { readFile } from "node:fs/promises";
import { deepStrictEqual as expectEqual, ok as expect } from "node:assert";

import { parse } from "@foxglove/rosmsg";
import standard from "@foxglove/rosmsg-msgs-common";
import decompressLz4 from "@foxglove/wasm-lz4";
import { MessageReader } from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";

const IMU = 5_000_000, SCAN = 100_000_000, DEPTH = 33_333_333;
const [file, layout] = process.argv.slice(2);
const bytes = await readFile(file);

const nanoseconds = ({ sec, nanosec, nsec }) => sec * 1e9 + (nanosec ?? nsec);
const stamp = (time) => Math.max(time, 1); // ROS knows no time zero
const xyz = ({ x, y, z }) => [x + 0, y + 0, z + 0]; // never -0
const arrivalOfScan = (i) => (i < 9 ? (i + 1) * SCAN + IMU : 199 * IMU);

function checkHeader(header, time, frame) {
  expectEqual([nanoseconds(header.stamp), header.frame_id], [stamp(time), frame]);
}

function checkImu(m, i, time) {
  checkHeader(m.header, i * IMU, "base_link");
  expectEqual(time, stamp(i * IMU));
  expectEqual(xyz(m.angular_velocity), [0.25 * i, -0.5 * i + 0, 1 + i]);
  expectEqual(xyz(m.linear_acceleration), [0.125, -0.0625 * i + 0, 9.75 + i]);
  expectEqual(Array.from(m.orientation_covariance), [-1, 0, 0, 0, 0, 0, 0, 0, 0]);
}

function checkPoint(point, i, k) {
  expectEqual(point, [0.25 * k, -i + 0, 0.5 - k, k % 256, 5000 * k, k % 4, k % 17]);
}

function checkScan(m, i, time) {
  checkHeader(m.header, i * SCAN, "livox_frame");
  expectEqual(time, arrivalOfScan(i));
  const count = i === 9 ? 0 : 20_000 - i;
  if (layout.startsWith("livox_custom")) {
    expectEqual([Number(m.timebase), m.point_num, m.points.length], [i * SCAN, count, count]);
    m.points.forEach((p, k) =>
      checkPoint([p.x, p.y || 0, p.z, p.reflectivity, p.offset_time, p.line, p.tag], i, k));
    return;
  }
  const driver2 = layout === "livox_driver2";
  expectEqual(m.fields.map((f) => f.name), driver2
    ? ["x", "y", "z", "intensity", "tag", "line", "timestamp"]
    : ["x", "y", "z", "intensity", "t", "ring", "tag"]);
  expectEqual([m.width, m.point_step, m.data.byteLength],
    [count, driver2 ? 26 : 22, count * (driver2 ? 26 : 22)]);
  const view = new DataView(m.data.buffer, m.data.byteOffset, m.data.byteLength);
  for (let k = 0; k < count; ++k) {
    const at = k * m.point_step;
    const f32 = (offset) => view.getFloat32(at + offset, true) || 0;
    const u8 = (offset) => view.getUint8(at + offset);
    const rest = driver2
      ? [view.getFloat64(at + 18, true) - i * SCAN, u8(17), u8(16)]
      : [view.getUint32(at + 16, true), u8(20), u8(21)];
    checkPoint([f32(0), f32(4), f32(8), f32(12), ...rest], i, k);
  }
}

function checkFrameEnd(m, i, time) {
  checkHeader(m.header, i * SCAN, "livox_frame");
  expectEqual([time, nanoseconds(m.time_ref), m.source],
    [arrivalOfScan(i), (i + 1) * SCAN, "frame_end"]);
}

function checkTruth(m, i, time) {
  checkHeader(m.header, i * IMU, "odom");
  expectEqual([time, m.child_frame_id], [stamp(i * IMU), "base_link"]);
  expectEqual(xyz(m.pose.pose.position), [0.5 * i, -0.25 * i + 0, 1.5]);
  expectEqual(xyz(m.twist.twist.angular), [0.5, 0.25 * i, -3]);
}

function checkDepth(m, i) {
  checkHeader(m.header, i * DEPTH, "camera_depth_optical_frame");
  expectEqual([m.width, m.height, m.encoding, m.step, m.data.length], [8, 6, "32FC1", 32, 192]);
}

function checkCamera(m, i) {
  checkHeader(m.header, i * DEPTH, "camera_depth_optical_frame");
  expectEqual([m.width, m.height, m.distortion_model, Array.from(m.d)],
    [8, 6, "plumb_bob", [0, 0, 0, 0, 0]]);
  expectEqual(Array.from(m.k), [4.5, 0, 3.5, 0, 4.25, 2.75, 0, 0, 1]);
  expectEqual(Array.from(m.p), [4.5, 0, 3.5, 0, 0, 4.25, 2.75, 0, 0, 0, 1, 0]);
}

function checkTransform(m, i, time) {
  expectEqual([time, m.transforms.length], [stamp(i * IMU), 1]);
  checkHeader(m.transforms[0].header, i * IMU, "odom");
  expectEqual(xyz(m.transforms[0].transform.translation), [0.5 * i, -0.25 * i + 0, 1.5]);
}

function checkMounts(m) {
  expectEqual(m.transforms.map((t) => [t.child_frame_id, xyz(t.transform.translation)]),
    [["livox_frame", [0.15, 0, 0.01]], ["camera_depth_optical_frame", [0.14, 0, 0.07]]]);
}

const END = 199 * IMU;

function checkMap(m, i, time) {
  checkHeader(m.header, END, "odom");
  expectEqual([time, nanoseconds(m.info.map_load_time), m.info.resolution, m.info.width,
    m.info.height, xyz(m.info.origin.position), m.info.origin.orientation.w, Array.from(m.data)],
  [END, END, 0.5, 3, 2, [-1, -2, 0], 1, [-1, 0, 100, 0, 100, -1]]);
}

const checkCloud = (points) => (m) => {
  checkHeader(m.header, END, "odom");
  expectEqual([m.height, m.width, m.point_step, m.fields.map((f) => f.name)],
    [1, points.length, 12, ["x", "y", "z"]]);
  const view = new DataView(m.data.buffer, m.data.byteOffset, m.data.byteLength);
  points.forEach((point, k) => expectEqual(
    [0, 4, 8].map((offset) => view.getFloat32(12 * k + offset, true)), point));
};

const checkPath = (times, positions) => (m) => {
  checkHeader(m.header, END, "odom");
  expectEqual(m.poses.map((p) => [p.header.frame_id, nanoseconds(p.header.stamp),
    xyz(p.pose.position)]), positions.map((p, k) => ["odom", times[k], p]));
};

// Of each: name, number, shape, position, size, text; the first takes away what was shown.
const checkMarkers = (frame, wanted) => (m) => {
  const markers = m.markers.slice(frame === "odom" ? 1 : 0);
  if (frame === "odom") expectEqual(m.markers[0].action, 3);
  expectEqual(markers.map((k) => [k.ns, k.id, k.type, xyz(k.pose.position), xyz(k.scale), k.text]),
    wanted);
  for (const k of markers) {
    checkHeader(k.header, END, frame);
    expectEqual([k.action, k.frame_locked, k.lifetime.sec, k.pose.orientation.w, k.mesh_resource,
      k.texture.format, k.uv_coordinates.length, k.mesh_file.filename, k.mesh_file.data.length,
      k.mesh_use_embedded_materials], [0, true, 0, 1, "", "", 0, "", 0, false]);
    expect(k.color.a > 0);
  }
};

const BOX = 1, SPHERE = 2, CYLINDER = 3, LINE = 4, TEXT = 9;
const SMALL = [0.3, 0.3, 0.3], LARGE = [0.6, 0.6, 0.6], LETTERS = [0.35, 0.35, 0.35];
const TARGETS = [["reached", 0, SPHERE, [4, 5, 6], SMALL, ""],
  ["numbers", 0, TEXT, [4, 5, 6.3], LETTERS, "1"], ["goal", 0, SPHERE, [1.5, 2, 3], LARGE, ""]];
const DECISION = [["near_obstacle", 0, SPHERE, [0, 1, 1.5], SMALL, ""],
  ["kept", 1, SPHERE, [2, 3, 1.5], LARGE, ""], ["chosen", 1, LINE, [0, 0, 0], [0.05, 0, 0], ""],
  ["kept", 2, SPHERE, [4, 3, 1.5], SMALL, ""],
  ["revenue", 2, TEXT, [4, 3, 1.8], LETTERS, "1.25"],
  ["decision", 0, TEXT, [2, 3, 1.8], LETTERS,
    "new_target\nrevenue 3.75\nf_I 12.2 m2, f_N 4.5 m, f_D 0.50"]];
const VEHICLE = [["vehicle", 0, CYLINDER, [0.25, 0, -0.5], [0.5, 0.5, 0.125], ""]];

function checkDecision(m) {
  checkMarkers("odom", DECISION)(m);
  expectEqual(m.markers[3].points.map(xyz), [[2, 2, 1.5], [2, 3, 1.5]]);
}

function checkLog(m) {
  expectEqual([nanoseconds(m.stamp), m.level, m.name, m.msg], [END, 40, "arex", "stuck: no_path"]);
}

const scanType = { livox_custom: "livox_ros_driver/msg/CustomMsg",
  livox_custom2: "livox_ros_driver2/msg/CustomMsg" }[layout] ?? "sensor_msgs/msg/PointCloud2";
const TOPICS = {
  "/imu/data": ["sensor_msgs/msg/Imu", 200, checkImu],
  "/livox/imu": ["sensor_msgs/msg/Imu", 200, checkImu],
  "/imu/mag": ["sensor_msgs/msg/MagneticField", 200, () => {}],
  "/livox/lidar": [scanType, 10, checkScan],
  "/livox/frame_end": ["sensor_msgs/msg/TimeReference", 10, checkFrameEnd],
  "/truth": ["nav_msgs/msg/Odometry", 200, checkTruth],
  "/camera/depth": ["sensor_msgs/msg/Image", 3, checkDepth],
  "/camera/camera_info": ["sensor_msgs/msg/CameraInfo", 3, checkCamera],
  "/tf": ["tf2_msgs/msg/TFMessage", 200, checkTransform],
  "/tf_static": ["tf2_msgs/msg/TFMessage", 1, checkMounts],
  "/map": ["nav_msgs/msg/OccupancyGrid", 1, checkMap],
  "/map_cloud": ["sensor_msgs/msg/PointCloud2", 1,
    checkCloud([[0.25, 0, 1], [0.5, -1, 1], [0.75, -2, 1]])],
  "/local_grid": ["sensor_msgs/msg/PointCloud2", 1,
    checkCloud([[1.25, 2.75, 3.25], [1.75, 2.75, 3.75]])],
  "/path": ["nav_msgs/msg/Path", 1, checkPath([1, END], [[0, 0, 1.5], [0.5, -0.25, 1.5]])],
  "/plan": ["nav_msgs/msg/Path", 1, checkPath([END, END], [[1, 2, 3], [1.5, 2, 3]])],
  "/targets": ["visualization_msgs/msg/MarkerArray", 1, checkMarkers("odom", TARGETS)],
  "/decisions": ["visualization_msgs/msg/MarkerArray", 1, checkDecision],
  "/vehicle": ["visualization_msgs/msg/MarkerArray", 1, checkMarkers("base_link", VEHICLE)],
  "/rosout": ["rcl_interfaces/msg/Log", 1, checkLog],
};

// The fields of a definition, as ROS 2 Humble has them: rosbag2 plays what lies as these say.
function checkFields(definitions) {
  for (const { name, definitions: fields } of definitions) {
    const official = standard.ros2humble[name ?? ""];
    if (!official) continue;  // of Livox's drivers
    const own = (list) => list.filter((f) => !f.isConstant)
      .map((f) => [f.type, f.name, f.isArray ?? false, f.arrayLength ?? 0]);
    expectEqual(own(fields), own(official.definitions), name);
  }
}

await decompressLz4.isLoaded;
const decompressHandlers = { lz4: (packed, size) => decompressLz4(packed, Number(size)) };

// By the summary and its indexes, as players read it. It checks the checksums, too.
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const indexed = await McapIndexedReader.Initialize({ readable, decompressHandlers });
expectEqual([indexed.header.profile, indexed.header.library], ["ros2", "arex"]);
expectEqual(Number(indexed.statistics.messageCount),
  Object.values(TOPICS).reduce((sum, [, count]) => sum + count, 0));
const decoders = new Map();
for (const [id, channel] of indexed.channelsById) {
  const schema = indexed.schemasById.get(channel.schemaId);
  expectEqual([channel.messageEncoding, schema.encoding, schema.name],
    ["cdr", "ros2msg", TOPICS[channel.topic][0]]);
  expectEqual(Number(indexed.statistics.channelMessageCounts.get(id)), TOPICS[channel.topic][1]);
  const text = new TextDecoder().decode(schema.data);
  const definitions = parse(text, { ros2: true });
  checkFields([{ ...definitions[0], name: schema.name.replace("/msg/", "/") },
    ...definitions.slice(1)]);
  decoders.set(id, new MessageReader(definitions));
}
const latched = [...indexed.channelsById.values()].find((c) => c.topic === "/tf_static");
expect(latched.metadata.get("offered_qos_profiles").includes("durability: 1"));

const seen = {};
let last = 0;
for await (const message of indexed.readMessages()) {
  const { topic } = indexed.channelsById.get(message.channelId);
  const time = Number(message.logTime);
  expect(time >= last, `${topic}: out of order`);
  last = time;
  const i = (seen[topic] ??= 0);
  try {
    TOPICS[topic][2](decoders.get(message.channelId).readMessage(message.data), i, time);
  } catch (error) {
    throw new Error(`${topic} ${i}: ${error.message}`);
  }
  ++seen[topic];
}
expectEqual(seen, Object.fromEntries(Object.keys(seen).map((topic) => [topic, TOPICS[topic][1]])));
expectEqual(Object.keys(seen).length, Object.keys(TOPICS).length);

// And from the beginning on, record by record.
const stream = new McapStreamReader({ validateCrcs: true, decompressHandlers });
stream.append(bytes);
let messages = 0;
for (let record; (record = stream.nextRecord()); ) messages += record.type === "Message";
expect(stream.done());
expectEqual(messages, Number(indexed.statistics.messageCount));
