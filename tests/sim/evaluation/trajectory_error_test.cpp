#include "evaluation/trajectory_error.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "config/config.h"
#include "math/random.h"

namespace arex::sim {
namespace {

using SubPath = std::pair<std::size_t, std::size_t>;

constexpr double kDegrees = 180 / std::numbers::pi;

Trajectory with_stamps(const std::vector<double>& stamps) {
  Trajectory trajectory;
  for (const double stamp : stamps)
    trajectory.poses.push_back({stamp, {Mat3::Identity(), {stamp, 0, 0}}});
  return trajectory;
}

// A winding flight of about 60 m with all rotations, 40 Hz.
std::vector<Pose> flight(std::uint64_t seed) {
  RandomStream random(seed, "flight");
  const Vec3 phase = random.normal3();
  std::vector<Pose> poses;
  for (int i = 0; i <= 1200; ++i) {
    const double s = 2 * std::numbers::pi * i / 1200;
    poses.push_back(
        {so3::Exp(Vec3(0.3 * std::sin(3 * s + phase.x()), 0.2 * std::cos(2 * s), 4 * s)),
         {10 * std::sin(s), 5 * std::sin(2 * s + phase.y()), 2 * std::cos(s + phase.z())}});
  }
  return poses;
}

// The flight as its estimate tells it: moved as a whole, with noise on top.
std::vector<PosePair> flown(std::uint64_t seed, const Similarity& X_OW, double noise) {
  RandomStream random(seed, "noise");
  std::vector<PosePair> pairs;
  for (const Pose& X_WB : flight(seed)) {
    PosePair pair{0, X_WB, X_OW * X_WB};
    pair.X_OB.p += noise * random.normal3();
    pair.X_OB.R = pair.X_OB.R * so3::Exp(noise * random.normal3());
    pairs.push_back(pair);
  }
  return pairs;
}

double squared_error(const std::vector<PosePair>& pairs, const Similarity& X_WO) {
  double sum = 0;
  for (const PosePair& pair : pairs) sum += ((X_WO * pair.X_OB).p - pair.X_WB.p).squaredNorm();
  return sum;
}

TEST(Statistics, AreThoseOfThePopulation) {
  const Statistics s = statistics_of({4, 1, 3, 2, 10});
  EXPECT_DOUBLE_EQ(s.sse, 130);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(26.0));
  EXPECT_DOUBLE_EQ(s.mean, 4);
  EXPECT_DOUBLE_EQ(s.std, std::sqrt(10.0));
  EXPECT_DOUBLE_EQ(s.median, 3);
  EXPECT_DOUBLE_EQ(statistics_of({4, 1, 3, 2}).median, 2.5);
  EXPECT_DOUBLE_EQ(s.min, 1);
  EXPECT_DOUBLE_EQ(s.max, 10);
  EXPECT_TRUE(std::isnan(statistics_of({}).rmse));
}

// What stamps are matched, as pairs of stamps.
std::vector<std::pair<double, double>> matches(const std::vector<double>& reference,
                                               const std::vector<double>& estimate,
                                               double max_difference_s, double offset_s = 0) {
  std::vector<std::pair<double, double>> found;
  for (const PosePair& pair :
       associate(with_stamps(reference), with_stamps(estimate), max_difference_s, offset_s)) {
    found.emplace_back(pair.X_WB.p.x(), pair.X_OB.p.x());  // with_stamps() put them there
  }
  return found;
}

TEST(Association, TakesTheNearestStampAndOfTwoTheFirst) {
  using Found = std::vector<std::pair<double, double>>;
  // Evo's own test of it (test/test_sync.py at its commit 2d402c5).
  EXPECT_EQ(matches({0, 0.01}, {0.005}, 0.006), (Found{{0, 0.005}}));
  EXPECT_EQ(matches({0.005}, {0, 0.01}, 0.006), (Found{{0.005, 0}}));
  EXPECT_EQ(matches({0, 1, 2}, {0.009, 1.02}, 0.01), (Found{{0, 0.009}}));
  EXPECT_EQ(matches({0, 1, 2}, {0.5, 1.5}, 0.01, 0.5), (Found{{1, 0.5}, {2, 1.5}}));
  EXPECT_EQ(matches({1, 2}, {0.5, 1.5, 9}, 0.01, 0.5), (Found{{1, 0.5}, {2, 1.5}}));
  EXPECT_EQ(matches({0, 1}, {5, 6}, 0.01), Found{});
  // Equally long: each pose of the estimate looks for its partner, and two may find the same.
  EXPECT_EQ(matches({0, 1}, {0.4, 0.3}, 0.5), (Found{{0, 0.4}, {0, 0.3}}));
}

// What evo writes down as a search through all stamps.
TEST(Association, AgreesWithASearchThroughAllStamps) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    RandomStream random(seed, "stamps");
    const auto draw = [&](int count) {
      std::vector<double> stamps(static_cast<std::size_t>(count));
      // On a grid, so that stamps repeat and lie as near to two others.
      for (double& stamp : stamps) stamp = 1.4e9 + 0.005 * std::floor(400 * random.uniform());
      std::sort(stamps.begin(), stamps.end());
      return stamps;
    };
    const std::vector<double> reference = draw(300);
    const std::vector<double> estimate = draw(seed % 2 ? 120 : 500);
    const double offset = 0.01 * random.normal();
    const bool longer = estimate.size() > reference.size();
    const auto& shorter_stamps = longer ? reference : estimate;
    const auto& longer_stamps = longer ? estimate : reference;
    std::vector<std::pair<double, double>> expected;
    for (const double stamp : shorter_stamps) {
      double best = 1e9, partner = 0;
      for (const double other : longer_stamps) {
        const double distance = std::abs((other + (longer ? offset : -offset)) - stamp);
        if (distance < best) std::tie(best, partner) = std::pair(distance, other);
      }
      if (best <= 0.01)
        expected.push_back(longer ? std::pair(stamp, partner) : std::pair(partner, stamp));
    }
    EXPECT_GT(expected.size(), 50u);
    EXPECT_EQ(matches(reference, estimate, 0.01, offset), expected);
  }
}

