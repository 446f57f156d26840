#include "report/run_report.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "config/config.h"
#include "quantised_reader.h"
#include "report/map_picture.h"
#include "report/targets.h"
#include "scoring/figures.h"
#include "support/temporary_folder.h"
#include "synthetic_run.h"

namespace arex::sim {
namespace {

using arex::test::read_text;
using arex::test::TemporaryFolder;
using arex::test::write_text;

constexpr std::size_t kMegabyte = 1'000'000;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

RunRecord recorded(const TemporaryFolder& folder, const test::SyntheticRun& run = {}) {
  test::write_synthetic_run(folder / "run", run);
  return read_run(folder / "run", kMaxReportPoints);
}

TEST(RunReport, TellsOutcomeFiguresEventsAndTiming) {
  const TemporaryFolder folder;
  const std::string html = run_report_html(recorded(folder));
  for (const char* part :
       {"<h1>room, seed 7", "badge succeeded", "98 %", "20 mm", "target_selected", "mapping",
        "id=\"path-map\"", "data:image/png;base64,", "<noscript>", "inflation_m: 0.5"}) {
    EXPECT_TRUE(contains(html, part)) << part;
  }
  EXPECT_FALSE(contains(html, "badge unfinished"));
  EXPECT_FALSE(contains(html, "Not in the run folder"));
}

TEST(RunReport, ShowsEveryFigureWithItsUnitAndWhatItMeans) {
  const TemporaryFolder folder;
  RunRecord run = recorded(folder);
  const std::string html = run_report_html(run);
  // The main ones at the top, in words and units; why it stopped among them.
  EXPECT_TRUE(contains(html, "<dt>why the exploration stopped</dt><dd>little left</dd>"));
  EXPECT_TRUE(contains(html, "<dt>odometry error, RMS</dt><dd>20 mm</dd>"));
  EXPECT_TRUE(contains(html, "<dt>distance flown</dt><dd>31.4 m</dd>"));
  EXPECT_FALSE(contains(html, "<dt>time to 95 % of the area</dt>"));  // it never got so far
  for (const FigureInfo& figure : figures_in(*run.summary)) {
    EXPECT_TRUE(contains(html, "<code>" + figure.column() + "</code>")) << figure.key;
  }
  EXPECT_TRUE(contains(html, "<td class=\"word\">landing error</td><td>–</td>"));
  // Nor is a figure rounded to what it is not.
  (*run.summary)["coverage"]["area_fraction"] = 0.99996;
  (*run.summary)["distance_m"] = 12345.6;
  const std::string exact = run_report_html(run);
  EXPECT_TRUE(contains(exact, "<dt>area covered</dt><dd>&gt; 99.9 %</dd>"));
  EXPECT_TRUE(contains(exact, "<dt>distance flown</dt><dd>12346 m</dd>"));
  run.title = "inflation_m 0.3, seed 7";
  EXPECT_TRUE(contains(run_report_html(run), "<h1>room, inflation_m 0.3, seed 7"));
  run.title = "room, seed 7";  // scenarios were varied
  EXPECT_TRUE(contains(run_report_html(run), "<h1>room, seed 7"));
}

TEST(RunReport, ListsWhatEachDecisionHadToChooseFrom) {
  const TemporaryFolder folder;
  RunRecord run = recorded(folder);
  run.decisions = parse_table(
      "time_s,decision,kind,source,previous_end,stop_reason,candidate,winner,x_m,y_m,verdict,"
      "information_m2,distance_m,angle_rad,direction,revenue\n"
      "1.0,0,new_target,trees,none,none,0,0,1,2,no_viewpoint,1.5,9,,1,0\n"
      "1.0,0,new_target,trees,none,none,1,1,3,4,kept,2.5,8,0.3,1,-7.5\n"
      "2.0,1,keep_target,trees,none,none,,,,,,,,,,\n"
      "3.0,2,stop,trees,none,little_left,,,,,,,,,,\n");
  const std::string html = run_report_html(run);
  const std::size_t at = html.find("<h2>Decisions</h2>");
  ASSERT_NE(at, std::string::npos);
  const std::string rows = html.substr(at, html.find("</section>", at) - at);
  EXPECT_TRUE(contains(rows,
                       "<td>1.0</td><td class=\"word\">new_target</td><td>2</td><td>1</td>"
                       "<td>2.5</td><td>8</td><td>0.3</td><td>-7.5</td>"))
      << rows;
  EXPECT_TRUE(contains(rows, "stop: little_left</td><td>0</td><td>0</td><td></td>")) << rows;
  EXPECT_FALSE(contains(rows, "keep_target"));
}

TEST(RunReport, NeedsNothingFromOutside) {
  const TemporaryFolder folder;
  const std::string html = run_report_html(recorded(folder));
  EXPECT_FALSE(contains(html, "<script src"));
  EXPECT_FALSE(contains(html, "rel=\"stylesheet\""));
  EXPECT_FALSE(contains(html, "@import"));
  EXPECT_FALSE(contains(html, "url(http"));
}

// What only a script can fill has no heading of its own.
TEST(RunReport, HasNoEmptySectionWithoutAScript) {
  const TemporaryFolder folder;
  const std::string html = run_report_html(recorded(folder));
  EXPECT_TRUE(contains(html, "<section id=\"against-time\"></section>"));
  EXPECT_FALSE(contains(html, "</h2>\n</section>"));
  EXPECT_FALSE(contains(html, "Against time</h2>"));
}

TEST(RunReport, EscapesWhatTheRunSays) {
  const TemporaryFolder folder;
  const std::string html = run_report_html(recorded(folder));
  EXPECT_FALSE(contains(html, "<b>\"&'</b>"));
  EXPECT_TRUE(contains(html, "&lt;b&gt;&quot;&amp;&#39;&lt;/b&gt;&lt;/script&gt;"));
  // The page's own scripts and no other: the payload and the viewer.
  std::size_t ends = 0;
  for (std::size_t at = html.find("</script"); at != std::string::npos;
       at = html.find("</script", at + 1)) {
    ++ends;
  }
  EXPECT_EQ(ends, 2U);
}

// Half an hour of flight with a full cloud, whose noise no compression helps.
TEST(RunReport, StaysBelowFiveMegabytes) {
  const TemporaryFolder folder;
  test::SyntheticRun run;
  run.duration_s = 1800;
  run.cloud_points = 1'000'000;
  run.decisions = 1000;
  run.candidates = 100;
  const std::string html = run_report_html(recorded(folder, run));
  EXPECT_LT(html.size(), 5 * kMegabyte);
  EXPECT_GT(html.size(), 1 * kMegabyte);
}

TEST(RunReport, ThinsTheCloudInTheOrderOfItsFirstSight) {
  const TemporaryFolder folder;
  test::write_synthetic_run(folder / "run", {.cloud_points = 8000});
  const RunRecord all = read_run(folder / "run", 8000);
  const RunRecord some = read_run(folder / "run", 1000);
  ASSERT_EQ(all.cloud.points_O.size(), 8000U);
  ASSERT_EQ(some.cloud.points_O.size(), 1000U);
  EXPECT_EQ(some.cloud.total, 8000U);
  for (std::size_t i = 0; i < 1000; ++i) {
    ASSERT_EQ(some.cloud.points_O[i], all.cloud.points_O[8 * i]) << i;
  }
  // Growth in steps of a twentieth: thinned point k was there exactly when point 8 k was.
  const auto payload = run_payload(some);
  const auto& growth = payload["cloud"]["growth"];
  ASSERT_EQ(growth["count"].size(), 20U);
  for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(growth["count"][i], 50 * (i + 1));
  EXPECT_EQ(test::read_quantised(payload["cloud"]["points"]["z"]).size(), 1000U);
}

TEST(RunReport, ThinningKeepsTheSmallestClearanceAndTheLargestError) {
  const TemporaryFolder folder;
  test::write_synthetic_run(folder / "run", {.duration_s = 900});  // 18,000 rows
  RunRecord run = read_run(folder / "run", 10);
  const auto at = [&](const char* name) { return *run.flight.column(name); };
  run.flight.rows[7001][at("clearance_m")] = "0.01";
  run.flight.rows[9002][at("odometry_error_m")] = "9";
  run.flight.rows[9005][at("odometry_yaw_error_rad")] = "-3";
  const auto flight = run_payload(run)["flight"];
  EXPECT_LE(flight["time_s"]["n"], 6001);
  EXPECT_NEAR(flight["clearance_m"]["lo"].get<double>(), 0.01, 1e-9);
  EXPECT_NEAR(flight["odometry_error_m"]["hi"].get<double>(), 9, 1e-9);
  EXPECT_NEAR(flight["odometry_yaw_error_rad"]["lo"].get<double>(), -3, 1e-9);
  EXPECT_EQ(flight["clearance_m"]["n"], flight["time_s"]["n"]);
}

TEST(RunReport, WhatWasNotMeasuredHidesNothingBesideIt) {
  const TemporaryFolder folder;
  test::write_synthetic_run(folder / "run", {.duration_s = 900});  // four rows make one
  RunRecord run = read_run(folder / "run", 10);
  const auto at = [&](const char* name) { return *run.flight.column(name); };
  for (std::size_t i = 0; i < run.flight.rows.size(); ++i) {
    if (i % 4 != 1) run.flight.rows[i][at("clearance_m")] = "";
    if (i % 4 != 2) run.flight.rows[i][at("tracking_error_m")] = "";
  }
  run.flight.rows[8001][at("clearance_m")] = "0.01";
  run.flight.rows[8002][at("tracking_error_m")] = "7";
  const auto flight = run_payload(run)["flight"];
  EXPECT_NEAR(flight["clearance_m"]["lo"].get<double>(), 0.01, 1e-9);
  EXPECT_NEAR(flight["tracking_error_m"]["hi"].get<double>(), 7, 1e-9);
}

TEST(RunReport, PathsReadBackWithinAMillimetre) {
  const TemporaryFolder folder;
  const RunRecord run = recorded(folder);
  const auto track = run_payload(run)["tracks"]["truth"];
  const auto t = test::read_quantised(track["t"]);
  const auto x = test::read_quantised(track["x"]);
  ASSERT_GT(t.size(), 250U);
  ASSERT_EQ(x.size(), t.size());
  for (std::size_t i = 0; i < t.size(); ++i) {
    const auto nearest = std::min_element(
        run.truth.begin(), run.truth.end(), [&](const TimedPose& a, const TimedPose& b) {
          return std::abs(a.time_s - t[i]) < std::abs(b.time_s - t[i]);
        });
    ASSERT_NEAR(nearest->X.p.x(), x[i], 1e-3);
  }
  EXPECT_NEAR(t.back(), run.truth.back().time_s, 1e-6);
}

TEST(RunReport, MarksAnUnfinishedRun) {
  const TemporaryFolder folder;
  const std::string html = run_report_html(recorded(folder, {.finished = false}));
  EXPECT_TRUE(contains(html, "badge unfinished"));
  EXPECT_TRUE(contains(html, "no summary.json"));
  EXPECT_TRUE(contains(html, "Not in the run folder: summary.json"));
}

TEST(RunReport, LeavesOutWhatIsNotThere) {
  // Each file away alone, then all but the configuration.
  for (const char* name : {"truth.tum", "estimate.tum", "events.csv", "flight.csv", "coverage.csv",
                           "decisions.csv", "timing.csv", "cloud.pcd", "cloud_growth.csv",
                           "map2d.pgm", "map2d.yaml", "resolved.yaml"}) {
    const TemporaryFolder folder;
    test::write_synthetic_run(folder / "run", {});
    std::filesystem::remove(folder / "run" / name);
    const std::string html = run_report_html(read_run(folder / "run", kMaxReportPoints));
    EXPECT_TRUE(contains(html, "badge succeeded")) << name;
    EXPECT_EQ(contains(html, "Not in the run folder"), std::string(name) != "map2d.yaml") << name;
  }
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "run");
  write_text(folder / "run/resolved.yaml", "seed: 1\n");
  const RunRecord bare = read_run(folder / "run", kMaxReportPoints);
  EXPECT_TRUE(contains(run_report_html(bare), "badge unfinished"));
  EXPECT_TRUE(map_picture_svg(bare).empty());
}

TEST(RunReport, ReadsFilesThatAKillCutShort) {
  const TemporaryFolder folder;
  test::write_synthetic_run(folder / "run", {.finished = false});
  for (const auto& entry : std::filesystem::directory_iterator(folder / "run")) {
    std::filesystem::resize_file(entry, std::filesystem::file_size(entry) * 2 / 3 + 1);
  }
  const RunRecord run = read_run(folder / "run", kMaxReportPoints);
  EXPECT_GT(run.truth.size(), 3000U);
  EXPECT_GT(run.cloud.points_O.size(), 12'000U);
  EXPECT_LT(run.cloud.points_O.size(), 14'000U);
  EXPECT_FALSE(run.map.has_value());
  EXPECT_TRUE(contains(run_report_html(run), "badge unfinished"));
}

TEST(RunReport, RefusesAFolderThatIsNoRun) {
  const TemporaryFolder folder;
  try {
    read_run(folder.path(), 10);
    FAIL() << "read a folder without a run";
  } catch (const ConfigError& error) {
    EXPECT_TRUE(contains(error.what(), "expected a run folder")) << error.what();
  }
}

TEST(RunReport, DrawsTheMapWhereItLies) {
  const TemporaryFolder folder;
  const std::string svg = map_picture_svg(recorded(folder));
  // Rows and columns 18..182 of 200 at 0.1 m are known; the lower left corner is at (-15, -10).
  EXPECT_TRUE(contains(svg, "<image x=\"-13.200\" y=\"-8.200\" width=\"16.500\" height=\"16.500\""))
      << svg.substr(0, 300);
  EXPECT_TRUE(contains(svg, "class=\"reached\""));
  EXPECT_TRUE(contains(svg, "class=\"target\""));
}

TEST(RunReport, ATargetIsReachedOnlyWhileItIsTheNewest) {
  const Table events = parse_table(
      "time_s,kind,detail\n1,target_selected,1 2 3\n2,target_selected,4 5 6\n"
      "3,target_reached,4 5 6\n4,target_selected,home\n");
  const auto targets = run_targets(events);
  ASSERT_EQ(targets.size(), 2U);
  EXPECT_FALSE(targets[0].reached);
  EXPECT_TRUE(targets[1].reached);
  EXPECT_EQ(targets[1].p_O, Vec3(4, 5, 6));
}

}  // namespace
}  // namespace arex::sim
