#include "report/comparison_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "config/config.h"
#include "quantised_reader.h"
#include "report/outcome_matrix.h"
#include "report/overlay.h"
#include "report/run_record.h"
#include "support/temporary_folder.h"
#include "synthetic_run.h"

namespace arex::sim {
namespace {

using arex::test::TemporaryFolder;
using arex::test::write_text;

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(ComparisonReport, ReadsASweepsTable) {
  const TemporaryFolder folder;
  test::write_synthetic_sweep(folder.path());
  const ResultTable results = read_results({folder.path()});
  EXPECT_EQ(results.keys, (std::vector<std::string>{"scenario", "planning.inflation_m",
                                                    "exploration.weight_direction"}));
  ASSERT_EQ(results.table.rows.size(), 24U);
  EXPECT_EQ(results.table.text(9, "failure"), "crashed");
  EXPECT_EQ(results.table.text(9, "detail"), "signal 11, <core>");
  EXPECT_EQ(results.table.text(5, "outcome"), "collided");
  EXPECT_EQ(results.folders[0], folder / "runs/0000000000000000");
}

TEST(ComparisonReport, NamesFailuresByTheirCause) {
  const TemporaryFolder folder;
  test::write_synthetic_sweep(folder.path());
  const std::string html =
      comparison_report_html(read_results({folder.path()}), "sweep <x>", folder.path());
  EXPECT_TRUE(contains(html, "<h1>sweep &lt;x&gt;</h1>"));
  EXPECT_TRUE(contains(html,
                       "<dt>succeeded</dt><dd>22<small>of 24 flown: 91.7 %, 95 % "
                       "interval 74 to 98 %</small></dd>"));
  EXPECT_TRUE(contains(html, "<dt>crashed</dt><dd>1</dd>"));
  EXPECT_TRUE(contains(html, "<td class=\"text\">signal 11, &lt;core&gt;</td>"));
  EXPECT_TRUE(contains(html, "<td class=\"text\">hit trunk 4 at 1.20 m/s</td>"));
}

TEST(ComparisonReport, TitlesARunByWhatWasVaried) {
  const TemporaryFolder folder;
  test::write_synthetic_sweep(folder.path());
  const ResultTable results = read_results({folder.path()});
  EXPECT_EQ(run_title(results, 0), "inflation_m 0.3, weight_direction 1, seed 1");
  EXPECT_EQ(run_title(results, 23), "inflation_m 0.7, weight_direction 3, seed 4");
  EXPECT_EQ(title_in_sweep(results.folders[0]), run_title(results, 0));
  EXPECT_EQ(title_in_sweep(folder / "elsewhere/run"), "");
  const std::string html = comparison_report_html(results, "sweep", folder.path());
  EXPECT_TRUE(contains(html, "inflation_m 0.3, weight_direction 3, seed 2"));  // the collided one
}

TEST(ComparisonReport, CountsWhatBecameOfEachFaultAndWhatWasTold) {
  ResultTable results;
  results.keys = {"scenario", "variant", "faults"};
  results.table = parse_table(
      "scenario,variant,faults,seed,failure,detail,outcome,faults.told,faults.told_after_s\n"
      "a,lidar silent,x,1,,,stuck,sensor_fault: lidar silent,0.3\n"
      "a,lidar silent,x,2,,,collided,sensor_fault: lidar silent,0.4\n"
      "a,motor weak,y,1,,,succeeded,vehicle_fault: motor 2 weak: 31 % missing,2\n"
      "a,motor weak,y,2,,,collided,,\n"
      "a,motor weak,y,3,crashed,signal 11,,,\n"
      "a,weak frame,z,1,,,lost,vibration: gyro 2.1 rad/s RMS at 80 Hz,1\n"
      "a,weak frame,z,2,,,timed_out,vibration: gyro 2.7 rad/s RMS at 81 Hz,3\n");
  results.folders.assign(7, "none");
  const std::vector<OutcomeRow> rows = outcome_matrix(results);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].title, "a: lidar silent");
  EXPECT_EQ(rows[0].landed + 10 * rows[0].collided, 11);
  EXPECT_EQ(rows[0].untold, 0);
  EXPECT_EQ(rows[0].told, "sensor_fault: lidar silent (2)");
  EXPECT_EQ(rows[0].told_after_s, 0.4);
  EXPECT_EQ(rows[1].continued + 10 * rows[1].collided + 100 * rows[1].broken, 111);
  EXPECT_EQ(rows[1].untold, 1);
  EXPECT_EQ(rows[1].told, "nothing (1), vehicle_fault: motor 2 weak (1)");
  EXPECT_EQ(rows[2].lost + 10 * rows[2].timed_out, 11);
  EXPECT_EQ(rows[2].told, "vibration (2)");
  EXPECT_TRUE(contains(outcomes_html(results), "<td class=\"word\">a: lidar silent</td>"));
  results.table = parse_table("scenario,variant,seed,failure,detail,outcome\na,b,1,,,stuck\n");
  results.folders.assign(1, "none");
  EXPECT_EQ(outcomes_html(results), "");
}

