#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "bag/bag_writer.h"
#include "jobs/job_queue.h"
#include "math/fingerprint.h"
#include "physics/airframe.h"
#include "physics/powertrain.h"
#include "physics/truth.h"
#include "sensors/fault.h"
#include "sensors/infrared_shot.h"
#include "sensors/scene.h"
#include "stack/flight_software.h"
#include "worlds/world.h"

namespace arex::sim {

/// The truth at one tick of the clock.
struct Moment {
  Stamp now = 0;
  const Truth& truth;
  const Truth& before;  ///< a tick ago
  const BatteryState& battery;
};

/// Where readings go to. Constant while a flight goes on.
struct Outlets {
  FlightSoftware* software = nullptr;
  std::vector<BagWriter*> bags;  ///< where they are recorded
  Fingerprint frames;            ///< of every scan and image, in order of delivery
  /// Told of every infrared frame delivered, how it was taken and its mean grey value; may be
  /// empty.
  std::function<void(const InfraredShot& shot, const StereoImage& images, double mean_grey)>
      on_images;
};

/// What a device is made from, beside its own parameters.
struct DeviceContext {
  std::string name;  ///< empty: the only one of its kind, and the first
  const worlds::World& world;
  const Scene& scene;
  const Airframe& airframe;
  Pose X_BS;  ///< its true mount
  JobQueue& jobs;
  Outlets& outlets;
  std::uint64_t seed = 0;
  std::vector<FaultConfig> faults;  ///< of all devices; each looks for its own (FaultyLine)
};

/// A sensor on the vehicle: asked at every tick whether it measures, it hands its readings on when
/// they are due, and keeps a fingerprint of them. What is heavy goes through the job queue.
class Device {
 public:
  virtual ~Device() = default;

  /// @pre called once a tick, in the order of time
  virtual void fire(const Moment& moment) = 0;
  /// Of all that it delivered.
  [[nodiscard]] const Fingerprint& fingerprint() const { return fingerprint_; }
  /// Whether it delivered anything.
  [[nodiscard]] bool delivered() const { return delivered_; }
  /// Measurements tried in what it delivered, and those of them that returned nothing; 0 of what
  /// counts none.
  [[nodiscard]] std::int64_t firings() const { return firings_; }
  [[nodiscard]] std::int64_t misses() const { return misses_; }

 protected:
  void note(std::uint64_t hash) {
    fingerprint_.add(hash);
    delivered_ = true;
  }

  Fingerprint fingerprint_;
  bool delivered_ = false;
  std::int64_t firings_ = 0, misses_ = 0;
};

}  // namespace arex::sim
