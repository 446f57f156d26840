#include "bag/arrival_queue.h"

#include <gtest/gtest.h>

#include <string>

namespace arex::sim {
namespace {

constexpr Stamp kMs = 1'000'000;

std::shared_ptr<StereoImage> left(Stamp stamp) {
  auto image = std::make_shared<StereoImage>();
  image->time_ns = stamp;
  image->left = {1};
  return image;
}

Arrival sample(Stamp time) {
  Arrival arrival;
  arrival.time = time;
  arrival.imu = ImuSample{};
  arrival.imu->stamp = time;
  return arrival;
}

/// What comes out now: i for a sample, l for a left eye alone, p for a pair, each with its ms.
std::string all(ArrivalQueue& queue) {
  std::string text;
  while (const auto arrival = queue.pop()) {
    const char* kind = arrival->imu ? "i" : arrival->images->right.empty() ? "l" : "p";
    text += kind + std::to_string(arrival->time / kMs) + " ";
  }
  return text;
}

TEST(ArrivalQueue, JoinsTheEyesAtTheTimeOfTheLater) {
  ArrivalQueue queue;
  queue.push_left(10 * kMs, left(5 * kMs));
  queue.push(sample(12 * kMs));
  EXPECT_EQ(all(queue), "");  // the right eye may still come
  queue.push_right(13 * kMs, 5 * kMs, {2});
  queue.push(sample(14 * kMs));
  EXPECT_EQ(all(queue), "i12 p13 i14 ");
  queue.push_right(20 * kMs, 16 * kMs, {2});  // the other way round
  queue.push(sample(21 * kMs));
  queue.push_left(22 * kMs, left(16 * kMs + 900'000));
  EXPECT_EQ(all(queue), "i21 p22 ");
}

TEST(ArrivalQueue, HandsALeftEyeOnAtItsOwnTimeWhereNoRightOneComes) {
  ArrivalQueue queue;
  queue.push_left(10 * kMs, left(5 * kMs));
  queue.push(sample(12 * kMs));
  queue.push_left(43 * kMs, left(38 * kMs));  // the next exposure
  EXPECT_EQ(all(queue), "l10 i12 ");
  queue.push_right(43 * kMs, 38 * kMs, {2});
  EXPECT_EQ(all(queue), "p43 ");
  queue.push_left(70 * kMs, left(65 * kMs));
  queue.push(sample(100 * kMs));
  EXPECT_EQ(all(queue), "");
  queue.push(sample(121 * kMs));  // too late for a right one
  EXPECT_EQ(all(queue), "l70 i100 i121 ");
  queue.push_left(130 * kMs, left(125 * kMs));
  queue.close();
  EXPECT_EQ(all(queue), "l130 ");
}

TEST(ArrivalQueue, DropsARightEyeWithoutItsLeftOne) {
  ArrivalQueue queue;
  queue.push_right(10 * kMs, 5 * kMs, {2});
  queue.push_left(40 * kMs, left(38 * kMs));
  queue.push_right(41 * kMs, 45 * kMs, {2});  // of another exposure
  queue.close();
  EXPECT_EQ(all(queue), "l40 ");
}

}  // namespace
}  // namespace arex::sim
