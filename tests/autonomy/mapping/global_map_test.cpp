#include "mapping/global_map.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include "files/files.h"
#include "mapping/frame_rays.h"
#include "mapping/map_files.h"
#include "support/temporary_folder.h"
#include "voxel_oracle.h"

namespace arex {
namespace {

using namespace arex::test;

constexpr double kResolution = 0.1;

GlobalMapConfig room_config() {
  GlobalMapConfig config;
  config.band = BandReference::kGround;  // nobody flies here whose way a floor could go on from
  config.low_m = {-9.3, -7.7, -2.1};
  config.high_m = {10.1, 8.4, 4.6};
  config.range_m = 8;
  return config;
}

/// The frames of a walk through a room that is larger than the bounds.
std::vector<RegisteredScan> walk(unsigned seed, int frames, int points) {
  std::mt19937_64 random(seed);
  std::vector<RegisteredScan> scans;
  for (int k = 0; k < frames; ++k) {
    const Vec3 at(-3 + 0.63 * k, 1.4 - 0.4 * k, 1.02);
    scans.push_back(scan_room(at, {0, 0, 1}, {9.77, 8.03, 2.52}, points, random));
  }
  return scans;
}

Voxel to_voxel(const octomap::OcTreeKey& key) {
  return {key[0] - 32768, key[1] - 32768, key[2] - 32768};
}
octomap::OcTreeKey to_key(const Voxel& v) {
  const auto at = [](int c) { return static_cast<octomap::key_type>(c + 32768); };
  return {at(v[0]), at(v[1]), at(v[2])};
}
int state_in(const octomap::OcTree& tree, const Voxel& v) {
  const octomap::OcTreeNode* node = tree.search(to_key(v));
  return node == nullptr ? -1 : static_cast<int>(tree.isNodeOccupied(node));
}

template <class Visit>
void for_each_voxel(const CellBox& box, const Visit& visit) {
  for (int z = box.low.z(); z < box.high.z(); ++z) {
    for (int y = box.low.y(); y < box.high.y(); ++y) {
      for (int x = box.low.x(); x < box.high.x(); ++x) visit(Cell(x, y, z));
    }
  }
}

TEST(GlobalMap, HasOctoMapsStatesAfterTheSameHitsAndMisses) {
  const GlobalMapConfig config = room_config();
  const VehicleConfig vehicle;
  GlobalMap map(config, kResolution);
  octomap::OcTree oracle(kResolution);
  RayCaster rays(kResolution);
  for (const RegisteredScan& scan : walk(1, 9, 900)) {
    cast_frame(scan, config.range_m, vehicle, map.box(), rays);
    map.add_frame(rays);
    const VoxelSets sets = cast_brute_force(rays_of(scan, config.range_m, vehicle.own_returns_m()),
                                            kResolution, map.box());
    for (const Voxel& v : sets.passed) oracle.updateNode(to_key(v), false);
    for (const Voxel& v : sets.hit) oracle.updateNode(to_key(v), true);
  }
  int wrong = 0, free = 0, occupied = 0;
  const StateTree tree = map.octree();
  for_each_voxel({map.box().low.array() - 3, map.box().high.array() + 3}, [&](const Cell& c) {
    const int expected = state_in(oracle, {c.x(), c.y(), c.z()});
    const Vec3 p = kResolution * (c.cast<double>().array() + 0.5).matrix();
    wrong += map.state(c) != expected || tree.state(p) != expected;
    free += expected == 0;
    occupied += expected == 1;
  });
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(free, 50000);
  EXPECT_GT(occupied, 2000);
  EXPECT_NEAR(map.known_volume(), (free + occupied) * 1e-3, 1e-9);

  // The tree has the shape that OctoMap's own maximum-likelihood map has, and the same leaves.
  oracle.toMaxLikelihood();
  oracle.prune();
  EXPECT_EQ(tree.nodes(), oracle.size());
  TemporaryFolder folder;
  map.write_octomap(folder / "map.bt");
  octomap::OcTree read(0.5);
  ASSERT_TRUE(read.readBinary((folder / "map.bt").string()));
  EXPECT_DOUBLE_EQ(read.getResolution(), kResolution);
  EXPECT_EQ(read.size(), oracle.size());
  std::size_t leaves = 0;
  for (auto leaf = oracle.begin_leafs(); leaf != oracle.end_leafs(); ++leaf, ++leaves) {
    EXPECT_EQ(state_in(read, to_voxel(leaf.getKey())), oracle.isNodeOccupied(*leaf) ? 1 : 0);
  }
  EXPECT_EQ(leaves, read.getNumLeafNodes());
}

TEST(GlobalMap, AgreesWithInsertPointCloud) {
  const GlobalMapConfig config = room_config();
  for (unsigned seed = 1; seed <= 3; ++seed) {
    GlobalMap map(config, kResolution);
    octomap::OcTree oracle(kResolution);
    RayCaster rays(kResolution);
    for (const RegisteredScan& scan : walk(seed, 6, 700)) {
      VehicleConfig nobody;
      nobody.radius_m = 1e-6;
      cast_frame(scan, config.range_m, nobody, map.box(), rays);
      map.add_frame(rays);
      octomap::Pointcloud cloud;
      for (const Vec3f& p : *scan.points_O) cloud.push_back(p.x(), p.y(), p.z());
      const Vec3f origin = scan.origin_end_O.cast<float>();
      oracle.insertPointCloud(cloud, {origin.x(), origin.y(), origin.z()}, config.range_m, false,
                              false);
    }
    int known = 0, same = 0;
    for_each_voxel(map.box(), [&](const Cell& c) {
      const int expected = state_in(oracle, {c.x(), c.y(), c.z()});
      if (expected == -1 && map.state(c) == -1) return;
      ++known;
      same += map.state(c) == expected;
    });
    EXPECT_GT(known, 40000);
    EXPECT_GE(same, 0.995 * known);
  }
}

TEST(GlobalMap, IntegerLogOddsNeverEndInAnotherStateThanOctoMaps) {
  // Every pair of OctoMap's float and our integer that some chain of 150 hits and misses can reach.
  const octomap::OcTree tree(kResolution);
  const auto units = [](float odds) { return static_cast<int>(std::lround(odds * 4096)); };
  const float hit = tree.getProbHitLog(), miss = tree.getProbMissLog();
  const float low = tree.getClampingThresMinLog(), high = tree.getClampingThresMaxLog();
  std::set<std::pair<float, int>> seen{{0.0F, 0}};
  std::vector<std::pair<float, int>> front{{0.0F, 0}};
  for (int depth = 0; depth < 150; ++depth) {
    std::vector<std::pair<float, int>> next;
    for (const auto& [odds, integer] : front) {
      for (const float step : {hit, miss}) {
        const std::pair<float, int> to{std::clamp(odds + step, low, high),
                                       std::clamp(integer + units(step), units(low), units(high))};
        ASSERT_EQ(to.first >= 0, to.second >= 0) << odds << " " << integer;
        if (seen.insert(to).second) next.push_back(to);
      }
    }
    front = std::move(next);
  }
  EXPECT_GT(seen.size(), 10000U);
}

/// Rays straight down or along, that make a scene voxel by voxel.
class Painter {
 public:
  explicit Painter(GlobalMap& map) : map_(map), rays_(kResolution) {
    rays_.begin(Vec3(0, 0, 0), map.box());
  }
  void occupied(const Vec3& p) { rays_.add_point(p); }
  void free_between(const Vec3& from, const Vec3& to) { rays_.add(from, to, false); }
  void show() {
    rays_.finish();
    map_.add_frame(rays_);
  }