std::vector<Vec3> along_z(const std::vector<double>& heights) {
  std::vector<Vec3> positions;
  for (const double z : heights) positions.emplace_back(0, 0, z);
  return positions;
}

// The positions and pairs of evo's own tests of it (test/test_filters.py at its commit 0c7d611).
// Older evo left the first of consecutive sub-paths out.
TEST(SubPaths, AreThoseOfEvosTests) {
  using Found = std::vector<SubPath>;
  const auto all = [](const std::vector<double>& heights, double delta) {
    return sub_paths(along_z(heights), delta, SubPaths::kAll);
  };
  EXPECT_EQ(all({0, 0.5, 0, 1}, 1.0), (Found{{0, 2}, {2, 3}}));
  EXPECT_EQ(all({0, 0.5, 0, 1}, 2.5), Found{});
  EXPECT_EQ(all({0, 0.5, 0.99, 1.0}, 1.0), (Found{{0, 3}}));
  EXPECT_EQ(all({0, .9, .99, .999, .9999, .99999, .999999, .9999999}, 1.0), (Found{{0, 7}}));
  EXPECT_EQ(sub_paths(along_z({0, 1, 2, 3, 4}), 2, SubPaths::kConsecutive),
            (Found{{0, 2}, {2, 4}}));
}

TEST(SubPaths, AgreeWithASearchThroughAllPairs) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    RandomStream random(seed, "path");
    std::vector<Vec3> positions{Vec3::Zero()};
    for (int i = 0; i < 300; ++i) {
      // It stops at times, so that several poses are as far along the path.
      const bool stands = random.uniform() < 0.3;
      positions.push_back(positions.back() +
                          (stands ? Vec3::Zero() : Vec3(0.05 * random.normal3())));
    }
    const std::vector<double> distances = distances_along(positions);
    std::vector<SubPath> expected;
    for (std::size_t i = 0; i < positions.size(); ++i) {
      std::size_t best = positions.size();
      double least = 0.1;
      for (std::size_t j = i + 1; j < positions.size(); ++j) {
        const double off = std::abs(distances[j] - distances[i] - 1);
        if (off < least || (best == positions.size() && off <= least))
          std::tie(least, best) = std::pair(off, j);
      }
      if (best < positions.size()) expected.emplace_back(i, best);
    }
    EXPECT_GT(expected.size(), 100u);
    EXPECT_EQ(sub_paths(positions, 1, SubPaths::kAll), expected);
  }
}