TEST(ComparisonReport, TitlesTellEveryTwoRunsApart) {
  ResultTable results;
  results.keys = {"scenario", "variant", "lidar.rate_hz", "depth.rate_hz"};
  results.table = parse_table(
      "scenario,variant,lidar.rate_hz,depth.rate_hz,seed,failure,detail\n"
      "a,,10,30,1,,\na,fast,20,30,1,,\nb,,10,15,1,,\nb,,10,15,1,,\n");
  results.folders = {"w", "x", "y", "z"};
  EXPECT_EQ(run_titles(results),
            (std::vector<std::string>{"a, lidar.rate_hz 10, depth.rate_hz 30, seed 1",
                                      "a, fast, lidar.rate_hz 20, depth.rate_hz 30, seed 1",
                                      "b, lidar.rate_hz 10, depth.rate_hz 15, seed 1, y",
                                      "b, lidar.rate_hz 10, depth.rate_hz 15, seed 1, z"}));
  EXPECT_EQ(configuration_titles(results)[3], "b, lidar.rate_hz 10, depth.rate_hz 15");
}

TEST(ComparisonReport, FiguresAreNamedInWordsWithTheirUnits) {
  ResultTable results;
  results.table = parse_table(
      "seed,failure,detail,odometries.oracle.ate_rmse_m,coverage.reachable_area_m2\n1,,,0.1,20\n");
  results.folders = {"x"};
  const auto figures = comparison_payload(results, ".")["figures"];
  EXPECT_EQ(figures["odometries.oracle.ate_rmse_m"]["label"], "odometry error, RMS, oracle");
  EXPECT_EQ(figures["coverage.reachable_area_m2"]["unit"], "m²");
}

// Two runs through one room and one through another: three curves, two maps.
TEST(ComparisonReport, LaysRunsOverEachOther) {
  const TemporaryFolder folder;
  test::write_synthetic_run(folder / "a", {});
  test::write_synthetic_run(folder / "b", {.duration_s = 20});
  test::write_synthetic_run(folder / "c", {});
  write_text(folder / "b/resolved.yaml", "seed: 7\nplanning:\n  inflation_m: 0.3\n");
  write_text(folder / "c/resolved.yaml", "seed: 8\nplanning:\n  inflation_m: 0.5\n");
  const ResultTable results = read_results({folder / "a", folder / "b", folder / "c"});
  const Overlay overlay = overlay_of(results);
  ASSERT_EQ(overlay.runs.size(), 3U);
  EXPECT_EQ(overlay.groups.size(), 3U);
  EXPECT_EQ(overlay.runs[0].world, overlay.runs[1].world);
  EXPECT_NE(overlay.runs[0].world, overlay.runs[2].world);

  const auto json = overlay_json(overlay);
  EXPECT_EQ(json["axes"]["time_s"]["end"], 29);
  const auto whole = test::read_quantised(json["runs"][0]["time_s"]["area_fraction"]);
  const auto shorter = test::read_quantised(json["runs"][1]["time_s"]["area_fraction"]);
  ASSERT_EQ(whole.size(), 400U);
  ASSERT_EQ(shorter.size(), 400U);
  EXPECT_TRUE(std::isnan(whole[0]));  // nothing was scored yet
  EXPECT_NEAR(whole[399], 1 - std::exp(-4 * 29. / 30), 1e-4);
  EXPECT_NEAR(shorter[200], 1 - std::exp(-4 * 14. / 20), 1e-4);  // at 14.5 s, that of 14 s
  EXPECT_TRUE(std::isnan(shorter[399]));                         // it had landed long before

  const std::string html = comparison_report_html(results, "runs", folder.path());
  const std::size_t at = html.find("<section id=\"paths\">");
  ASSERT_NE(at, std::string::npos);
  const std::string paths = html.substr(at, html.find("</section>", at) - at);
  const auto count = [&](const std::string& part) {
    std::size_t n = 0;
    for (std::size_t i = paths.find(part); i != std::string::npos; i = paths.find(part, i + 1)) ++n;
    return n;
  };
  EXPECT_EQ(count("<svg "), 2U);
  EXPECT_EQ(count("<image "), 2U);
  EXPECT_EQ(count("<polyline class=\"run\" style=\"stroke:var(--line-"), 3U);
}

