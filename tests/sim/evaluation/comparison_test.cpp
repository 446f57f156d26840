#include "evaluation/comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace arex::sim {
namespace {

// A circle of 2 m radius at 10 Hz; the estimate's is larger by so much.
Trajectory circle(const std::string& file, double larger_m) {
  Trajectory trajectory;
  trajectory.file = file;
  for (int i = 0; i <= 200; ++i) {
    const double angle = 0.02 * i;
    const double radius = 2 + larger_m;
    trajectory.poses.push_back(
        {0.1 * i, {so3::from_yaw(angle), {radius * std::cos(angle), radius * std::sin(angle), 1}}});
  }
  return trajectory;
}

const ComparedFigure& figure(const std::vector<ComparedFigure>& figures, const std::string& label) {
  const auto found = std::find_if(figures.begin(), figures.end(),
                                  [&](const ComparedFigure& each) { return each.label == label; });
  EXPECT_NE(found, figures.end()) << label;
  return *found;
}

TEST(Comparison, SetsEstimatesSideBySide) {
  const Comparison comparison =
      compare(circle("truth.tum", 0), {circle("a/lio.tum", 0.1), circle("a/vio.tum", 0.2)}, {});
  const auto figures = figures_of(comparison);
  const ComparedFigure& error = figure(figures, "position error (ATE), RMSE");
  EXPECT_EQ(error.unit, "m");
  EXPECT_TRUE(error.less_is_better);
  ASSERT_EQ(error.values.size(), 2u);
  EXPECT_NEAR(error.values[0], 0.1, 1e-12);
  EXPECT_NEAR(error.values[1], 0.2, 1e-12);
  EXPECT_EQ(figure(figures, "matched poses").values, (std::vector<double>{201, 201}));
  EXPECT_EQ(comparison.estimates[0].name, "lio");
  EXPECT_EQ(comparison.estimates[1].name, "vio");
  for (const ComparedFigure& each : figures) EXPECT_EQ(each.values.size(), 2u) << each.label;
}

TEST(Comparison, NamesEstimatesByWhatTellsThemApart) {
  const auto names = [](const std::vector<std::string>& files) {
    std::vector<Trajectory> estimates;
    for (const std::string& file : files) estimates.push_back(circle(file, 0));
    std::vector<std::string> found;
    for (const auto& e : compare(circle("t", 0), estimates, {}).estimates) found.push_back(e.name);
    return found;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(names({"runs/a/estimate.tum", "runs/b/estimate.tum"}),
            (Names{"a/estimate", "b/estimate"}));
  EXPECT_EQ(names({"a/x/lio.tum", "b/x/lio.tum", "vio.csv"}), (Names{"a/x/lio", "b/x/lio", "vio"}));
  EXPECT_EQ(names({"/lio.tum", "lio.tum"}), (Names{"/lio.tum", "lio.tum"}));
  EXPECT_EQ(names({"same.tum", "same.tum"}), (Names{"same.tum", "same.tum"}));
}

TEST(Comparison, WritesEveryFigureAndNullForWhatThereWasNotToMeasure) {
  EvaluationOptions options;
  options.deltas_m = {1, 100};
  options.alignment = Alignment::kSim3;
  Trajectory estimate = circle("a.tum", 0.1);
  estimate.not_finite = 3;
  estimate.same_stamp = 1;
  const auto json = comparison_json(compare(circle("truth.tum", 0), {estimate}, options));
  EXPECT_EQ(json["reference"]["file"], "truth.tum");
  EXPECT_EQ(json["options"]["align"], "sim3");
  EXPECT_EQ(json["options"]["delta_m"], (nlohmann::ordered_json{1.0, 100.0}));
  const auto& e = json["estimates"][0];
  EXPECT_EQ(e["matched"], 201);
  EXPECT_NEAR(e["alignment"]["scale"].get<double>(), 2 / 2.1, 1e-12);
  EXPECT_NEAR(e["ate"]["translation_m"]["rmse"].get<double>(), 0, 1e-12);
  EXPECT_GT(e["rpe"][0]["all"]["sub_paths"].get<int>(), 100);
  EXPECT_EQ(e["rpe"][1]["delta_m"], 100);
  EXPECT_EQ(e["rpe"][1]["consecutive"]["sub_paths"], 0);
  EXPECT_TRUE(e["rpe"][1]["all"]["translation_m"].is_null());
  EXPECT_EQ(e["left_out_not_finite"], 3);
  EXPECT_EQ(e["notes"], (nlohmann::ordered_json{"3 lines with a NaN or an infinity left out",
                                                "1 pose with the stamp of the one before it"}));
  EXPECT_EQ(nlohmann::ordered_json::parse(json.dump()), json);
}

// The rotation about the line is what the noise makes it.
TEST(Comparison, SaysWhereALineLeavesTheAlignmentOpen) {
  Trajectory truth, estimate;
  for (int i = 0; i < 200; ++i) {
    const double t = 0.1 * i;
    truth.poses.push_back({t, {Mat3::Identity(), {t, 0.01 * std::sin(t), 0}}});
    estimate.poses.push_back(
        {t, {Mat3::Identity(), {t, 0.05 * std::sin(7 * t), 0.05 * std::cos(5 * t)}}});
  }
  EvaluationOptions options;
  for (const Alignment alignment : {Alignment::kSe3, Alignment::kYaw}) {
    options.alignment = alignment;
    const Comparison comparison = compare(truth, {estimate}, options);
    const auto notes = notes_of(comparison.estimates[0], options);
    EXPECT_EQ(notes.size(), alignment == Alignment::kSe3 ? 1u : 0u);
  }
}

TEST(Comparison, KnowsItsAlignmentsByName) {
  for (const char* name : {"none", "origin", "yaw", "se3", "sim3", "scale"}) {
    ASSERT_TRUE(alignment_named(name)) << name;
    EXPECT_EQ(alignment_name(*alignment_named(name)), name);
  }
  EXPECT_FALSE(alignment_named("SE3"));
}

}  // namespace
}  // namespace arex::sim
