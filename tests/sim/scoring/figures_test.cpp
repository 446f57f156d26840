#include "scoring/figures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "config/config.h"

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

TEST(FigureList, SaysOfEveryFigureWhatItIs) {
  std::set<std::string> keys;
  for (const FigureInfo& figure : figure_list()) {
    EXPECT_TRUE(keys.insert(figure.key).second) << figure.key << " stands twice";
    EXPECT_FALSE(figure.label.empty()) << figure.key;
    EXPECT_FALSE(figure.meaning.empty()) << figure.key;
    EXPECT_EQ(find_figure(figure.column()), &figure);
    // What the host's load decides makes no run better than another.
    EXPECT_TRUE(!figure.of_host || figure.better == Better::kNeither) << figure.key;
    // The unit is what the key's end says; only the words of a list or a text have none.
    const std::string promised = config_detail::unit_of(figure.key);
    const bool of_class = figure.key.find("_by_class.") != std::string::npos;
    EXPECT_EQ(figure.unit, of_class ? "1" : promised) << figure.key;
  }
  for (const ColumnInfo& column : column_list()) {
    EXPECT_FALSE(column.meaning.empty()) << column.file << " " << column.name;
    if (column.unit.empty()) continue;
    const bool bare = column.name.find('_') == std::string::npos;  // x, y, z of a target
    EXPECT_EQ(column.unit, bare ? "m" : config_detail::unit_of(column.name)) << column.name;
  }
  EXPECT_EQ(find_figure("coverage"), nullptr);
  EXPECT_EQ(find_figure("targets"), nullptr);
  ASSERT_NE(find_figure("targets.count"), nullptr);
}

TEST(Figures, WhatIsNotSetOrNoNumberIsNull) {
  Figures figures;
  figures.set("outcome", "succeeded");
  figures.set("seed", std::uint64_t{18446744073709551615U});
  figures.set("collisions", 0);
  figures.set("coverage.t50_s", std::numeric_limits<double>::quiet_NaN());
  figures.set("map.points", std::size_t{0});
  figures.set("map.median_m", std::numeric_limits<double>::infinity());
  figures.set("exploration.open_frontier_m2", std::optional<double>());
  figures.set("targets", {{{"x", 1.0}, {"time_s", 2.00000049}}});
  const ordered_json json = figures.json();
  EXPECT_EQ(json["outcome"], "succeeded");
  EXPECT_EQ(json["seed"].dump(), "18446744073709551615");
  EXPECT_EQ(json["collisions"].dump(), "0");
  EXPECT_TRUE(json["coverage"].is_null()) << "a section without a value";
  EXPECT_EQ(json["map"]["points"], 0);
  EXPECT_TRUE(json["map"]["median_m"].is_null());
  EXPECT_TRUE(json["exploration"].is_null());
  EXPECT_EQ(json["targets"].dump(), R"([{"x":1.0,"time_s":2.0}])");
  EXPECT_TRUE(json["reason"].is_null());
  EXPECT_EQ(json.begin().key(), "outcome");
}

TEST(Figures, OnlyWhatIsListedCanBeSet) {
  Figures figures;
  EXPECT_THROW(figures.set("coverage.area", 1.0), std::logic_error);
  EXPECT_THROW(figures.set("targets", 1.0), std::logic_error);
  EXPECT_THROW(figures.set("outcome.count", std::vector<Figures::Item>()), std::logic_error);
}

TEST(Csv, ACellWithoutAMeasurementIsEmpty) {
  EXPECT_EQ(csv_number(1.23456, 3), "1.235");
  EXPECT_EQ(csv_number(std::numeric_limits<double>::quiet_NaN(), 3), "");
  EXPECT_EQ(csv_number(std::numeric_limits<double>::infinity(), 3), "");
  EXPECT_EQ(csv_header("timing.csv"), "module,calls,median_ms,p99_ms,total_s\n");
  EXPECT_THROW(csv_header("nothing.csv"), std::logic_error);
}

TEST(Figures, ThoseOfNamedThingsAreKnownByAnyName) {
  const FigureInfo* figure = find_figure("odometries.vio.ate_rmse_m");
  ASSERT_NE(figure, nullptr);
  EXPECT_EQ(figure->key, "odometries.NAME.ate_rmse_m");
  EXPECT_EQ(figure->named("vio").key, "odometries.vio.ate_rmse_m");
  EXPECT_EQ(find_figure("odometries.vio.no_figure"), nullptr);
  EXPECT_EQ(find_figure("odometries.a.b.ate_rmse_m"), nullptr);
  EXPECT_EQ(find_figure("odometries..ate_rmse_m"), nullptr);
  Figures figures;
  figures.set("odometries.vio.ate_rmse_m", 0.25);
  figures.set("odometries.twin.lost_s", 1.5);
  figures.set("device_hashes.lidar", "1");
  figures.set("device_hashes.rear", "2");
  const auto json = figures.json();
  EXPECT_EQ(json["odometries"].size(), 2U);
  EXPECT_EQ(json["odometries"]["vio"]["ate_rmse_m"], 0.25);
  EXPECT_EQ(json["device_hashes"]["rear"], "2");
  EXPECT_EQ(Figures().json()["odometries"], nullptr);
  int named = 0, lidar = 0;
  for (const FigureInfo& info : figures_in(json)) {
    named += info.key == "odometries.vio.ate_rmse_m";
    lidar += info.key == "device_hashes.lidar";
    EXPECT_FALSE(info.is_named()) << info.key;
  }
  EXPECT_EQ(named, 1);
  EXPECT_EQ(lidar, 1);
}

}  // namespace
}  // namespace arex::sim