TEST(ComparisonReport, ColoursConfigurationsWhereRunsAreMany) {
  const TemporaryFolder folder;
  ResultTable results;
  results.keys = {"k"};
  results.table.columns = {"k", "seed", "failure", "detail"};
  for (int i = 0; i < 80; ++i) {
    const std::filesystem::path run = folder / std::to_string(i);
    std::filesystem::create_directory(run);
    write_text(run / "resolved.yaml", "seed: 1\n");
    results.folders.push_back(run);
    results.table.rows.push_back({std::to_string(i % 8), std::to_string(i), "", ""});
  }
  const Overlay overlay = overlay_of(results);
  EXPECT_EQ(overlay.all_groups, 8U);
  EXPECT_EQ(overlay.groups, (std::vector<std::string>{"k 0", "k 1", "k 2", "k 3", "k 4", "k 5"}));
  EXPECT_EQ(overlay.runs.size(), 6 * 8U);
  EXPECT_TRUE(overlaid_paths_html(results, overlay).empty());  // none has a path
}

TEST(ComparisonReport, TablesTheRunsWithoutAScript) {
  const TemporaryFolder folder;
  test::write_synthetic_sweep(folder.path());
  const std::string html =
      comparison_report_html(read_results({folder.path()}), "sweep", folder.path());
  EXPECT_TRUE(contains(html,
                       "<a href=\"./runs/0000000000000000/\">inflation_m 0.3, weight_direction 1, "
                       "seed 1</a></td><td class=\"word\">succeeded</td>"));
  EXPECT_TRUE(contains(html, "<th>area covered, %</th>"));
  EXPECT_FALSE(contains(html, "</h2>\n</section>"));
}

ResultTable table_of(const std::string& csv) {
  ResultTable results;
  results.keys = {"scenario"};
  results.table = parse_table(csv);
  results.folders.assign(results.table.rows.size(), "nowhere/run");
  return results;
}

TEST(ComparisonReport, DigitsOfSeedsAndHashesAreNoNumbers) {
  const auto payload = comparison_payload(
      table_of("scenario,seed,failure,detail,outcome,trajectory_hash,distance_m,map.points\n"
               "007,18446744073709551615,,,succeeded,1234567890123456,12.5,3\n"
               "1e3,9007199254740993,,,succeeded,12e4567890123456,,4\n"),
      ".");
  EXPECT_EQ(payload["rows"].dump(),
            R"([["007","18446744073709551615",null,null,"succeeded","1234567890123456",12.5,3.0],)"
            R"(["1e3","9007199254740993",null,null,"succeeded","12e4567890123456",null,4.0]])");
  EXPECT_EQ(payload["figures"]["distance_m"].dump(),
            R"({"label":"distance flown","unit":"m","better":-1,"main":true})");
  EXPECT_FALSE(payload["figures"].contains("detail"));
}

TEST(ComparisonReport, OnlyAnOutcomeMakesASuccess) {
  const auto html = [](const std::string& csv) {
    return comparison_report_html(table_of(csv), "runs", ".");
  };
  const std::string mixed = html(
      "scenario,seed,failure,detail,outcome,reason\n"
      "a,1,,,succeeded,mission done\n"
      "a,2,missing,,,\na,3,,,interrupted,signal\na,,unfinished,,,\n"
      "a,4,,,,\n");
  EXPECT_TRUE(contains(mixed, "<dt>succeeded</dt><dd>1<small>of 2 flown</small>")) << mixed;
  EXPECT_TRUE(contains(mixed, "<dt>without outcome</dt><dd>1</dd>"));
  EXPECT_TRUE(contains(mixed, "<dt>seeds</dt><dd>4</dd>"));
  const std::string none = html("scenario,seed,failure,detail,outcome\na,1,missing,,\n");
  EXPECT_TRUE(contains(none, "<dt>succeeded</dt><dd>0<small>none was flown</small></dd>"));
  const std::string empty = html("scenario,seed,failure,detail,outcome\n");
  EXPECT_TRUE(contains(empty, "No run was flown"));
  EXPECT_FALSE(contains(empty, "every run succeeded"));
}

