#include "report/comparison_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "config/config.h"
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
  EXPECT_TRUE(contains(html, "<dt>succeeded</dt><dd>22</dd>"));
  EXPECT_TRUE(contains(html, "<dt>crashed</dt><dd>1</dd>"));
  EXPECT_TRUE(contains(html, "<td class=\"text\">signal 11, &lt;core&gt;</td>"));
  EXPECT_TRUE(contains(html, "<td class=\"text\">hit trunk 4 at 1.20 m/s</td>"));
}

TEST(ComparisonReport, SeedsStayTheDigitsThatTheyAre) {
  const TemporaryFolder folder;
  write_text(folder / "sweep.csv",
             "run,scenario,seed,failure,detail,outcome,distance_m\n"
             "0,one,18446744073709551615,,,succeeded,3.5\n"
             "1,one,9007199254740993,,,succeeded,4.5\n");
  const auto payload = comparison_payload(read_results({folder.path()}), folder.path());
  const std::vector<std::string> columns = payload["columns"];
  const auto column = std::find(columns.begin(), columns.end(), "seed") - columns.begin();
  EXPECT_EQ(payload["rows"][0][static_cast<std::size_t>(column)], "18446744073709551615");
  EXPECT_EQ(payload["rows"][1][static_cast<std::size_t>(column)], "9007199254740993");
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
