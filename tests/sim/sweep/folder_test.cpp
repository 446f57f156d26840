#include <gtest/gtest.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "report/table.h"
#include "run/file_io.h"
#include "run/summary.h"
#include "scoring/figures.h"
#include "support/temporary_folder.h"
#include "sweep/sweep_table.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;
using test::read_text;
using test::TemporaryFolder;
using test::write_text;

TEST(FileLock, KeepsTwoOutAndEndsWithItsHolder) {
  const TemporaryFolder folder;
  {
    FileLock first(folder / "lock", FileLock::Mode::kExclusive);
    ASSERT_TRUE(first.take());
    first.sign();
    FileLock second(folder / "lock", FileLock::Mode::kExclusive);
    EXPECT_FALSE(second.take());
    EXPECT_NE(second.holder().find(std::to_string(getpid())), std::string::npos) << second.holder();
    FileLock reader(folder / "lock", FileLock::Mode::kShared);
    EXPECT_FALSE(reader.take());
  }
  FileLock one(folder / "lock", FileLock::Mode::kShared);
  FileLock two(folder / "lock", FileLock::Mode::kShared);
  EXPECT_TRUE(one.take());
  EXPECT_TRUE(two.take());
  FileLock third(folder / "lock", FileLock::Mode::kExclusive);
  EXPECT_FALSE(third.take());
}

TEST(FileIo, AFileIsReplacedWholeOrLeftAlone) {
  const TemporaryFolder folder;
  write_atomically(folder / "a", "old");
  write_atomically(folder / "a", "new");
  EXPECT_EQ(read_text(folder / "a"), "new");
  std::filesystem::create_directory(folder / "b");
  EXPECT_THROW(write_atomically(folder / "b", "text"), DiskError);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

TEST(FileIo, FilesThatBelongTogetherAreReplacedTogetherOrLeftAlone) {
  const TemporaryFolder folder;
  write_together({{folder / "a", "1"}, {folder / "index", "1"}});
  write_atomically(folder / "b", "1");
  // Of a set that cannot be written whole, nothing is.
  std::filesystem::create_directory(folder / "folder");
  EXPECT_THROW(
      write_together({{folder / "a", "2"}, {folder / "folder", "2"}, {folder / "index", "2"}},
                     {folder / "b"}),
      DiskError);
  for (const char* name : {"a", "b", "index"}) EXPECT_EQ(read_text(folder / name), "1") << name;
  write_together({{folder / "a", "3"}, {folder / "index", "3"}}, {folder / "b", folder / "none"});
  EXPECT_EQ(read_text(folder / "a"), "3");
  EXPECT_EQ(read_text(folder / "index"), "3");
  EXPECT_FALSE(std::filesystem::exists(folder / "b"));
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 3);
}

TEST(Flatten, NamesEveryFieldOnceInItsOrder) {
  const auto summary = ordered_json::parse(
      R"({"outcome":"succeeded","seed":3,"coverage":{"area_fraction":0.95,"t90_s":null},
          "targets":[{"x":1},{"x":2}],"map":null,"ok":true})");
  const std::vector<std::pair<std::string, std::string>> expected{
      {"outcome", "succeeded"},
      {"seed", "3"},
      {"coverage.area_fraction", "0.95"},
      {"coverage.t90_s", ""},
      {"targets.count", "2"},
      {"map", ""},
      {"ok", "true"}};
  EXPECT_EQ(flatten(summary), expected);
}

/// A folder with a plan of three runs that nobody flew.
class SweepFolderTest : public ::testing::Test {
 protected:
  SweepFolderTest() : folder_(temporary_.path()) {
    plan_.name = "test";
    plan_.build = "b";
    plan_.keys = {"a.b"};
    for (const char* id : {"one", "two", "three"}) {
      plan_.runs.push_back({id, "forest", "", {std::string(id) + ", \"x\""}, 1, 1, "seed: 1\n"});
    }
    folder_.prepare(plan_);
  }
  void leave_partial(const std::string& id, const std::string& summary) {
    const auto partial = folder_.root() / SweepFolder::partial(id);
    std::filesystem::create_directories(partial);
    if (!summary.empty()) write_text(partial / "summary.json", summary);
  }
  static std::string summary(const std::string& outcome, const std::string& more = "") {
    return R"({"outcome":")" + outcome + R"(","scenario":"forest","seed":1,"wall_time_s":5)" +
           more + R"(,"build":{"version":"1"}})";
  }

