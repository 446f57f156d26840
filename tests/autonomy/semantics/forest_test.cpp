#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "autonomy/semantics/analytic_clouds.h"
#include "config/config.h"
#include "semantics/ground_model.h"
#include "semantics/planarity.h"
#include "semantics/semantic_map.h"
#include "semantics/working_cloud.h"

namespace arex::test {
namespace {

using std::numbers::pi;

const SemanticObject* stem_near(const SemanticMap& map, const Vec2& p) {
  const SemanticObject* best = nullptr;
  double least = 0.3;
  for (const SemanticObject& object : map.objects) {
    const double distance = (object.position.head<2>() - p).norm();
    if (object.kind != SemanticClass::kTrunk || distance > least) continue;
    least = distance;
    best = &object;
  }
  return best;
}

/// Nine stems of 0.1 to 0.7 m on a slope, with shrubs around their feet and leaves above.
struct Stand {
  AnalyticForest cloud;
  std::vector<AnalyticStem> stems;

  Stand(const Vec2& slope, std::uint64_t seed, double seen_rad = 2 * pi) : cloud(slope, seed) {
    cloud.add_ground(9);
    for (int i = 0; i < 9; ++i) {
      AnalyticStem stem;
      stem.foot = 4.5 * Vec2(i % 3 - 1, i / 3 - 1) +
                  Vec2(cloud.random().uniform(-1, 1), cloud.random().uniform(-1, 1));
      stem.radius = 0.05 + 0.0375 * i;
      stem.lean = 0.05 * Vec2(cloud.random().normal(), cloud.random().normal());
      stem.seen_from_rad = cloud.random().uniform(0, 2 * pi);
      stem.seen_rad = seen_rad;
      cloud.add_stem(stem);
      stems.push_back(stem);
      const double reach = stem.radius + 0.6;
      cloud.add_foliage({stem.foot.x() + reach, stem.foot.y(), 0.4}, 0.4, 150);
      cloud.add_foliage({stem.foot.x(), stem.foot.y(), 7}, 2, 1500);
    }
  }
};

TEST(ForestMap, FindsEveryStemOnASlopeAndMeasuresIt) {
  for (const double slope : {0.0, 0.3, 0.7}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const Stand stand({slope * std::cos(seed), slope * std::sin(seed)}, seed);
      const SemanticMap map = build_semantic_map(stand.cloud.points, {}, {});
      EXPECT_EQ(map.scene, SceneKind::kForest);
      EXPECT_EQ(map.count(SemanticClass::kTrunk), stand.stems.size()) << slope << ", " << seed;
      for (const AnalyticStem& stem : stand.stems) {
        const SemanticObject* found = stem_near(map, stem.at_breast());
        ASSERT_NE(found, nullptr) << "radius " << stem.radius << ", slope " << slope;
        // Hundreds of points of 1 cm noise: millimetres; the ground under it: a few centimetres of
        // height, a tenth of that in position.
        EXPECT_LT((found->position.head<2>() - stem.at_breast()).norm(), 0.02);
        EXPECT_NEAR(found->size.x(), 2 * stem.radius, 0.012 + 0.05 * stem.radius);
        EXPECT_NEAR(found->base_z, stand.cloud.ground(stem.foot), 0.15);
        EXPECT_GT(found->seen_fraction, 0.6);
        if (slope == 0) {
          EXPECT_NEAR(found->size.z(), 9, 0.6);  // the top of its leaves
        }
      }
    }
  }
}

TEST(ForestMap, MeasuresStemsOfWhichAThirdIsSeen) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const Stand stand({0.1, 0.0}, seed, 2 * pi / 3);
    const SemanticMap map = build_semantic_map(stand.cloud.points, {}, {});
    EXPECT_EQ(map.count(SemanticClass::kTrunk), stand.stems.size()) << seed;
    for (const AnalyticStem& stem : stand.stems) {
      const SemanticObject* found = stem_near(map, stem.at_breast());
      ASSERT_NE(found, nullptr) << "radius " << stem.radius << ", seed " << seed;
      // An arc of 120 degrees rises by half a radius: its curvature is known a few times worse.
      EXPECT_NEAR(found->size.x(), 2 * stem.radius, 0.035 + 0.1 * stem.radius);
      EXPECT_LT((found->position.head<2>() - stem.at_breast()).norm(),
                stem.radius < 0.08 ? 0.1 : 0.03 + 0.15 * stem.radius);
      EXPECT_LT(found->seen_fraction, 0.7);
      EXPECT_GT(found->seen_fraction, 0.15);
    }
  }
}

