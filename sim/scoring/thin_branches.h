#pragma once

#include <cstdint>
#include <vector>

#include "mapping/grid_view.h"
#include "math/pose.h"
#include "physics/truth.h"
#include "scoring/figures.h"
#include "worlds/world.h"

namespace arex::sim {

struct ThinBranchConfig {
  double max_diameter_m = 0.03;  ///< a resolution of 0.2 deg misses that at 9 m
  double corridor_m = 1.0;       ///< the paper's widest inflation (0.75 m) and a little
  double look_m = 4.0;           ///< what is seen from further off and lost again is no warning
  double match_m = 0.15;         ///< a cell, and half of one for noise
  double apart_m = 0.35;         ///< twice that and a cell: so that no trunk is taken for a branch

  void fields(auto& f) {
    f("max_diameter_m", max_diameter_m, "branches that are nowhere thicker count as thin");
    f("corridor_m", corridor_m, "from the vehicle's centre: branches that came nearer count");
    f("look_m", look_m, "range within which a branch may be seen");
    f("match_m", match_m, "greatest distance from a branch to the occupied cell that shows it");
    f("apart_m", apart_m, "least distance of the points of a branch from anything thicker");
    f.check(max_diameter_m > 0, "max_diameter_m > 0");
    f.check(corridor_m > 0 && corridor_m <= look_m, "0 < corridor_m <= look_m");
    f.check(match_m > 0 && match_m < apart_m, "0 < match_m < apart_m");
  }
};

/// How the vehicle stops: the distance between its centre and a surface that it can still avoid is
/// radius + speed * reaction + speed^2 / (2 braking).
struct StoppingModel {
  double radius_m = 0;
  double braking_mps2 = 1;
  double reaction_s = 0;
};

struct ThinBranchScore {
  int branches = 0;      ///< that came into the corridor
  int seen_in_time = 0;  ///< an occupied cell showed them at some moment up to their deadline
  int in_grid = 0;       ///< and still at that deadline: what the planner has to brake by
};

/// Sets the figures `thin.*`.
void add_figures(const ThinBranchScore& score, Figures& figures);

/// Were the thin branches beside the flight in the local grid before it was too late?
///
/// A branch is a chain of the world's collision capsules, nowhere thicker than a limit. It is
/// represented by points along its axis that are clear of anything thicker, and judged by the
/// point to which the vehicle came nearest, if that was within the corridor:
///  - the point's deadline is when the vehicle, approaching, first came within its stopping
///    distance at the speed of that moment, or else the closest approach (it flew too slowly, or
///    too far off, to be in danger);
///  - the point is seen when a cell that touches the ball of radius match_m around it is occupied
///    in the newest grid while the vehicle is within look_m. The grid is in O as the stack believes
///    it: the point is taken there through the vehicle, true pose here, estimated pose there, so
///    that the odometry's drift is not held against the perception.
/// A branch counts once, however often it is passed.
class ThinBranchMeter {
 public:
  ThinBranchMeter(const ThinBranchConfig& config, const worlds::World& world,
                  const StoppingModel& stopping);

  /// Whether the world has no such branch.
  [[nodiscard]] bool empty() const { return points_.empty(); }

  /// In time order, several times a second. @param grid the newest local grid, in O
  void observe(const Truth& truth, const Pose& X_OB, const GridView& grid);

  [[nodiscard]] ThinBranchScore score() const;

 private:
  struct Point {
    Vec3 p_W;
    double radius_m = 0;
    int branch = 0;
    double closest_m = 0;  ///< so far, from the vehicle's centre to the branch's surface
    bool seen = false;
    bool decided = false;  ///< the vehicle came within its stopping distance
    bool seen_in_time = false;
    bool in_grid = false;
  };
  void observe(Point& point, double distance_m, double stopping_m, bool in_grid) const;

  ThinBranchConfig config_;
  StoppingModel stopping_;
  std::vector<Point> points_;  ///< branch by branch
};

}  // namespace arex::sim
