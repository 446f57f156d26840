#pragma once

#include <memory>
#include <vector>

#include "bag/bag_writer.h"
#include "physics/airframe.h"
#include "stack/flight_software.h"

namespace arex::sim {

/// Tells a bag what the flight software makes of what it senses, as often as people look at it:
/// maps, paths and markers (DisplayWriter). Only listens: a flight does not depend on it.
class FlightDisplay {
 public:
  /// Both outlive the flight. Writes what the vehicle looks like.
  FlightDisplay(BagWriter& bag, FlightSoftware& software, const Airframe& airframe);

  void event(const Event& event) { writer_.event(event); }
  void decision(const Decision& decision);
  /// After each tick.
  void update(Stamp now);

 private:
  void show_way(Stamp now, const FlightView& view);
  void show_maps(Stamp now, const FlightView& view);
  void show_targets(Stamp now, const FlightView& view);
  void show_cloud(Stamp now);

  DisplayWriter& writer_;
  FlightSoftware& software_;
  std::vector<PathPose> path_;
  std::size_t path_shown_ = 0;  ///< poses of it
  bool plan_shown_ = false;     ///< there is one on display
  std::shared_ptr<const OccupancyMap2D> map_;
  std::shared_ptr<const GridSnapshot> grid_;
  std::size_t targets_ = 0;
  Vec3 goal_O_ = Vec3::Zero();
  bool goal_shown_ = false;
  std::size_t cloud_points_ = 0;  ///< of the cloud on display; in jobs of the cloud's lane
  Stamp cloud_stamp_ = 0;         ///< likewise
};

}  // namespace arex::sim