 private:
  GlobalMap& map_;
  RayCaster rays_;
};

GlobalMapConfig scene_config() {
  GlobalMapConfig config;
  config.band = BandReference::kGround;
  config.low_m = {-8, -8, -3};
  config.high_m = {8, 8, 5};
  return config;
}

/// A slope of 20 %, free air above it where x < 5.
void paint_ground(Painter& painter) {
  for (double x = -7.95; x < 8; x += 0.1) {
    for (double y = -7.95; y < 8; y += 0.1) {
      if (x > 5 && y > 5) continue;  // a corner that nobody saw
      const double z = 0.2 * x;
      painter.occupied({x, y, z});
      if (x < 5) painter.free_between({x, y, z + 3}, {x, y, z});
    }
  }
}

TEST(GlobalMap, StandsItsHeightBandOnTheGround) {
  GlobalMap map(scene_config(), kResolution);
  Painter painter(map);
  paint_ground(painter);
  for (double z = -0.4; z < 3; z += 0.1) painter.occupied({-2.05, 3.05, z});  // a trunk
  painter.occupied({0.05, 0.05, 0.25});   // a stone, below the band
  painter.occupied({1.05, -4.05, 3.0});   // a branch above the band
  painter.occupied({-4.05, -4.05, 0.6});  // a branch in it: 1.4 m above ground
  painter.occupied({-6.05, 5.05, -2.5});  // a ghost under the ground
  for (double z = 2.2; z < 3; z += 0.1) painter.occupied({6.85, 4.55, z});
  painter.show();
  const OccupancyMap2D& out = map.occupancy_2d();
  const auto at = [&](double x, double y) { return out.at(out.cell_of({x, y})); };
  EXPECT_EQ(at(-2.05, 3.05), OccupancyMap2D::kOccupied);
  EXPECT_EQ(at(0.05, 0.05), OccupancyMap2D::kFree);
  EXPECT_EQ(at(1.05, -4.05), OccupancyMap2D::kFree);
  EXPECT_EQ(at(-4.05, -4.05), OccupancyMap2D::kOccupied);
  EXPECT_EQ(at(-6.05, 5.05), OccupancyMap2D::kFree);
  EXPECT_EQ(at(6.85, 4.55), OccupancyMap2D::kOccupied);
  EXPECT_EQ(at(6.05, 0.05), OccupancyMap2D::kUnknown);  // ground seen, air above it not
  EXPECT_EQ(at(7.95, 7.95), OccupancyMap2D::kUnknown);
  int free = 0;
  for (const std::int8_t c : out.cells) free += c == OccupancyMap2D::kFree;
  EXPECT_NEAR(free, 130 * 160 - 2, 2);
}

TEST(GlobalMap, KnowsTheFloorUnderEachColumnAndWhatStandsOnIt) {
  for (const auto band : {BandReference::kGround, BandReference::kAbsolute}) {
    GlobalMapConfig config = scene_config();
    config.band = band;
    config.ground_max_slope = 0.03;
    GlobalMap map(config, kResolution);
    Painter painter(map);
    for (double x = -7.95; x < 6; x += 0.1) {
      for (double y = -7.95; y < 8; y += 0.1) {
        const bool car = x > -4 && x < -2 && y > 0 && y < 4;
        if (car) {
          painter.occupied({x, y, 0.85});
          painter.free_between({x, y, 3}, {x, y, 0.85});
          continue;
        }
        painter.free_between({x, y, 3}, {x, y, 0.05});
        if (x < 4) painter.occupied({x, y, 0.05});
      }
    }
    painter.occupied({0.05, 0.05, 0.35});   // on the floor, below the 2D map's band
    painter.occupied({1.05, -4.05, 2.45});  // hangs high
    painter.show();
    const OccupancyMap2D& out = map.occupancy_2d();
    const auto index = [&](double x, double y) { return out.index(out.cell_of({x, y})); };
    EXPECT_EQ(out.floor.top[index(-6.05, -3.05)], 0);
    EXPECT_EQ(out.floor.overhead[index(-6.05, -3.05)], FloorMap::kNothing);
    EXPECT_EQ(out.floor.top[index(5.05, 1.05)], FloorMap::kUnseen);  // air known, floor not seen
    EXPECT_EQ(out.floor.top[index(7.05, 1.05)], FloorMap::kUnknown);
    EXPECT_EQ(out.floor.overhead[index(-3.05, 2.05)], 8);
    EXPECT_EQ(out.floor.overhead[index(0.05, 0.05)], 3);
    EXPECT_EQ(out.floor.overhead[index(1.05, -4.05)], 24);
    EXPECT_EQ(out.floor.top[index(1.05, -4.05)], 0);
  }
}

TEST(GlobalMap, TakesTheNeighboursGroundUnderATrunkSeenAlone) {
  GlobalMap map(scene_config(), kResolution);
  Painter painter(map);
  for (double x = -7.95; x < 0; x += 0.1) {
    for (double y = -7.95; y < 8; y += 0.1) painter.occupied({x, y, 0.05});
  }
  // The trunk stands 0.4 m beyond the ground that was seen; its foot was not.
  for (double z = 1.2; z < 1.9; z += 0.1) painter.occupied({0.45, 0.05, z});
  painter.show();
  EXPECT_EQ(map.occupancy_2d().at(map.occupancy_2d().cell_of({0.45, 0.05})),
            OccupancyMap2D::kOccupied);
}

TEST(GlobalMap, CutsAnAbsoluteBandBetweenFloorAndCeiling) {
  GlobalMapConfig config = scene_config();
  config.low_m.z() = -11;
  config.high_m.z() = -4;
  config.band = BandReference::kAbsolute;
  config.band_low_m = -9.5;
  config.band_high_m = -7.5;
  GlobalMap map(config, kResolution);
  RayCaster rays(kResolution);
  std::mt19937_64 random(4);
  cast_frame(scan_room({0, 0, -8.5}, {0, 0, -8.5}, {4.03, 3.03, 1.53}, 60000, random, 0), 20, {},
             map.box(), rays);
  for (int k = 0; k < 4; ++k) map.add_frame(rays);
  const OccupancyMap2D& out = map.occupancy_2d();
  const auto at = [&](double x, double y) { return out.at(out.cell_of({x, y})); };
  EXPECT_EQ(at(1.05, 1.25), OccupancyMap2D::kFree);  // floor and ceiling do not count
  EXPECT_EQ(at(4.05, 0.05), OccupancyMap2D::kOccupied);
  EXPECT_EQ(at(0.55, -3.05), OccupancyMap2D::kOccupied);
  EXPECT_EQ(at(6, 6), OccupancyMap2D::kUnknown);
}

TEST(GlobalMap, FollowsATiltedFloorUnderACeiling) {
  // O tilted by 0.55 degrees in a hall of 3.5 m; its floor is seen from 12 m on only, the ceiling
  // everywhere, and a duct hangs down to 2.4 m.
  constexpr double kTilt = 0.0096;
  GlobalMapConfig config;
  config.low_m = {-20, -4, -11};
  config.high_m = {20, 4, -2};
  config.band = BandReference::kGround;
  config.band_low_m = 0.5;
  config.band_high_m = 2.0;
  config.ground_max_slope = 0.03;
  GlobalMap map(config, kResolution);
  Painter painter(map);
  const auto floor = [](double x) { return -8.45 + kTilt * x; };
  for (double x = -19.95; x < 20; x += 0.1) {
    for (double y = -3.95; y < 4; y += 0.1) {
      painter.free_between({x, y, floor(x) + 3.5}, {x, y, floor(x)});
      painter.occupied({x, y, floor(x) + 3.5});
      if (x > -8) painter.occupied({x, y, floor(x)});
      if (std::abs(x - 2) < 0.3) painter.occupied({x, y, floor(x) + 2.45});
    }
  }
  for (double z = 0; z < 1.4; z += 0.1)
    painter.occupied({12.05, 0.05, floor(12) + z});  // a bollard
  painter.show();
  const OccupancyMap2D& out = map.occupancy_2d();
  int free = 0, occupied = 0;
  for (const std::int8_t c : out.cells) {
    free += c == OccupancyMap2D::kFree;
    occupied += c == OccupancyMap2D::kOccupied;
  }
  EXPECT_EQ(occupied, 1);  // neither floor, nor ceiling, nor duct
  EXPECT_EQ(out.at(out.cell_of({12.05, 0.05})), OccupancyMap2D::kOccupied);
  EXPECT_EQ(free, 400 * 80 - 1);
  for (double x = -19.9; x < 20; x += 0.37) {
    // Within a layer and what a tile rises; before the first floor it may rise at the limit.
    const double unseen = std::max(0.0, -8 - x) * (config.ground_max_slope + kTilt);
    EXPECT_NEAR(out.ground.at({x, 1}), floor(x), 0.15 + unseen) << x;
  }
  EXPECT_TRUE(std::isnan(out.ground.at({-23.5, 0})));
}

/// A yard at 0, a ramp of 30 degrees from x = -4 down to a floor at -2.9, and a roof over all of
/// it.
double ramp_height(double x) { return 0.05 - std::clamp((x + 4) * std::tan(M_PI / 6), 0.0, 2.9); }

TEST(GlobalMap, StandsItsHeightBandOnARampColumnByColumn) {
  GlobalMapConfig config = scene_config();
  config.low_m.z() = -4;
  config.band = BandReference::kFloor;
  config.ground_max_slope = 0.7;
  GlobalMap map(config, kResolution);
  Painter painter(map);
  for (double x = -7.95; x < 8; x += 0.1) {
    for (double y = -7.95; y < 8; y += 0.1) {
      painter.free_between({x, y, ramp_height(x) + 2.9}, {x, y, ramp_height(x)});
      painter.occupied({x, y, ramp_height(x)});
      painter.occupied({x, y, ramp_height(x) + 2.9});
    }
  }
  for (double z = 0.1; z < 1; z += 0.1) painter.occupied({-1.05, 2.05, ramp_height(-1.05) + z});
  painter.occupied({-2.05, 3.05, ramp_height(-2.05) + 0.2});  // a kerb
  painter.show();
  EXPECT_EQ(map.occupancy_2d().at({10, 10}), OccupancyMap2D::kUnknown);  // nobody has stood there
  map.note_place({-7, 0, 1.5});
  const OccupancyMap2D& out = map.occupancy_2d();
  int free = 0, occupied = 0;
  for (const std::int8_t c : out.cells) {
    free += c == OccupancyMap2D::kFree;
    occupied += c == OccupancyMap2D::kOccupied;
  }
  EXPECT_EQ(occupied, 1);
  EXPECT_EQ(out.at(out.cell_of({-1.05, 2.05})), OccupancyMap2D::kOccupied);
  EXPECT_EQ(free, 160 * 160 - 1);
  for (double x = -7.9; x < 8; x += 0.13) {
    EXPECT_NEAR(out.ground.at({x, 1.01}), ramp_height(x) - 0.05, 0.16) << x;
  }
  const std::size_t on_ramp = out.index(out.cell_of({-1.05, -3.05}));
  EXPECT_NEAR(out.floor.top[on_ramp] * kResolution, ramp_height(-1.05) - 0.05, 0.11);
  EXPECT_NEAR(out.floor.overhead[on_ramp] * kResolution, ramp_height(-1.05) + 2.85, 0.11);
}

TEST(GlobalMap, RefreshesThe2DMapAsIfMadeAnew) {
  const GlobalMapConfig config = room_config();
  RayCaster rays(kResolution);
  GlobalMap map(config, kResolution);
  for (const RegisteredScan& scan : walk(4, 8, 800)) {
    cast_frame(scan, config.range_m, {}, map.box(), rays);
    map.add_frame(rays);
  }
  // Column by column from the voxels themselves, on the ground that was found.
  const OccupancyMap2D& out = map.occupancy_2d();
  int wrong = 0, decided = 0;
  for (int iy = 0; iy < out.height; ++iy) {
    for (int ix = 0; ix < out.width; ++ix) {
      const Cell column(map.box().low.x() + ix, map.box().low.y() + iy, 0);
      const double ground = out.ground.at(out.centre_of({ix, iy}));
      int full = 0, empty = 0;
      for (int dz = 4; dz < 20 && std::isfinite(ground); ++dz) {
        const int state = map.state(
            {column.x(), column.y(), static_cast<int>(std::lround(ground / kResolution)) + dz});
        full += state == 1;
        empty += state == 0;
      }
      const int expected = full > 0 ? 1 : empty >= config.min_free_cells ? 0 : -1;
      wrong += out.at({ix, iy}) != expected;
      decided += expected >= 0;
    }
  }
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(decided, 5000);
}

TEST(MapFiles, AreReadBack) {
  OccupancyMap2D map;
  map.origin = {-3.1, 2.7};
  map.width = 5;
  map.height = 3;
  map.cells = {-1, 0, 1, 0, -1, 0, 0, 0, 1, 1, 1, -1, -1, 0, 0};
  TemporaryFolder folder;
  write_map_2d(map, folder.path(), "map2d");
  const std::string pgm = read_text(folder / "map2d.pgm");
  const std::string header = "P5\n5 3\n255\n";
  ASSERT_EQ(pgm.substr(0, header.size()), header);
  ASSERT_EQ(pgm.size(), header.size() + 15);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 5; ++x) {
      const auto grey = static_cast<unsigned char>(
          pgm[header.size() + static_cast<std::size_t>((2 - y) * 5 + x)]);
      // map_server: occupied above 0.65, free below 0.196 of (255 - grey) / 255.
      const double p = (255 - grey) / 255.0;
      EXPECT_EQ(p > 0.65 ? 1 : p < 0.196 ? 0 : -1, map.at({x, y}));
    }
  }
  const std::string yaml = read_text(folder / "map2d.yaml");
  EXPECT_NE(yaml.find("image: map2d.pgm\n"), std::string::npos);
  EXPECT_NE(yaml.find("resolution: 0.1"), std::string::npos);
  EXPECT_NE(yaml.find("origin: [-3.1"), std::string::npos);
  EXPECT_THROW(write_map_2d(map, folder / "missing", "map2d"), DiskError);
}

}  // namespace
}  // namespace arex