TEST(Alignment, FindsTheTransformThatMovedTheEstimate) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RandomStream random(seed, "frame");
    const Pose X_OW{so3::Exp(random.normal3()), 10 * random.normal3()};
    const Pose level{so3::from_yaw(random.normal()), 10 * random.normal3()};
    const double scale = std::exp(random.normal());
    const std::vector<std::pair<Alignment, Similarity>> cases{{Alignment::kOrigin, {X_OW, 1}},
                                                              {Alignment::kYaw, {level, 1}},
                                                              {Alignment::kSe3, {X_OW, 1}},
                                                              {Alignment::kSim3, {X_OW, scale}},
                                                              {Alignment::kScale, {{}, scale}}};
    for (const auto& [alignment, moved] : cases) {
      const auto pairs = flown(seed, moved, 0);
      const auto found = align(pairs, alignment);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->scale, 1 / moved.scale, 1e-12);
      EXPECT_LT(squared_error(pairs, *found), 1e-18);
      EXPECT_LT(so3::angle(found->X_WO.R * moved.X_WO.R), 1e-7);
    }
  }
}

// Whatever the noise: no step away from it in what it may choose makes the error less.
TEST(Alignment, IsTheBestOfItsKind) {
  constexpr double kStep = 1e-3;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RandomStream random(seed, "frame");
    const Similarity moved{{so3::Exp(random.normal3()), random.normal3()}, 1.3};
    const auto pairs = flown(seed, moved, 0.3);
    for (const Alignment alignment : {Alignment::kYaw, Alignment::kSe3, Alignment::kSim3}) {
      const Similarity best = align(pairs, alignment).value();
      const double least = squared_error(pairs, best);
      for (int axis = 0; axis < 7; ++axis) {
        const bool yaw_only = alignment == Alignment::kYaw && axis < 2;
        if (yaw_only || (axis == 6 && alignment != Alignment::kSim3)) continue;
        for (const double step : {-kStep, kStep}) {
          Similarity other = best;
          if (axis < 3) other.X_WO.R = so3::Exp(step * Vec3::Unit(axis)) * best.X_WO.R;
          if (axis >= 3 && axis < 6) other.X_WO.p += step * Vec3::Unit(axis - 3);
          if (axis == 6) other.scale += step;
          EXPECT_GT(squared_error(pairs, other), least) << axis;
        }
      }
    }
  }
}

// A mirror image is no rotation: the nearest one is sought, as Umeyama's correction does.
TEST(Alignment, NeverMirrors) {
  auto pairs = flown(1, {}, 0);
  for (PosePair& pair : pairs) pair.X_OB.p.x() *= -1;
  for (const Alignment alignment : {Alignment::kSe3, Alignment::kSim3}) {
    EXPECT_NEAR(align(pairs, alignment)->X_WO.R.determinant(), 1, 1e-12);
  }
}

TEST(Alignment, SaysWhereThePositionsDetermineNone) {
  const auto along = [](const Vec3& step, const Vec3& begin) {
    std::vector<PosePair> pairs;
    for (int i = 0; i < 100; ++i) {
      const Pose X{Mat3::Identity(), begin + i * step};
      pairs.push_back({0, X, X});
    }
    return pairs;
  };
  for (const Vec3& begin : {Vec3(0, 0, 0), Vec3(4e5, 5e6, 100)}) {
    const auto still = along(Vec3::Zero(), begin);
    const auto line = along({0.1, 0.2, 0.3}, begin);
    const auto up = along({0, 0, 0.1}, begin);
    for (const Alignment alignment :
         {Alignment::kYaw, Alignment::kSe3, Alignment::kSim3, Alignment::kScale}) {
      EXPECT_FALSE(align(still, alignment));
    }
    EXPECT_FALSE(align(line, Alignment::kSe3));
    EXPECT_FALSE(align(line, Alignment::kSim3));
    EXPECT_TRUE(align(line, Alignment::kYaw));
    EXPECT_TRUE(align(line, Alignment::kScale));
    EXPECT_FALSE(align(up, Alignment::kYaw));
    EXPECT_TRUE(align(still, Alignment::kOrigin));
    EXPECT_TRUE(align(still, Alignment::kNone));
  }
}

