#include "mapping/local_grid.h"

#include <gtest/gtest.h>

#include <map>

#include "config/config.h"
#include "mapping/mapper.h"
#include "voxel_oracle.h"

namespace arex {
namespace {

using namespace arex::test;
using Kind = LocalGrid::FrameKind;

constexpr double kResolution = 0.1;
constexpr Stamp kFrame = kNanosecondsPerSecond / 10;

LocalGridConfig small_grid() {
  LocalGridConfig config;
  config.size_m = {6, 5, 2};
  config.decay_per_s = 0;
  return config;
}

/// The rules of the grid on plain sets and maps.
class GridOracle {
 public:
  GridOracle(const LocalGridConfig& config) : config_(config) {}

  void recentre(const CellBox& box) {
    box_ = box;
    const auto gone = [&](const Voxel& v) { return !box.contains({v[0], v[1], v[2]}); };
    std::erase_if(evidence_, [&](const auto& entry) { return gone(entry.first); });
    std::erase_if(confirmed_, gone);
    for (auto& frame : lidar_) std::erase_if(frame, gone);
    std::erase_if(depth_, gone);
  }
  void add(const VoxelSets& frame, Kind kind) {
    if (kind == Kind::kDepth) {
      depth_ = frame.hit;
    } else {
      lidar_.push_back(frame.hit);
      if (static_cast<int>(lidar_.size()) > config_.lidar_frames) lidar_.erase(lidar_.begin());
    }
    for (const Voxel& v : frame.passed) {
      evidence_[v] = std::max(evidence_[v] - 11, -54);
      if (evidence_[v] < 0) confirmed_.erase(v);
    }
    for (const Voxel& v : frame.hit) {
      evidence_[v] = std::min(evidence_[v] + 23, 94);
      if (config_.remember && count(v) >= config_.confirm_frames) confirmed_.insert(v);
    }
  }
  [[nodiscard]] int count(const Voxel& v) const {
    int n = static_cast<int>(depth_.count(v));
    for (const auto& frame : lidar_) n += static_cast<int>(frame.count(v));
    return n;
  }
  [[nodiscard]] bool occupied(const Voxel& v) const {
    return count(v) > 0 || (confirmed_.contains(v) && evidence_.at(v) >= 0);
  }
  [[nodiscard]] bool known(const Voxel& v) const {
    const auto e = evidence_.find(v);
    return occupied(v) || (e != evidence_.end() && e->second < 0);
  }