TEST(ForestMap, TakesNoFoliageForStems) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    AnalyticForest cloud({0.1, 0.1}, seed);
    cloud.add_ground(9);
    for (int i = 0; i < 12; ++i) {  // shrubs and crowns that hang to the ground
      const Vec2 p(cloud.random().uniform(-7, 7), cloud.random().uniform(-7, 7));
      cloud.add_foliage({p.x(), p.y(), 1.2}, 1.3, 1200);
    }
    const SemanticMap map = build_semantic_map(cloud.points, {}, {});
    EXPECT_EQ(map.count(SemanticClass::kTrunk), 0u) << seed;
  }
}

/// A wall from one foot to the other, 4 m high, with windows that lie 0.2 m deep in it.
void add_wall(AnalyticForest& cloud, const Vec2& from, const Vec2& to, double spacing_m) {
  const Vec2 along = (to - from).normalized(), inwards(-along.y(), along.x());
  for (double s = 0; s < (to - from).norm(); s += spacing_m) {
    for (double h = 0; h < 4; h += spacing_m) {
      const bool window = std::fmod(s, 3) > 1.8 && std::fmod(s, 3) < 2.8 && h > 1 && h < 2.2;
      const Vec2 p = from + s * along + (window ? 0.2 : 0.0) * inwards;
      cloud.add({p.x(), p.y(), cloud.ground(p) + h});
    }
  }
}

TEST(ForestMap, AHouseAmongTreesMakesNoGarageOfThem) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    Stand stand({0.05, 0.0}, seed);
    const std::size_t before = stand.cloud.points.size();
    const double step = stand.cloud.spacing_m;
    add_wall(stand.cloud, {-8, 8}, {8, 8}, step);  // a row of houses
    add_wall(stand.cloud, {7.5, -7}, {7.5, -2}, step);
    add_wall(stand.cloud, {7.5, -7}, {9, -7}, step);
    const SemanticMap map = build_semantic_map(stand.cloud.points, {}, {});
    EXPECT_GT(map.planarity.fraction, 0.05) << seed;
    EXPECT_LT(map.planarity.roofed, 0.05) << seed;
    EXPECT_EQ(map.scene, SceneKind::kForest) << seed;
    EXPECT_EQ(map.count(SemanticClass::kTrunk), stand.stems.size()) << seed;
    for (const AnalyticStem& stem : stand.stems) {
      EXPECT_NE(stem_near(map, stem.at_breast()), nullptr) << seed << ", radius " << stem.radius;
    }
    const auto walls = std::count(map.labels.begin() + static_cast<std::ptrdiff_t>(before),
                                  map.labels.end(), SemanticClass::kWall);
    EXPECT_GT(static_cast<double>(walls),
              0.7 * static_cast<double>(stand.cloud.points.size() - before))
        << seed;
  }
}

