#include "report/evaluation_report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "report/svg.h"

namespace arex::sim {
namespace {

Trajectory circle(const std::string& file, double larger_m) {
  Trajectory trajectory;
  trajectory.file = file;
  for (int i = 0; i <= 5000; ++i) {
    const double angle = 0.001 * i;
    const double radius = 5 + larger_m;
    trajectory.poses.push_back(
        {1e9 + 0.01 * i,
         {so3::from_yaw(angle), {radius * std::cos(angle), radius * std::sin(angle), 1}}});
  }
  return trajectory;
}

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) {
    ++found;
  }
  return found;
}

TEST(EvaluationReport, ShowsFiguresTracksAndErrorsWithoutAScript) {
  Trajectory vio = circle("runs/<vio>.tum", 0.25);
  vio.not_finite = 2;
  const std::string html = evaluation_report_html(
      compare(circle("truth.tum", 0), {circle("runs/lio.tum", 0.125), vio}, {}));
  EXPECT_EQ(count(html, "<script"), 0u);
  EXPECT_EQ(count(html, "http"), 0u);
  EXPECT_EQ(count(html, "<vio>"), 0u);
  EXPECT_NE(html.find("<td class=\"text\">position error (ATE), RMSE, m</td>"
                      "<td class=\"better\"><b>0.125</b></td><td>0.25</td>"),
            std::string::npos);
  EXPECT_NE(html.find("2 lines with a NaN or an infinity left out"), std::string::npos);
  EXPECT_EQ(count(html, "<svg class=\"curves\""), 6u);
  EXPECT_EQ(count(html, "<svg id=\"path-map\""), 1u);
  EXPECT_LT(html.size(), 500'000u) << "5001 poses of two estimates";
}

TEST(EvaluationReport, ShowsOfKittiWhatHasNoTime) {
  Trajectory truth = circle("truth.txt", 0);
  Trajectory estimate = circle("estimate.txt", 0.1);
  truth.format = estimate.format = TrajectoryFormat::kKitti;
  const std::string html = evaluation_report_html(compare(truth, {estimate}, {}));
  EXPECT_EQ(count(html, "<svg class=\"curves\""), 2u);
  EXPECT_EQ(count(html, "yaw error"), 0u);
  EXPECT_EQ(count(html, "nan"), 0u);
}

// One sample of a million: where it stands is as far up as the axis' end, 10.
TEST(Chart, KeepsAPeakHoweverLongTheCurve) {
  Curve curve{"error", std::vector<double>(1'000'000), std::vector<double>(1'000'000, 1.0)};
  for (std::size_t i = 0; i < curve.x.size(); ++i) curve.x[i] = static_cast<double>(i);
  curve.y[123'457] = 10;
  const std::string html = chart_html("Error", "time, s", "m", {curve});
  EXPECT_LT(html.size(), 30'000u);
  EXPECT_NE(html.find(",10.0 "), std::string::npos) << "the top of the drawing";
}

}  // namespace
}  // namespace arex::sim