Trajectory trajectory_of(const std::vector<Pose>& poses, const std::string& file) {
  Trajectory trajectory;
  trajectory.file = file;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    trajectory.poses.push_back({0.025 * static_cast<double>(i), poses[i]});
  }
  return trajectory;
}

// 30 m straight on; the estimate's scale is off by 1 %, its heading by one degree a metre.
TEST(Evaluation, MeasuresErrorsThatAreKnownInClosedForm) {
  std::vector<Pose> truth, estimate;
  for (int i = 0; i <= 3000; ++i) {
    truth.push_back({Mat3::Identity(), {0.01 * i, 0, 0}});
    estimate.push_back({so3::from_yaw(0.01 * i / kDegrees), {0.0101 * i, 0, 0}});
  }
  // Without the rotation first: it turns what relative poses see.
  std::vector<Pose> straight = estimate;
  for (Pose& pose : straight) pose.R = Mat3::Identity();
  EvaluationOptions options;
  options.pairs_from_reference = true;
  const auto reference = trajectory_of(truth, "truth");
  const Evaluation scaled = evaluate(reference, trajectory_of(straight, "estimate"), options);
  EXPECT_EQ(scaled.pairs.size(), 3001u);
  EXPECT_NEAR(scaled.duration_s, 75, 1e-9);
  EXPECT_NEAR(scaled.reference_length_m, 30, 1e-9);
  EXPECT_NEAR(scaled.estimate_length_m, 30.3, 1e-9);
  EXPECT_NEAR(scaled.end_error_m, 0.3, 1e-9);
  EXPECT_NEAR(scaled.drift_percent, 1, 1e-9);
  EXPECT_NEAR(scaled.position_m.max, 0.3, 1e-9);
  EXPECT_NEAR(scaled.position_m.mean, 0.15, 1e-9);
  // sum of i^2 up to n is n (n + 1) (2 n + 1) / 6
  EXPECT_NEAR(scaled.position_m.rmse, 1e-4 * std::sqrt(3000 * 6001 / 6.0), 1e-9);
  ASSERT_EQ(scaled.relative.size(), 4u);
  for (const RelativeError& error : scaled.relative) {
    const bool all = error.which == SubPaths::kAll;
    EXPECT_NEAR(error.translation_m.median, 0.01 * error.delta_m, 1e-9) << error.delta_m;
    EXPECT_NEAR(error.rotation_deg.max, 0, 1e-9);
    // All: from each of 3001 poses that has one far enough behind it, or so near that a tenth less
    // is no reason to leave it out.
    const double expected = all ? 3000 - 90 * error.delta_m + 1 : 30 / error.delta_m;
    EXPECT_NEAR(static_cast<double>(error.count), expected, all ? 1 : 0.5 + 1) << error.delta_m;
  }
  const Evaluation turned = evaluate(reference, trajectory_of(estimate, "estimate"), options);
  EXPECT_NEAR(turned.rotation_deg.max, 30, 1e-9);
  EXPECT_NEAR(turned.yaw_deg.mean, 15, 1e-9);
  EXPECT_NEAR(turned.relative[2].rotation_deg.mean, 10, 0.2);
}

// Sub-paths are measured along the estimate, as evo does, unless told otherwise.
TEST(Evaluation, MeasuresSubPathsAlongTheEstimateOrTheReference) {
  std::vector<Pose> truth, estimate;
  for (int i = 0; i <= 1000; ++i) {
    truth.push_back({Mat3::Identity(), {0.01 * i, 0, 0}});
    estimate.push_back({Mat3::Identity(), {0.02 * i, 0, 0}});
  }
  EvaluationOptions options;
  options.deltas_m = {1};
  const auto error = [&] {
    return evaluate(trajectory_of(truth, ""), trajectory_of(estimate, ""), options)
        .relative.front()
        .translation_m.median;
  };
  EXPECT_NEAR(error(), 0.5, 1e-9);
  options.pairs_from_reference = true;
  EXPECT_NEAR(error(), 1.0, 1e-9);
  options.alignment = Alignment::kScale;
  EXPECT_NEAR(error(), 0, 1e-9);
}