// Terraces: level strips with a wall of 1.5 m from one to the next.
TEST(ForestMap, FindsTheTreesOfATerracedSlope) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    AnalyticForest cloud(Vec2::Zero(), seed);
    constexpr double kStep = 1.5, kWidth = 4;
    std::vector<Vec2> feet;
    for (int terrace = 0; terrace < 4; ++terrace) {
      const double z = terrace * kStep, y0 = terrace * kWidth;
      for (double x = -8; x < 8; x += 0.1) {
        for (double y = y0; y < y0 + kWidth; y += 0.1) cloud.add({x, y, z});
        for (double h = 0; terrace < 3 && h < kStep; h += 0.06) cloud.add({x, y0 + kWidth, z + h});
      }
      for (const double x : {-5.0, 0.0, 5.0}) {
        AnalyticForest tree(Vec2::Zero(), seed + 10 * static_cast<std::uint64_t>(terrace));
        const Vec2 foot(x + cloud.random().uniform(-1, 1), y0 + cloud.random().uniform(1.2, 2.8));
        tree.add_stem({.foot = foot, .radius = 0.12});
        for (const Vec3f& p : tree.points)
          cloud.points.emplace_back(p + Vec3f(0, 0, static_cast<float>(z)));
        feet.push_back(foot);
      }
    }
    const SemanticMap map = build_semantic_map(cloud.points, {}, {});
    EXPECT_EQ(map.scene, SceneKind::kForest) << seed;
    EXPECT_EQ(map.count(SemanticClass::kTrunk), feet.size()) << seed;
    for (const Vec2& foot : feet) EXPECT_NE(stem_near(map, foot), nullptr) << seed;
  }
}

// Of scans for breast heights people keep the lowest metres.
TEST(ForestMap, TakesTreesOfACloudThatIsCutOffForNoPosts) {
  for (const double top : {2.5, 2.95, 3.3}) {
    AnalyticForest whole(Vec2::Zero(), 5);
    whole.add_ground(8);
    for (int i = 0; i < 9; ++i) {
      whole.add_stem({.foot = 4 * Vec2(i % 3 - 1, i / 3 - 1), .radius = 0.06 + 0.01 * i});
      whole.add_foliage({4.0 * (i % 3 - 1), 4.0 * (i / 3 - 1), 7}, 2, 1500);
    }
    std::vector<Vec3f> cut = whole.points;
    std::erase_if(cut, [&](const Vec3f& p) { return static_cast<double>(p.z()) > top; });
    const SemanticMap map = build_semantic_map(cut, {}, {});
    EXPECT_EQ(map.count(SemanticClass::kTrunk), 9U) << top;
    EXPECT_EQ(map.count(SemanticClass::kPillar), 0U) << top;
  }
}

TEST(ForestMap, LabelsGroundStemsAndLeaves) {
  const Stand stand({0.2, 0.1}, 5);
  const SemanticMap map = build_semantic_map(stand.cloud.points, {}, {});
  std::size_t ground = 0, ground_right = 0, trunk = 0, trunk_right = 0, leaves = 0,
              leaves_right = 0;
  for (std::size_t i = 0; i < stand.cloud.points.size(); ++i) {
    const Vec3 p = stand.cloud.points[i].cast<double>();
    const double h = p.z() - stand.cloud.ground(p.head<2>());
    const bool near_stem =
        std::any_of(stand.stems.begin(), stand.stems.end(), [&](const AnalyticStem& stem) {
          const double up = p.z() - stand.cloud.ground(stem.foot);
          const double radius = stem.radius - stem.taper * (up - 1.3);
          return up < stem.height &&
                 (p.head<2>() - stem.foot - up * stem.lean).norm() < radius + 0.1;
        });
    const SemanticClass label = map.labels[i];
    if (h > 5 && !near_stem) {
      ++leaves;
      leaves_right += label == SemanticClass::kCanopy;
    } else if (near_stem && h > 0.4 && h < 4.5) {
      ++trunk;
      trunk_right += label == SemanticClass::kTrunk;
    } else if (!near_stem && std::abs(h) < 0.03) {
      ++ground;
      ground_right += label == SemanticClass::kGround;
    }
  }
  EXPECT_GT(static_cast<double>(ground_right), 0.97 * static_cast<double>(ground));
  EXPECT_GT(static_cast<double>(trunk_right), 0.95 * static_cast<double>(trunk));
  EXPECT_GT(static_cast<double>(leaves_right), 0.99 * static_cast<double>(leaves));
}

