#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "messages/estimates.h"
#include "messages/odometry_need.h"
#include "messages/registered_scan.h"
#include "messages/sensors.h"
#include "messages/stereo_image.h"
#include "messages/visual_tracks.h"

namespace arex {

/// One estimator of the vehicle's pose and velocity. One of a stack's sources flies it, others may
/// run beside.
///
/// All calls come from the flight's thread, in the order of time. What is heavy is returned as a
/// job: it runs on any thread, one after the other, beside calls of add_imu(); what it returns in
/// turn, its delivery, is called on the flight's thread when the modelled latency is over.
class OdometrySource {
 public:
  using Delivery = std::function<void()>;
  using Job = std::function<Delivery()>;

  virtual ~OdometrySource() = default;

  /// @pre the stamp is later than those before.
  virtual void add_imu(const ImuSample& imu) = 0;
  virtual std::optional<Job> add_scan(const LidarScanPtr& /*scan*/) { return std::nullopt; }
  virtual std::optional<Job> add_images(const StereoImagePtr& /*images*/) { return std::nullopt; }
  virtual void add_mocap(const MocapSample& /*mocap*/) {}
  /// Where another source has the vehicle, in this one's O: where to look for itself when it is
  /// lost.
  virtual void suggest(const Odometry& /*odometry*/) {}

  /// The newest estimate, 200 Hz; kInitialising before the first.
  [[nodiscard]] virtual const Odometry& odometry() const = 0;
  /// What keeps it from being ok.
  [[nodiscard]] virtual OdometryNeed need() const = 0;
  /// What it has found to be wrong with its sensors since the last call, for events.
  virtual std::vector<std::string> take_faults() { return {}; }
  /// Scans placed since the last call, for the maps.
  virtual std::vector<RegisteredScan> take_scans() { return {}; }
  /// Whether it does that; if not, they are placed by its poses.
  [[nodiscard]] virtual bool places_scans() const { return true; }
  /// What a visual odometry has done so far; nothing of any other.
  [[nodiscard]] virtual std::optional<VisualTally> visual_tally() const { return std::nullopt; }
  /// Features of the newest exposure, if that has come since the last call.
  virtual std::vector<FeatureSight> take_features() { return {}; }
};

}  // namespace arex
