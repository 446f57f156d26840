// Reads an MCAP file of write_bag with the readers of MCAP's and Foxglove's own packages and compares
// its values with the formulas of sample_data.h.
//
// Usage: node check_mcap.mjs FILE LAYOUT
import { readFile } from "node:fs/promises";
import { deepStrictEqual as expectEqual, ok as expect } from "node:assert";

import { parse } from "@foxglove/rosmsg";
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
  if (layout === "livox_custom2") {
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

const scanType = layout === "livox_custom2" ? "livox_ros_driver2/msg/CustomMsg"
  : "sensor_msgs/msg/PointCloud2";
const TOPICS = {
  "/imu/data": ["sensor_msgs/msg/Imu", 200, checkImu],
  "/livox/imu": ["sensor_msgs/msg/Imu", 200, checkImu],
  "/livox/lidar": [scanType, 10, checkScan],
  "/livox/frame_end": ["sensor_msgs/msg/TimeReference", 10, checkFrameEnd],
  "/truth": ["nav_msgs/msg/Odometry", 200, checkTruth],
  "/camera/depth": ["sensor_msgs/msg/Image", 3, checkDepth],
  "/camera/camera_info": ["sensor_msgs/msg/CameraInfo", 3, checkCamera],
  "/tf": ["tf2_msgs/msg/TFMessage", 200, checkTransform],
  "/tf_static": ["tf2_msgs/msg/TFMessage", 1, checkMounts],
};

// By the summary and its indexes, as players read it. It checks the checksums, too.
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, size) => bytes.subarray(Number(offset), Number(offset + size)),
};
const indexed = await McapIndexedReader.Initialize({ readable });
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
  decoders.set(id, new MessageReader(parse(text, { ros2: true })));
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
const stream = new McapStreamReader({ validateCrcs: true });
stream.append(bytes);
let messages = 0;
for (let record; (record = stream.nextRecord()); ) messages += record.type === "Message";
expect(stream.done());
expectEqual(messages, Number(indexed.statistics.messageCount));