bool same(const SemanticMap& a, const SemanticMap& b) {
  if (a.objects.size() != b.objects.size()) return false;
  for (std::size_t i = 0; i < a.objects.size(); ++i) {
    if (a.objects[i].position != b.objects[i].position || a.objects[i].size != b.objects[i].size) {
      return false;
    }
  }
  return a.ground.values == b.ground.values;
}

TEST(ForestMap, IsAFunctionOfTheSetOfPoints) {
  const Stand stand({0.2, 0.1}, 6);
  const std::vector<Vec3f>& points = stand.cloud.points;
  const SemanticMap map = build_semantic_map(points, {}, {});
  ASSERT_EQ(map.count(SemanticClass::kTrunk), 9u);
  RandomStream random(1, "shuffle");
  std::vector<std::size_t> order(points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
  // Shuffled, some of them twice, and numbers that are none among them.
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const float inf = std::numeric_limits<float>::infinity();
  std::vector<Vec3f> other;
  std::vector<std::size_t> source;
  for (const std::size_t i : order) {
    other.push_back(points[i]);
    source.push_back(i);
    if (i % 7 == 0) {
      other.push_back(points[i]);
      source.push_back(i);
    }
    if (i % 100 == 0) {
      other.push_back(i % 200 == 0 ? Vec3f(nan, 1, 2) : Vec3f(1, inf, 2));
      source.push_back(points.size());
    }
  }
  const SemanticMap again = build_semantic_map(other, {}, {});
  EXPECT_TRUE(same(map, again));
  ASSERT_EQ(again.labels.size(), other.size());
  for (std::size_t i = 0; i < other.size(); ++i) {
    const SemanticClass expected =
        source[i] < points.size() ? map.labels[source[i]] : SemanticClass::kUnlabelled;
    ASSERT_EQ(again.labels[i], expected) << i;
  }
}

TEST(ForestMap, DoesNotDependOnTheOrigin) {
  const Stand stand({0.2, 0.1}, 7);
  const SemanticMap map = build_semantic_map(stand.cloud.points, {}, {});
  for (const Vec3f& shift : {Vec3f(500, -300, 80), Vec3f(-0.013F, 0.021F, -60)}) {
    std::vector<Vec3f> moved;
    for (const Vec3f& p : stand.cloud.points) moved.push_back(p + shift);
    const SemanticMap other = build_semantic_map(moved, {}, {});
    ASSERT_EQ(other.objects.size(), map.objects.size());
    for (std::size_t i = 0; i < map.objects.size(); ++i) {
      const SemanticObject *a = &map.objects[i],
                           *b = stem_near(other,
                                          a->position.head<2>() + shift.head<2>().cast<double>());
      ASSERT_NE(b, nullptr);
      EXPECT_LT((b->position - shift.cast<double>() - a->position).norm(), 0.005);
      EXPECT_NEAR(b->size.x(), a->size.x(), 0.005);
    }
  }
}

TEST(ForestMap, LivesWithNothingLittleAndFarEchoes) {
  EXPECT_TRUE(build_semantic_map({}, {}, {}).objects.empty());
  const std::vector<Vec3f> one{{1, 2, 3}};
  EXPECT_TRUE(build_semantic_map(one, {}, {}).objects.empty());
  const std::vector<Vec3f> none(500, Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  EXPECT_TRUE(build_semantic_map(none, {}, {}).objects.empty());
  const std::vector<Vec3f> same_place(500, Vec3f(1, 2, 3));
  EXPECT_TRUE(build_semantic_map(same_place, {}, {}).objects.empty());
  // A few points kilometres away do not hide the stand.
  Stand stand({0, 0}, 8);
  for (const Vec3f& far : {Vec3f(9e5F, 0, 0), Vec3f(0, -8e4F, 0), Vec3f(1e30F, 0, 0)}) {
    stand.cloud.points.push_back(far);
  }
  const SemanticMap map = build_semantic_map(stand.cloud.points, {}, {});
  EXPECT_EQ(map.count(SemanticClass::kTrunk), 9u);
  EXPECT_EQ(map.labels.back(), SemanticClass::kUnlabelled);
}

TEST(ForestMap, ACloudWithoutExtentIsNoPlace) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    RandomStream random(seed, "no extent");
    const Mat3 R = Quat(random.normal(), random.normal(), random.normal(), random.normal())
                       .normalized()
                       .toRotationMatrix();
    const Vec3 origin = 500 * random.normal3();
    const auto refusal = [&](const Vec3& half) {
      std::vector<Vec3f> points;
      for (int i = 0; i < 1000; ++i) {
        Vec3 p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
        points.push_back((origin + R * p.cwiseProduct(half)).cast<float>());
      }
      points.push_back(Vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
      try {
        expect_extent(points);
      } catch (const ConfigError& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    EXPECT_NE(refusal({0, 0, 0}).find("in one place"), std::string::npos);
    EXPECT_NE(refusal({20, 0.0005, 0.0005}).find("on one line"), std::string::npos);
    EXPECT_NE(refusal({20, 10, 0.0005}).find("in one plane"), std::string::npos);
    EXPECT_EQ(refusal({20, 10, 0.01}), "");  // ground, and nothing on it
    EXPECT_EQ(refusal({0.1, 5, 0.1}), "");
  }
}

// Across its axis a stem is round, level it is not.
void add_leaning_stem(AnalyticForest& cloud, const AnalyticStem& stem) {
  const Vec3 along = Vec3(stem.lean.x(), stem.lean.y(), 1).normalized();
  const Vec3 e1 = along.unitOrthogonal(), e2 = along.cross(e1);
  const Vec3 foot(stem.foot.x(), stem.foot.y(), cloud.ground(stem.foot));
  const double reach = 2 * stem.radius;  // its lower side comes out of the ground before its foot
  for (double s = -reach; s < stem.height; s += cloud.spacing_m) {
    for (double a = 0; a < stem.seen_rad; a += cloud.spacing_m / stem.radius) {
      const double angle = stem.seen_from_rad + a;
      const Vec3 p = foot + s * along + stem.radius * (std::cos(angle) * e1 + std::sin(angle) * e2);
      if (p.z() > cloud.ground(p.head<2>())) cloud.add(p);
    }
  }
}

TEST(ForestMap, FindsStemsThatLeanByUpTo48Degrees) {
  for (const double degrees : {15.0, 25.0, 30.0, 35.0, 40.0, 45.0, 48.0}) {
    for (const double slope : {0.0, 0.4}) {
      for (const std::uint64_t seed : {1U, 2U, 3U}) {
        AnalyticForest cloud({0, slope}, seed);
        cloud.add_ground(10);
        std::vector<AnalyticStem> stems;
        for (int i = 0; i < 9; ++i) {
          AnalyticStem stem;
          stem.foot = 6 * Vec2(i % 3 - 1, i / 3 - 1);
          stem.radius = 0.06 + 0.03 * i;
          const double towards = cloud.random().uniform(0, 2 * pi);
          stem.lean = std::tan(degrees * pi / 180) * Vec2(std::cos(towards), std::sin(towards));
          stem.seen_from_rad = cloud.random().uniform(0, 2 * pi);
          stem.seen_rad = 1.3 * pi;
          add_leaning_stem(cloud, stem);
          stems.push_back(stem);
          cloud.add_foliage({stem.foot.x() + stem.radius + 0.6, stem.foot.y(), 0.4}, 0.4, 150);
          const Vec2 top = stem.foot + 5 * stem.lean;
          cloud.add_foliage({top.x(), top.y(), 5 + cloud.ground(stem.foot - top)}, 1.5, 800);
        }
        const SemanticMap map = build_semantic_map(cloud.points, {}, {});
        EXPECT_LE(map.count(SemanticClass::kTrunk), stems.size() + 1) << degrees << " " << seed;
        for (const AnalyticStem& stem : stems) {
          const SemanticObject* found = stem_near(map, stem.at_breast());
          ASSERT_NE(found, nullptr)
              << degrees << " degrees, radius " << stem.radius << ", " << slope << ", " << seed;
          EXPECT_LT((found->position.head<2>() - stem.at_breast()).norm(), 0.06) << degrees;
          EXPECT_NEAR(found->size.x(), 2 * stem.radius, 0.025 + 0.05 * stem.radius) << degrees;
          EXPECT_NEAR(found->base_z, cloud.ground(stem.foot), 0.15) << degrees;
        }
      }
    }
  }
}

// Its girth tells an oval stem's diameter; a circle through its points follows one side of it.
TEST(ForestMap, MeasuresTheGirthOfOvalStems) {
  constexpr double kRatio = 1.3;  // of its axes
  for (const double seen_rad : {1.5 * pi, 2 * pi}) {
    std::vector<double> errors;
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      AnalyticForest cloud(Vec2::Zero(), seed);
      cloud.spacing_m = 0.04;
      cloud.add_ground(10);
      for (int i = 0; i < 16; ++i) {
        const Vec2 foot = 5 * Vec2(i % 4 - 1.5, i / 4 - 1.5);
        const double radius = 0.08 + 0.02 * i, a = radius * std::sqrt(kRatio), b = a / kRatio;
        const double from = cloud.random().uniform(0, 2 * pi);
        for (double h = 0; h < 8; h += cloud.spacing_m) {
          for (double t = from; t < from + seen_rad; t += cloud.spacing_m / radius) {
            cloud.add({foot.x() + a * std::cos(t), foot.y() + b * std::sin(t), h});
          }
        }
        cloud.add_foliage({foot.x(), foot.y(), 7}, 2, 500);
      }
      const SemanticMap map = build_semantic_map(cloud.points, {}, {});
      for (int i = 0; i < 16; ++i) {
        const SemanticObject* found = stem_near(map, 5 * Vec2(i % 4 - 1.5, i / 4 - 1.5));
        ASSERT_NE(found, nullptr) << i << " " << seed;
        const double radius = 0.08 + 0.02 * i, a = radius * std::sqrt(kRatio), b = a / kRatio;
        const double girth =
            pi * (3 * (a + b) - std::sqrt((3 * a + b) * (a + 3 * b)));  // Ramanujan
        errors.push_back(std::abs(found->size.x() - girth / pi));
      }
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], seen_rad < 2 * pi ? 0.02 : 0.01) << seen_rad;
    EXPECT_LT(errors[errors.size() * 9 / 10], seen_rad < 2 * pi ? 0.1 : 0.04) << seen_rad;
  }
}

// What leans and is none: rails and branches that begin above the ground, planks, ramps and heaps.
TEST(ForestMap, TakesNothingElseThatLeansForAStem) {
  for (const double slope : {0.0, 0.4}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      AnalyticForest cloud({slope, 0}, seed);
      cloud.add_ground(10);
      const auto random = [&](double low, double high) {
        return cloud.random().uniform(low, high);
      };
      for (int i = 0; i < 9; ++i) {
        const Vec2 p = 6 * Vec2(i % 3 - 1, i / 3 - 1) + Vec2(random(-1, 1), random(-1, 1));
        const double towards = random(0, 2 * pi);
        const Vec2 lean = random(0.6, 1.1) * Vec2(std::cos(towards), std::sin(towards));
        const Vec3 foot(p.x(), p.y(), cloud.ground(p)), along(lean.x(), lean.y(), 1);
        if (i % 3 == 0) {  // two rails above each other
          for (double s = 0.5; s < 3.5; s += 0.03) {
            for (const double above : {0.0, 0.4}) {
              cloud.add(foot + Vec3(0, 0, 0.5 + above) + s * along +
                        0.02 * cloud.random().normal3());
            }
          }
        } else if (i % 3 == 1) {  // a plank or a ramp
          const Vec3 across = Vec3(-lean.y(), lean.x(), 0).normalized();
          const double width = i == 1 ? 0.3 : 2.5;
          for (double s = 0; s < 3; s += 0.06) {
            for (double w = -width / 2; w < width / 2; w += 0.06)
              cloud.add(foot + s * along + w * across);
          }
        } else {  // a heap
          for (int k = 0; k < 3000; ++k) {
            const double r = 1.8 * std::sqrt(random(0, 1)), turn = random(0, 2 * pi);
            cloud.add(foot + Vec3(r * std::cos(turn), r * std::sin(turn), 2 - r / 0.9));
          }
        }
      }
      SemanticConfig config;
      config.scene = SceneKind::kForest;
      const SemanticMap map = build_semantic_map(cloud.points, {}, config);
      EXPECT_EQ(map.count(SemanticClass::kTrunk), 0u) << slope << " " << seed;
    }
  }
}