 private:
  LocalGridConfig config_;
  CellBox box_;
  std::map<Voxel, int> evidence_;
  std::set<Voxel> confirmed_;
  std::vector<std::set<Voxel>> lidar_;
  std::set<Voxel> depth_;
};

void expect_equal(const GridSnapshot& snapshot, const GridOracle& oracle, const CellBox& box) {
  const GridView& view = snapshot.view;
  ASSERT_EQ(view.size, box.size());
  int wrong = 0, occupied = 0, known = 0;
  for (int h = 0; h < view.size.z(); ++h) {
    for (int w = 0; w < view.size.x(); ++w) {
      for (int l = 0; l < view.size.y(); ++l) {
        const Voxel v{box.low.x() + w, box.low.y() + l, box.low.z() + h};
        // The paper's index.
        const std::uint8_t flags = view.cells[(h * view.size.x() + w) * view.size.y() + l];
        EXPECT_EQ(flags, view.cells[view.index({w, l, h})]);
        wrong += ((flags & GridView::kOccupied) != 0) != oracle.occupied(v);
        wrong += ((flags & GridView::kKnown) != 0) != oracle.known(v);
        occupied += oracle.occupied(v);
        known += oracle.known(v);
      }
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(occupied, 5);
  EXPECT_GT(known, 1000);
}

TEST(LocalGrid, AgreesWithBruteForceWhileItRolls) {
  for (const int frames : {1, 3, 5}) {
    for (const bool remember : {true, false}) {
      std::mt19937_64 random(static_cast<unsigned>(7 * frames + remember));
      LocalGridConfig config = small_grid();
      config.lidar_frames = frames;
      config.remember = remember;
      LocalGrid grid(config, 0.3, kResolution);
      GridOracle oracle(config);
      RayCaster rays(kResolution);
      Vec3 at(0.31, -0.22, 1.17);
      for (int k = 0; k < 14; ++k) {
        // Steps in all directions, a jump by half the box, one out of it.
        at += k == 6 ? Vec3(3.0, -2.1, 0.4) : k == 10 ? Vec3(0, 40, 0) : Vec3(0.23, -0.31, 0.08);
        grid.recentre(at);
        oracle.recentre(grid.box());
        RegisteredScan scan =
            scan_room(at, k < 10 ? Vec3(1, -1, 1) : Vec3(1, 39, 1), {4, 4, 1.5}, 400, random);
        const CellBox box = grid.box();
        cast_frame(scan, 20, {}, box, rays);
        const Kind kind = k % 4 == 3 ? Kind::kDepth : Kind::kLidar;
        grid.add_frame(rays, kind, k * kFrame);
        oracle.add(
            cast_brute_force(rays_of(scan, 20, VehicleConfig{}.own_returns_m()), kResolution, box),
            kind);
        if (k % 3 == 1) expect_equal(*grid.snapshot(), oracle, box);
      }
    }
  }
}

/// One ray along x from the box's middle.
void cast_along_x(RayCaster& rays, const LocalGrid& grid, double to_x, bool hit) {
  rays.begin(Vec3::Zero(), grid.box());
  rays.add({0.05, 0.05, 0.05}, {to_x, 0.05, 0.05}, hit);
  rays.finish();
}

TEST(LocalGrid, ForgetsAGhostWithItsFramesAndKeepsAThinBranch) {
  LocalGrid grid(small_grid(), 0, kResolution);
  grid.recentre(Vec3(0.05, 0.05, 0.05));
  RayCaster rays(kResolution);
  const Vec3 ghost(1.05, 0.05, 0.05), branch(2.05, 0.05, 0.05);
  cast_along_x(rays, grid, ghost.x(), true);
  grid.add_frame(rays, Kind::kLidar, kFrame);
  for (int k = 2; k <= 12; ++k) {
    cast_along_x(rays, grid, k % 3 == 0 ? branch.x() : 2.5, k % 3 == 0);
    grid.add_frame(rays, Kind::kLidar, k * kFrame);
    const auto now = grid.snapshot();
    EXPECT_EQ((now->view.at(ghost) & GridView::kOccupied) != 0, k <= 5) << k;
    EXPECT_TRUE(now->view.known(ghost));
    // Hit in a third of the frames only, passed in the others.
    EXPECT_EQ((now->view.at(branch) & GridView::kOccupied) != 0, k >= 3) << k;
  }
}

TEST(LocalGrid, OneFrameWithoutDepthIsThePapersSparseMap) {
  LocalGridConfig config = small_grid();
  config.lidar_frames = 1;
  LocalGrid grid(config, 0, kResolution);
  grid.recentre(Vec3(0, 0, 1));
  RayCaster rays(kResolution);
  std::mt19937_64 random(5);
  for (int k = 0; k < 6; ++k) {
    const RegisteredScan scan = scan_room({0, 0, 1}, {0, 0, 1}, {2.5, 2.2, 0.8}, 300, random);
    cast_frame(scan, 20, {}, grid.box(), rays);
    grid.add_frame(rays, Kind::kLidar, k * kFrame);
    std::set<Voxel> points, obstacles;
    for (const Vec3f& p : *scan.points_O) {
      if ((p.cast<double>() - scan.p_OB).norm() < VehicleConfig{}.own_returns_m()) continue;
      points.insert(voxel_of(p.cast<double>(), kResolution));
    }
    const auto now = grid.snapshot();
    for (const Voxel& v : points) {
      const Vec3 p = kResolution * Vec3(v[0] + 0.5, v[1] + 0.5, v[2] + 0.5);
      EXPECT_NE(now->view.at(p) & GridView::kOccupied, 0);
    }
    std::size_t occupied = 0;
    for (const std::uint8_t flags : now->cells) occupied += flags & GridView::kOccupied;
    EXPECT_EQ(occupied, points.size());
  }
}

TEST(LocalGrid, ForgetsWhatIsNoLongerSeen) {
  LocalGridConfig config = small_grid();
  config.decay_per_s = 0.2;  // 5 units a second
  LocalGrid grid(config, 0, kResolution);
  grid.recentre(Vec3(0.05, 0.05, 0.05));
  RayCaster rays(kResolution);
  for (int k = 1; k <= 5; ++k) {
    cast_along_x(rays, grid, 1.05, true);
    grid.add_frame(rays, Kind::kLidar, k * kFrame);
  }
  const Vec3 wall(1.05, 0.05, 0.05), free(0.5, 0.05, 0.05);
  rays.begin(Vec3::Zero(), grid.box());
  rays.finish();
  // 94 units of evidence for the wall last 19 s, 54 against an obstacle 11 s.
  for (int k = 6; k <= 220; ++k) {
    grid.add_frame(rays, Kind::kLidar, k * kFrame);
    if (k == 100) {
      EXPECT_TRUE(grid.snapshot()->view.known(free));
    }
    if (k == 125) {
      EXPECT_FALSE(grid.snapshot()->view.known(free));
    }
    if (k == 175) {
      EXPECT_NE(grid.snapshot()->view.at(wall) & GridView::kOccupied, 0);
    }
  }
  EXPECT_EQ(grid.snapshot()->view.at(wall), 0);
}

TEST(LocalGrid, SnapshotsStayAsTheyAreAndBuffersAreUsedAgain) {
  LocalGrid grid(small_grid(), 0.2, kResolution);
  RayCaster rays(kResolution);
  std::mt19937_64 random(2);
  const auto feed = [&](int k) {
    const Vec3 at(0.2 * k, 0.1 * k, 1);
    grid.recentre(at);
    cast_frame(scan_room(at, at, {2.5, 2.2, 0.8}, 300, random), 20, {}, grid.box(), rays);
    grid.add_frame(rays, Kind::kLidar, k * kFrame);
  };
  feed(0);
  const auto held = grid.snapshot();
  const std::vector<std::uint8_t> copy = held->cells;
  const std::uint8_t* const buffer = grid.snapshot()->view.cells;
  EXPECT_NE(buffer, held->view.cells);
  for (int k = 1; k < 8; ++k) {
    feed(k);
    const auto now = grid.snapshot();
    EXPECT_EQ(now->stamp, k * kFrame);
    EXPECT_EQ(now->view.cells, buffer);
    EXPECT_EQ(now->view.cells, now->cells.data());
    EXPECT_NE(now->cells, copy);
  }
  EXPECT_EQ(held->cells, copy);
  EXPECT_EQ(held->stamp, 0);
}

TEST(LocalGrid, ClearLeavesNothing) {
  LocalGrid grid(small_grid(), 0.2, kResolution);
  grid.recentre(Vec3(0.05, 0.05, 0.05));
  RayCaster rays(kResolution);
  cast_along_x(rays, grid, 1.05, true);
  for (int k = 0; k < 3; ++k) grid.add_frame(rays, Kind::kLidar, k * kFrame);
  grid.clear();
  const auto now = grid.snapshot();
  EXPECT_EQ(std::count(now->cells.begin(), now->cells.end(), 0),
            static_cast<std::ptrdiff_t>(now->cells.size()));
  grid.add_frame(rays, Kind::kLidar, 3 * kFrame);
  EXPECT_NE(grid.snapshot()->view.at({1.05, 0.05, 0.05}) & GridView::kOccupied, 0);
}

/// Offsets by which one obstacle grows.
std::set<Voxel> offsets_of(double lambda_m, InflationShape shape) {
  Inflation inflation(lambda_m, kResolution, shape);
  BitGrid occupied(41, 43, 150);
  BitGrid inflated = occupied;
  occupied.row(21, 20)[1] = 1;  // h 21, w 20, l 64: at a word's edge
  inflation.apply(occupied, inflated);
  std::set<Voxel> offsets;
  for (int h = 0; h < 43; ++h) {
    for (int w = 0; w < 41; ++w) {
      for (int l = 0; l < 150; ++l) {
        if ((inflated.row(h, w)[l / 64] >> (l % 64) & 1U) != 0) {
          offsets.insert({w - 20, l - 64, h - 21});
        }
      }
    }
  }
  return offsets;
}

TEST(Inflation, HasThePapersOffsetsAndTheSpheres) {
  for (const double lambda : {0.0, 0.1, 0.25, 0.3, 0.5, 0.6, 0.7, 0.75, 1.1}) {
    std::set<Voxel> cube, sphere, octant;
    const int n = static_cast<int>(std::ceil(lambda / kResolution - 1e-9));
    // The paper's points P - lambda + size * (a, b, c), with a, b, c in 0..2n: for a lambda on the
    // grid the cells -n..n about the point's own.
    for (int a = 0; a <= 2 * n; ++a) {
      for (int b = 0; b <= 2 * n; ++b) {
        for (int c = 0; c <= 2 * n; ++c) {
          cube.insert({a - n, b - n, c - n});
          if (std::max({a, b, c}) <= n) octant.insert({a - n, b - n, c - n});  // as printed
        }
      }
    }
    for (const Voxel& v : cube) {
      const double r = kResolution * std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
      if (r <= lambda + 1e-6) sphere.insert(v);
    }
    EXPECT_EQ(offsets_of(lambda, InflationShape::kCubic), cube) << lambda;
    EXPECT_EQ(offsets_of(lambda, InflationShape::kPrinted), octant) << lambda;
    EXPECT_EQ(offsets_of(lambda, InflationShape::kSpherical), sphere) << lambda;
  }
}

TEST(Inflation, AgreesWithBruteForceOnRandomGrids) {
  for (const int length : {64, 100, 127, 130}) {
    for (const InflationShape shape :
         {InflationShape::kCubic, InflationShape::kSpherical, InflationShape::kPrinted}) {
      std::mt19937_64 random(static_cast<unsigned>(length));
      const double lambda = shape == InflationShape::kSpherical ? 0.5 : 0.4;
      BitGrid occupied(23, 9, length);
      BitGrid inflated = occupied;
      std::vector<Voxel> obstacles;
      for (int k = 0; k < 40; ++k) {
        const Voxel v{static_cast<int>(random() % 23), static_cast<int>(random()) % length,
                      static_cast<int>(random() % 9)};
        if (v[1] < 0) continue;
        obstacles.push_back(v);
        occupied.row(v[2], v[0])[v[1] / 64] |= std::uint64_t{1} << (v[1] % 64);
      }
      Inflation(lambda, kResolution, shape).apply(occupied, inflated);
      const std::set<Voxel> offsets = offsets_of(lambda, shape);
      std::set<Voxel> expected, got;
      for (const Voxel& v : obstacles) {
        for (const Voxel& o : offsets) {
          const Voxel at{v[0] + o[0], v[1] + o[1], v[2] + o[2]};
          if (at[0] >= 0 && at[1] >= 0 && at[2] >= 0 && at[0] < 23 && at[1] < length && at[2] < 9) {
            expected.insert(at);
          }
        }
      }
      for (int h = 0; h < 9; ++h) {
        for (int w = 0; w < 23; ++w) {
          for (int l = 0; l < length; ++l) {
            if ((inflated.row(h, w)[l / 64] >> (l % 64) & 1U) != 0) got.insert({w, l, h});
          }
        }
      }
      EXPECT_EQ(got, expected);
    }
  }
}

TEST(LocalGrid, InflatesItsObstacles) {
  LocalGrid grid(small_grid(), 0.3, kResolution);
  grid.recentre(Vec3(0.77, 0.33, 0.05));
  RayCaster rays(kResolution);
  cast_along_x(rays, grid, 1.05, true);
  grid.add_frame(rays, Kind::kLidar, 0);
  const auto now = grid.snapshot();
  const Vec3 wall(1.05, 0.05, 0.05);
  std::size_t inflated = 0;
  for (const std::uint8_t flags : now->cells) inflated += (flags & GridView::kInflated) != 0;
  EXPECT_EQ(inflated, 343U);
  EXPECT_TRUE(now->view.inflated(wall + Vec3(0.3, -0.3, 0.3)));
  EXPECT_FALSE(now->view.inflated(wall + Vec3(0.4, 0, 0)));
}

TEST(Mapper, IsDeterministicAndLeavesOutDepthOnRequest) {
  LocalGridConfig local = small_grid();
  GlobalMapConfig global;
  global.low_m = {-6, -6, -1};
  global.high_m = {6, 6, 3};
  auto image = std::make_shared<DepthImage>();
  image->camera = {64, 48, 40, 40, 31.5, 23.5};
  image->depth_m.assign(64 * 48, 1.5F);
  const auto run = [&](bool use_depth) {
    local.use_depth = use_depth;
    Mapper mapper(local, global, kResolution, 0.2, {});
    std::mt19937_64 random(9);
    for (int k = 0; k < 5; ++k) {
      const Vec3 at(0.1 * k, 0, 1);
      mapper.integrate(scan_room(at, {0, 0, 1}, {5, 5, 1.5}, 500, random));
      mapper.integrate(RegisteredDepth{Pose{Mat3::Identity(), at} * VehicleConfig{}.X_BC(), image});
    }
    return std::pair(mapper.snapshot()->cells, mapper.occupancy_2d().cells);
  };
  EXPECT_EQ(run(true), run(true));
  EXPECT_NE(run(true).first, run(false).first);
  EXPECT_EQ(run(true).second, run(false).second);
}

TEST(MappingConfig, ListsItsParameters) {
  EXPECT_GE(list_parameters(LocalGridConfig{}).size(), 15U);
  EXPECT_GE(list_parameters(GlobalMapConfig{}).size(), 10U);
  LocalGridConfig config;
  EXPECT_THROW(read_config(parse_yaml("lidar_frames: 11", "x"), config), ConfigError);
}

TEST(LocalGrid, BarsWhatLiesAboveTheCeilingAndBelowTheFloor) {
  LocalGrid grid(small_grid(), 0.3, kResolution);
  grid.bar_outside(0.5, 1.8);
  for (const double z : {0.2, 1.5, 3.0}) {
    grid.recentre({0, 0, z});
    const auto snapshot = grid.snapshot();
    const GridView& view = snapshot->view;
    for (int h = 0; h < view.size.z(); ++h) {
      const Vec3 centre = view.centre_of({3, 4, h});
      const bool inside = centre.z() > 0.5 && centre.z() < 1.8;
      const std::uint8_t flags = view.cells[view.index({3, 4, h})];
      EXPECT_EQ(flags, inside ? 0 : GridView::kInflated | GridView::kBarred) << centre.z();
    }
  }
}

}  // namespace
}  // namespace arex