  TemporaryFolder temporary_;
  SweepFolder folder_;
  SweepPlan plan_;
};

TEST_F(SweepFolderTest, OnlyAMissionThatEndedByItselfIsPublished) {
  for (const std::string text : {"", "{", "[1]", R"({"outcome":"succeeded"})"}) {
    leave_partial("one", text);
    EXPECT_FALSE(folder_.publish("one")) << text;
  }
  leave_partial("one", summary("interrupted"));
  EXPECT_FALSE(folder_.publish("one"));
  EXPECT_FALSE(folder_.summary("one"));
  leave_partial("one", summary("collided"));
  EXPECT_TRUE(folder_.publish("one"));
  ASSERT_TRUE(folder_.summary("one"));
  EXPECT_EQ((*folder_.summary("one"))["outcome"], "collided");
  EXPECT_TRUE(folder_.partials().empty());
}

TEST_F(SweepFolderTest, TheFirstToPublishWins) {
  leave_partial("one", summary("succeeded"));
  EXPECT_TRUE(folder_.publish("one"));
  leave_partial("one", summary("collided"));
  EXPECT_TRUE(folder_.publish("one"));
  EXPECT_EQ((*folder_.summary("one"))["outcome"], "succeeded");
  EXPECT_TRUE(folder_.partials().empty());
}

TEST_F(SweepFolderTest, AFailureStandsUntilTheRunIsFinished) {
  EXPECT_EQ(folder_.state("one").failure, Failure::kMissing);
  leave_partial("one", "");
  folder_.record_failure("one", {Failure::kOverran, "killed after 3 s"}, 2);
  EXPECT_EQ(folder_.state("one").failure, Failure::kOverran);
  EXPECT_EQ(folder_.state("one").detail, "killed after 3 s");
  leave_partial("one", summary("succeeded"));
  EXPECT_TRUE(folder_.publish("one"));
  EXPECT_EQ(folder_.state("one").failure, Failure::kNone);
  EXPECT_FALSE(std::filesystem::exists(folder_.root() / SweepFolder::failed("one")));
}

TEST_F(SweepFolderTest, TheTableHasARowForEveryRunAndAColumnForEveryFigure) {
  leave_partial("one", summary("succeeded", R"(,"planner":null,"coverage":{"a":1})"));
  EXPECT_TRUE(folder_.publish("one"));
  leave_partial("two", summary("stuck", R"(,"planner":{"replans":4,"median_ms":2.5},"map":null)"));
  EXPECT_TRUE(folder_.publish("two"));
  const SweepTables tables = sweep_tables(plan_, folder_);
  const Table results = parse_table(tables.results);
  const Table host = parse_table(tables.host);
  ASSERT_EQ(results.rows.size(), 3U);
  ASSERT_EQ(host.rows.size(), 3U);
  EXPECT_EQ(tables.results.find("run,scenario,a.b,seed,failure,detail,outcome,"), 0U)
      << tables.results.substr(0, 120);
  EXPECT_EQ(tables.host.find("run,scenario,a.b,seed,wall_time_s,"), 0U);
  for (const FigureInfo& figure : figure_list()) {
    if (figure.key == "scenario" || figure.key == "seed" || figure.is_named()) continue;
    EXPECT_EQ(results.column(figure.column()).has_value(), !figure.of_host) << figure.key;
    EXPECT_EQ(host.column(figure.column()).has_value(), figure.of_host) << figure.key;
  }
  EXPECT_EQ(results.rows[0][2], "one, \"x\"");
  EXPECT_EQ(results.text(0, "outcome"), "succeeded");
  EXPECT_EQ(results.text(0, "coverage.a"), "1");  // of another version
  EXPECT_EQ(results.text(0, "planner.replans"), "");
  EXPECT_EQ(results.text(1, "planner.replans"), "4");
  EXPECT_EQ(results.text(2, "failure"), "missing");
  EXPECT_EQ(results.text(2, "outcome"), "");
  EXPECT_FALSE(results.column("planner"));  // a section without a value is no column
  EXPECT_FALSE(results.column("map"));
  EXPECT_EQ(host.text(1, "planner.median_ms"), "2.5");
  EXPECT_EQ(host.text(0, "planner.median_ms"), "");
}

}  // namespace
}  // namespace arex::sim