TEST(ForestMap, RefusesWhatIsTooWideForAMap) {
  RandomStream random(1, "wide");
  std::vector<Vec3f> wide;
  for (int i = 0; i < 5000; ++i) {
    wide.emplace_back(static_cast<float>(random.uniform(-5e4, 5e4)),
                      static_cast<float>(random.uniform(-5e4, 5e4)), 0.0F);
  }
  EXPECT_THROW(build_semantic_map(wide, {}, {}), ConfigError);
}

TEST(GroundModel, FollowsHillsUnderBushesAndIgnoresEchoesFromBelow) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    RandomStream random(seed, "hills");
    const auto hill = [&](double x, double y) {
      return 1.5 * std::sin(x / 4) + 1.2 * std::cos(y / 5) + 0.2 * x;
    };
    std::vector<Vec3f> points;
    for (int i = 0; i < 40000; ++i) {
      const double x = random.uniform(-15, 15), y = random.uniform(-15, 15);
      // Half of the area is hidden by bushes of two metres that one ray in ten passes.
      const bool bush = std::fmod(std::abs(x), 3.0) < 1.5 && random.uniform() < 0.9;
      const double above = bush ? random.uniform(0.2, 2.0) : 0;
      points.emplace_back(static_cast<float>(x), static_cast<float>(y),
                          static_cast<float>(hill(x, y) + above + 0.01 * random.normal()));
    }
    for (int i = 0; i < 40; ++i) {
      points.emplace_back(static_cast<float>(random.uniform(-15, 15)),
                          static_cast<float>(random.uniform(-15, 15)),
                          static_cast<float>(random.uniform(-12, -6)));
    }
    const WorkingCloud cloud(points, 0.04);
    const Raster ground = fit_ground(cloud, 0.5);
    std::vector<double> errors;
    for (double x = -14; x <= 14; x += 0.7) {
      for (double y = -14; y <= 14; y += 0.7) {
        errors.push_back(std::abs(ground.interpolate(x, y) - hill(x, y)));
      }
    }
    std::sort(errors.begin(), errors.end());
    EXPECT_LT(errors[errors.size() / 2], 0.08) << seed;
    EXPECT_LT(errors[errors.size() * 95 / 100], 0.3) << seed;
    EXPECT_LT(errors.back(), 0.7) << seed;
  }
}

