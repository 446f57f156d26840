#include "scoring/thin_branches.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "math/random.h"
#include "worlds/mesh_builder.h"

namespace arex::sim {
namespace {

using worlds::MeshBuilder;
using worlds::SurfaceClass;
using worlds::World;

constexpr double kThick = 0.01;  // radius of the branches here, m
constexpr StoppingModel kStopping{0.3, 3.0, 0.12};

/// A local grid of 20 x 8 x 3 m at 0.1 m whose cells a test sets.
class Grid {
 public:
  Grid() : cells_(static_cast<std::size_t>(size_.prod()), GridView::kKnown) {}
  [[nodiscard]] GridView view() const { return {cells_.data(), Vec3(-1, -4, 0), 0.1, size_}; }
  void set(const Vec3& p, bool occupied) {
    const auto flags = GridView::kKnown | (occupied ? GridView::kOccupied : 0);
    cells_[view().index(view().cell_of(p))] = static_cast<std::uint8_t>(flags);
  }

 private:
  Eigen::Vector3i size_{200, 80, 30};
  std::vector<std::uint8_t> cells_;
};

World world_with(const std::vector<std::pair<Vec3, Vec3>>& branches, double radius = kThick) {
  MeshBuilder builder;
  const auto object = builder.add_object(SurfaceClass::kBranch, 0.3);
  for (const auto& [a, b] : branches) builder.add_collision_capsule(object, a, b, radius);
  return builder.finish();
}

Truth at(double x, double speed) {
  Truth truth;
  truth.X_WB.p = {x, 0, 1.5};
  truth.v_WB = {speed, 0, 0};
  return truth;
}

/// Flies along x past one upright branch at (10, aside), whose cell becomes occupied when the
/// vehicle is at `seen_x` and is cleared again at `lost_x`.
ThinBranchScore pass(double aside, double speed, double seen_x, double lost_x) {
  const Vec3 foot(10, aside, 1.2), tip(10, aside, 1.8);
  ThinBranchMeter meter({}, world_with({{foot, tip}}), kStopping);
  Grid grid;
  for (double x = 0; x < 14; x += 0.02) {
    for (double z = 1.25; z < 1.8; z += 0.1) {
      grid.set({10.02, aside + 0.02, z}, x >= seen_x && x < lost_x);
    }
    meter.observe(at(x, speed), at(x, speed).X_WB, grid.view());
  }
  return meter.score();
}

TEST(ThinBranchMeter, TheDeadlineIsTheStoppingDistanceOrTheClosestApproach) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RandomStream random(seed, "passes");
    int in_time = 0, late = 0, far = 0;
    for (int i = 0; i < 60; ++i) {
      const double aside = random.uniform(-1.3, 1.3), speed = random.uniform(0.2, 2.0);
      const double seen_x = random.uniform(6.5, 11.5);
      // Of the points the one at flight height comes nearest; closed form for a straight line.
      const double stopping = kStopping.radius_m + speed * kStopping.reaction_s +
                              speed * speed / (2 * kStopping.braking_mps2) + kThick;
      const double before =
          stopping > std::abs(aside) ? std::sqrt(stopping * stopping - aside * aside) : 0.0;
      const double deadline_x = 10 - before;
      if (std::abs(seen_x - deadline_x) < 0.1) continue;  // the step, and points beside the height
      if (std::abs(std::abs(aside) - kThick - 1.0) < 0.01) continue;
      const ThinBranchScore score = pass(aside, speed, seen_x, 100);
      const bool near = std::abs(aside) - kThick < 1.0;
      EXPECT_EQ(score.branches, near);
      EXPECT_EQ(score.seen_in_time, near && seen_x < deadline_x) << aside << " " << speed;
      EXPECT_EQ(score.in_grid, score.seen_in_time);
      (near ? (score.seen_in_time > 0 ? in_time : late) : far) += 1;
    }
    EXPECT_GT(in_time, 5);
    EXPECT_GT(late, 5);
    EXPECT_GT(far, 3);
  }
}

TEST(ThinBranchMeter, TellsWhatWasSeenAndLostAgain) {
  const ThinBranchScore score = pass(0.5, 1.5, 7.0, 8.0);
  EXPECT_EQ(score.seen_in_time, 1);
  EXPECT_EQ(score.in_grid, 0);
  EXPECT_EQ(pass(0.5, 1.5, 2.0, 5.0).seen_in_time, 0);  // too far off to count
}

TEST(ThinBranchMeter, TakesBranchesToTheGridThroughTheVehicle) {
  const Vec3 foot(10, 0.5, 1.2), tip(10, 0.5, 1.8);
  const Pose X_OW(so3::from_yaw(0.4), {-4, -2, 0.1});  // drift, and a great deal of it
  ThinBranchMeter meter({}, world_with({{foot, tip}}), kStopping);
  Grid grid;
  for (double z = 1.2; z < 1.8; z += 0.05) grid.set(X_OW * Vec3(10, 0.5, z), true);
  for (double x = 6; x < 12; x += 0.02)
    meter.observe(at(x, 1.0), X_OW * at(x, 1.0).X_WB, grid.view());
  EXPECT_EQ(meter.score().branches, 1);
  EXPECT_EQ(meter.score().seen_in_time, 1);
}

TEST(ThinBranchMeter, CountsChainsOnceAndLeavesOutWhatIsThickOrBesideIt) {
  // Two pieces end to end are one branch, the third begins elsewhere.
  const World two = world_with({{{10, 0.5, 1.0}, {10, 0.5, 1.5}},
                                {{10, 0.5, 1.5}, {10, 0.6, 2.0}},
                                {{11, 0.5, 1.0}, {11, 0.5, 2.0}}});
  ThinBranchMeter meter({}, two, kStopping);
  const Grid grid;
  for (double x = 6; x < 14; x += 0.02) meter.observe(at(x, 1.0), at(x, 1.0).X_WB, grid.view());
  EXPECT_EQ(meter.score().branches, 2);
  EXPECT_EQ(meter.score().seen_in_time, 0);

  EXPECT_TRUE(ThinBranchMeter({}, world_with({{{10, 0, 1}, {10, 0, 2}}}, 0.05), kStopping).empty());

  MeshBuilder builder;
  const auto trunk = builder.add_object(SurfaceClass::kTrunk, 0.3);
  const auto branch = builder.add_object(SurfaceClass::kBranch, 0.3);
  builder.add_collision_capsule(trunk, {10, 0, 0}, {10, 0, 3}, 0.1);
  builder.add_collision_capsule(branch, {10, 0, 1.5}, {10.4, 0, 1.5}, kThick);
  EXPECT_TRUE(ThinBranchMeter({}, builder.finish(), kStopping).empty());
}

}  // namespace
}  // namespace arex::sim
