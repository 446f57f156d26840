#include "bag/arrival_queue.h"

#include <cstdlib>
#include <utility>

namespace arex::sim {
namespace {

// The eyes of a pair share a shutter; what drivers stamp them with differs by less.
constexpr Stamp kSameShutter = kNanosecondsPerSecond / 1000;
// The other eye's image is not looked for any later.
constexpr Stamp kLongestWait = kNanosecondsPerSecond / 20;

bool of_one_shutter(Stamp a, Stamp b) { return std::abs(a - b) <= kSameShutter; }

}  // namespace

void ArrivalQueue::pass(Stamp time) {
  if (waits_ && time > queue_[waiting_].time + kLongestWait) waits_ = false;
}

void ArrivalQueue::push(Arrival arrival) {
  pass(arrival.time);
  queue_.push_back(std::move(arrival));
}

void ArrivalQueue::push_pair(Stamp time, std::shared_ptr<StereoImage> pair) {
  Arrival arrival;
  arrival.time = time;
  arrival.images = std::move(pair);
  queue_.push_back(std::move(arrival));
}

void ArrivalQueue::push_left(Stamp time, std::shared_ptr<StereoImage> left) {
  waits_ = false;  // for the eye of the one before
  if (right_ && of_one_shutter(right_->stamp, left->time_ns)) {
    left->right = std::move(std::exchange(right_, std::nullopt)->grey);
    push_pair(time, std::move(left));
    return;
  }
  left_ = left;
  waiting_ = queue_.size();
  waits_ = true;
  push_pair(time, std::move(left));
}

void ArrivalQueue::push_right(Stamp time, Stamp stamp, std::vector<std::uint8_t> grey) {
  pass(time);
  if (!waits_ || !of_one_shutter(stamp, left_->time_ns)) {
    right_ = RightEye{stamp, std::move(grey)};
    return;
  }
  waits_ = false;
  queue_[waiting_].images = nullptr;
  left_->right = std::move(grey);
  push_pair(time, std::move(left_));
}

std::optional<Arrival> ArrivalQueue::pop() {
  while (!queue_.empty()) {
    if (waits_ && waiting_ == 0) return std::nullopt;
    Arrival arrival = std::move(queue_.front());
    queue_.pop_front();
    if (waits_) --waiting_;
    if (!arrival.empty()) return arrival;
  }
  return std::nullopt;
}

}  // namespace arex::sim