TEST(Evaluation, AgreesWithTheFiguresOfAFlight) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto pairs = flown(seed, {{so3::Exp({0.1, -0.2, 1}), {1, 2, 3}}, 1}, 0.02);
    std::vector<Pose> truth, estimate;
    for (const PosePair& pair : pairs) {
      truth.push_back(pair.X_WB);
      estimate.push_back(pair.X_OB);
    }
    const OdometryScore score = score_odometry(pairs);
    EvaluationOptions options;
    options.alignment = Alignment::kOrigin;
    const Evaluation at_start =
        evaluate(trajectory_of(truth, ""), trajectory_of(estimate, ""), options);
    EXPECT_NEAR(at_start.position_m.rmse, score.ate_rmse_m, 1e-12);
    EXPECT_NEAR(at_start.position_m.max, score.ate_max_m, 1e-12);
    EXPECT_NEAR(at_start.yaw_deg.max, score.yaw_error_max_deg, 1e-9);
    EXPECT_NEAR(at_start.end_error_m, score.end_error_m, 1e-12);
    EXPECT_NEAR(at_start.drift_percent, score.drift_percent, 1e-12);
    options.alignment = Alignment::kSe3;
    const Evaluation best =
        evaluate(trajectory_of(truth, ""), trajectory_of(estimate, ""), options);
    EXPECT_NEAR(best.position_m.rmse, score.ate_se3_rmse_m, 1e-12);
    EXPECT_NEAR(best.end_error_m, score.end_error_m, 1e-9) << "whatever the alignment";
  }
}

TEST(Evaluation, AlignsByTheFirstPosesAlone) {
  auto truth = flight(1);
  auto estimate = truth;
  for (std::size_t i = 600; i < estimate.size(); ++i) estimate[i].p += Vec3(0, 0, 1);
  EvaluationOptions options;
  options.alignment = Alignment::kSe3;
  options.poses_to_align = 500;
  const Evaluation e = evaluate(trajectory_of(truth, ""), trajectory_of(estimate, ""), options);
  EXPECT_LT(e.position_error_m[599], 1e-9);
  EXPECT_NEAR(e.position_error_m[600], 1, 1e-9);
  EXPECT_LT((e.alignment.X_WO.p).norm(), 1e-9);
}

TEST(Evaluation, KittiIsMatchedByNumberAndHasNoYaw) {
  auto reference = trajectory_of(flight(1), "truth.txt");
  auto estimate = reference;
  reference.format = estimate.format = TrajectoryFormat::kKitti;
  for (TimedPose& pose : estimate.poses) pose.time_s = 0;
  const Evaluation e = evaluate(reference, estimate, {});
  EXPECT_EQ(e.pairs.size(), reference.poses.size());
  EXPECT_EQ(e.position_m.max, 0);
  EXPECT_TRUE(std::isnan(e.duration_s));
  EXPECT_TRUE(std::isnan(e.yaw_deg.rmse));
  EXPECT_TRUE(e.yaw_error_deg.empty());
}

void expect_refused(const Trajectory& reference, const Trajectory& estimate,
                    const EvaluationOptions& options, const std::string& expected) {
  try {
    evaluate(reference, estimate, options);
    ADD_FAILURE() << "expected: " << expected;
  } catch (const ConfigError& error) {
    EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
  }
}

TEST(Evaluation, RefusesWhatCannotBeCompared) {
  const auto reference = trajectory_of(flight(1), "truth.tum");
  auto estimate = reference;
  estimate.file = "e.tum";
  for (TimedPose& pose : estimate.poses) pose.time_s += 100;
  expect_refused(reference, estimate, {},
                 "e.tum: 0 of 1201 poses have a partner in truth.tum, expected 3 at least; stamps "
                 "run from 100 to 130 s, there from 0 to 30 s");
  estimate.format = TrajectoryFormat::kKitti;
  expect_refused(reference, estimate, {}, "e.tum: is of format kitti, truth.tum of tum");
  auto kitti = estimate;
  kitti.poses.pop_back();
  expect_refused(kitti, estimate, {}, "e.tum: holds 1201 poses, expected the 1200 of");
  const auto still = trajectory_of(std::vector<Pose>(50), "still.tum");
  EvaluationOptions options;
  options.alignment = Alignment::kSe3;
  expect_refused(still, still, options, "still.tum: the 50 matched positions stand still");
}

}  // namespace
}  // namespace arex::sim