/// Errors of the ground model along a lattice, rising.
std::vector<double> ground_errors(const std::vector<Vec3f>& points, const auto& height) {
  const WorkingCloud cloud(points, 0.04);
  const Raster ground = fit_ground(cloud, 0.5);
  std::vector<double> errors;
  for (double x = -8; x <= 8; x += 0.35) {
    for (double y = -8; y <= 8; y += 0.35) {
      errors.push_back(std::abs(ground.interpolate(x, y) - height(Vec2(x, y))));
    }
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

// Echoes that came by a detour, one by one or some of them beside each other.
TEST(GroundModel, WithstandsEchoesFromBelow) {
  for (const double slope : {0.0, 0.5}) {
    for (const double share : {0.001, 0.01}) {
      for (const int cluster : {1, 5, 12}) {
        for (const std::uint64_t seed : {1U, 2U, 3U}) {
          Stand stand({slope * std::cos(seed), slope * std::sin(seed)}, seed);
          AnalyticForest& cloud = stand.cloud;
          const auto echoes = share * static_cast<double>(cloud.points.size());
          for (int i = 0; i < echoes / cluster; ++i) {
            const Vec2 p(cloud.random().uniform(-9, 9), cloud.random().uniform(-9, 9));
            const Vec3 at(p.x(), p.y(), cloud.ground(p) - cloud.random().uniform(0.3, 5));
            for (int k = 0; k < cluster; ++k) {
              cloud.add(at + (cluster > 1 ? 0.1 : 0.0) * cloud.random().normal3());
            }
          }
          const std::vector<double> errors =
              ground_errors(cloud.points, [&](const Vec2& p) { return cloud.ground(p); });
          EXPECT_LT(errors[errors.size() / 2], 0.02)
              << slope << " " << share << " " << cluster << " " << seed;
          EXPECT_LT(errors[errors.size() * 98 / 100], 0.15)
              << slope << " " << share << " " << cluster << " " << seed;
          const SemanticMap map = build_semantic_map(cloud.points, {}, {});
          EXPECT_EQ(map.count(SemanticClass::kTrunk), stand.stems.size());
          for (const AnalyticStem& stem : stand.stems) {
            const SemanticObject* found = stem_near(map, stem.at_breast());
            ASSERT_NE(found, nullptr) << "radius " << stem.radius;
            EXPECT_NEAR(found->base_z, cloud.ground(stem.foot), 0.2);
          }
        }
      }
    }
  }
}

TEST(GroundModel, FollowsDitchesAndHollowsAmongEchoesFromBelow) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    RandomStream random(seed, "ditch");
    // A ditch of 1.2 m across a slope, its sides at 45 degrees, and a hollow of 3 m.
    const auto depth = [](const Vec2& p) {
      const double ditch = std::clamp(1.2 - std::abs(p.x() - 3), 0.0, 0.8);
      const double hollow = std::max(0.0, 1 - (p - Vec2(-4, -3)).squaredNorm() / 2.25);
      return std::max(ditch, hollow);
    };
    const auto height = [&](const Vec2& p) { return 0.3 * p.y() - depth(p); };
    std::vector<Vec3f> points;
    for (int i = 0; i < 30000; ++i) {
      const Vec2 p(random.uniform(-9, 9), random.uniform(-9, 9));
      const double below = i % 100 == 0 ? random.uniform(0.3, 5) : 0;
      points.push_back(
          Vec3(p.x(), p.y(), height(p) - below + 0.01 * random.normal()).cast<float>());
    }
    const std::vector<double> errors = ground_errors(points, height);
    EXPECT_LT(errors[errors.size() / 2], 0.03) << seed;
    EXPECT_LT(errors[errors.size() * 95 / 100], 0.3) << seed;
    const WorkingCloud cloud(points, 0.04);
    const Raster ground = fit_ground(cloud, 0.5);
    for (const Vec2& p : {Vec2(3, -6), Vec2(3, 0), Vec2(3, 6), Vec2(-4, -3)}) {
      EXPECT_NEAR(ground.interpolate(p.x(), p.y()), height(p), 0.3) << seed << " " << p.transpose();
    }
  }
}

}  // namespace
}  // namespace arex::test