TEST(ComparisonReport, LinksToTheRunsThatAreThere) {
  const TemporaryFolder folder;
  test::write_synthetic_sweep(folder.path());
  const ResultTable results = read_results({folder.path()});
  auto links = comparison_payload(results, folder.path())["links"];
  EXPECT_EQ(links[0], "./runs/0000000000000000/");
  EXPECT_EQ(links[1], "");
  std::filesystem::create_directory(folder / "runs/0000000000000009.failed");
  EXPECT_EQ(read_results({folder.path()}).folders[9], folder / "runs/0000000000000009.failed");
  write_text(folder / "runs/0000000000000000/report.html", "");
  links = comparison_payload(results, folder.path())["links"];
  EXPECT_EQ(links[0], "./runs/0000000000000000/report.html");
}

TEST(ComparisonReport, LinksSurviveOddNames) {
  const TemporaryFolder folder;
  const std::string name = "a b#1?";
  std::filesystem::create_directory(folder / name);
  write_text(folder / name / "resolved.yaml", "seed: 1\n");
  const ResultTable results = read_results({folder / name});
  EXPECT_EQ(comparison_payload(results, folder.path())["links"][0], "./a%20b%231%3F/");
}

TEST(ComparisonReport, TakesWhatDiffersBetweenRunsFromTheirConfiguration) {
  const TemporaryFolder folder;
  for (const auto& [name, text] :
       {std::pair{"a", "seed: 1\nplanning:\n  inflation_m: 0.3\n  limits: [1, 2]\n"},
        {"b", "seed: 2\nplanning:\n  inflation_m: 0.5\n  limits: [1, 3]\n"}}) {
    std::filesystem::create_directory(folder / name);
    write_text(folder / name / "resolved.yaml", text);
  }
  write_text(folder / "a/summary.json",
             R"({"outcome": "succeeded", "scenario": "s", "seed": 1, "map": {"p95_m": 0.5},)"
             R"( "coverage": null, "targets": [1, 2]})");
  const ResultTable results = read_results({folder / "a", folder / "b"});
  EXPECT_EQ(results.keys,
            (std::vector<std::string>{"scenario", "planning.inflation_m", "planning.limits"}));
  EXPECT_EQ(results.table.text(0, "planning.limits"), "1 2");
  EXPECT_EQ(results.table.text(1, "planning.inflation_m"), "0.5");
  EXPECT_EQ(results.table.text(0, "map.p95_m"), "0.5");
  EXPECT_EQ(results.table.text(0, "targets.count"), "2");
  EXPECT_EQ(results.table.text(1, "failure"), "unfinished");
}

TEST(ComparisonReport, KeepsTheMainFiguresOfAVastSweep) {
  ResultTable results;
  results.keys = {"k"};
  results.table.columns = {"k", "seed", "failure", "detail", "outcome", "sim_time_s"};
  for (int i = 0; i < 60; ++i) results.table.columns.push_back("figure" + std::to_string(i));
  for (int i = 0; i < 10'000; ++i) {
    std::vector<std::string> row(results.table.columns.size(), "1.234567");
    results.table.rows.push_back(row);
    results.folders.emplace_back("nowhere/0123456789abcdef");
  }
  const auto payload = comparison_payload(results, "nowhere");
  EXPECT_EQ(payload["columns"],
            (nlohmann::ordered_json{"k", "seed", "failure", "outcome", "sim_time_s"}));
  EXPECT_EQ(payload["rows"].size(), 10'000U);
  EXPECT_LT(payload.dump().size(), 3'000'000U);
}

TEST(ComparisonReport, RefusesWhatIsNeitherRunNorSweep) {
  const TemporaryFolder folder;
  EXPECT_THROW(read_results({folder.path()}), ConfigError);
  write_text(folder / "sweep.json", "{}");  // begun, no table yet
  try {
    read_results({folder.path()});
    FAIL() << "read a sweep without a table";
  } catch (const ConfigError& error) {
    EXPECT_TRUE(contains(error.what(), "sweep.csv:1: is not there yet")) << error.what();
  }
}

}  // namespace
}  // namespace arex::sim
