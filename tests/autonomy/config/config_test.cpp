#include "config/config.h"

#include <gtest/gtest.h>

#include <limits>

namespace arex {
namespace {

enum class Colour { kRed, kGreen };
constexpr std::array<std::string_view, 2> enum_names(Colour) { return {"red", "green"}; }

struct Waypoint {
  Vec3 position_m = Vec3::Zero();
  double hold_s = 0;
  void fields(auto& f) {
    f("position_m", position_m, "where");
    f("hold_s", hold_s, "how long");
  }
};

struct Inner {
  double inflation_m = 0.5;
  int steps = 3;
  void fields(auto& f) {
    f("inflation_m", inflation_m, "obstacle expansion");
    f("steps", steps, "how many");
    f.check(inflation_m >= 0, "inflation_m >= 0");
    f.check(steps > 0, "steps > 0");
  }
};

struct Outer {
  std::uint64_t seed = 1;
  bool enabled = true;
  std::string name = "plain";
  Colour colour = Colour::kRed;
  Vec3 offset_m{1, 2, 3};
  std::vector<Waypoint> waypoints;
  std::vector<double> values{0.1, 1e-300};
  Inner planning;
  void fields(auto& f) {
    f("seed", seed, "the seed");
    f("enabled", enabled, "a switch");
    f("name", name, "a text");
    f("colour", colour, "a choice");
    f("offset_m", offset_m, "a vector");
    f("waypoints", waypoints, "a list of maps");
    f("values", values, "a list");
    f("planning", planning, "a section");
  }
};

Outer read(const std::string& text, const std::vector<std::string>& overrides = {}) {
  ConfigNode node = parse_yaml(text, "a.yaml");
  for (const auto& assignment : overrides) apply_override(node, assignment);
  Outer config;
  read_config(node, config);
  return config;
}

std::string error_of(const std::string& text, const std::vector<std::string>& overrides = {}) {
  try {
    read(text, overrides);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Config, ReadsEveryKindOfField) {
  const Outer c = read(
      "seed: 18446744073709551615\nenabled: false\nname: a b\ncolour: green\n"
      "offset_m: [0.1, -2, 3e2]\nwaypoints:\n  - {position_m: [1, 2, 3], hold_s: 4}\n"
      "  - position_m: [0, 0, 0]\nvalues: []\nplanning:\n  inflation_m: 0.25\n");
  EXPECT_EQ(c.seed, std::numeric_limits<std::uint64_t>::max());
  EXPECT_FALSE(c.enabled);
  EXPECT_EQ(c.name, "a b");
  EXPECT_EQ(c.colour, Colour::kGreen);
  EXPECT_EQ(c.offset_m, Vec3(0.1, -2, 300));
  ASSERT_EQ(c.waypoints.size(), 2u);
  EXPECT_EQ(c.waypoints[0].hold_s, 4);
  EXPECT_TRUE(c.values.empty());
  EXPECT_EQ(c.planning.inflation_m, 0.25);
  EXPECT_EQ(c.planning.steps, 3);  // absent keys keep the default
}

TEST(Config, WrittenYamlReadsBackToTheSameBits) {
  Outer c = read("", {"planning.inflation_m=0.1", "seed=7"});
  c.offset_m = Vec3(1.0 / 3, std::nextafter(1.0, 2.0), -1e-17);
  c.name = "with \"quotes\" and \\";
  c.waypoints.resize(2);
  c.waypoints[1].hold_s = 0.1 + 0.2;
  const std::string text = write_yaml(list_parameters(c));
  const Outer again = read(text);
  EXPECT_EQ(again.offset_m, c.offset_m);
  EXPECT_EQ(again.name, c.name);
  EXPECT_EQ(again.waypoints.at(1).hold_s, c.waypoints[1].hold_s);
  EXPECT_EQ(again.values, c.values);
  EXPECT_EQ(write_yaml(list_parameters(again)), text);
}

TEST(Config, OverridesReplaceWhatTheFileSays) {
  const Outer c = read("planning: {inflation_m: 0.3}\n",
                       {"planning.inflation_m=0.75", "colour=green", "offset_m=[4, 5, 6]"});
  EXPECT_EQ(c.planning.inflation_m, 0.75);
  EXPECT_EQ(c.colour, Colour::kGreen);
  EXPECT_EQ(c.offset_m, Vec3(4, 5, 6));
}

TEST(Config, NamesFileLineAndTheNearestKnownKey) {
  EXPECT_EQ(error_of("seed: 1\nplanning:\n  inflation: 0.5\n"),
            "a.yaml:3: unknown key 'inflation'; did you mean 'inflation_m'?");
  EXPECT_EQ(error_of("sed: 1\n"), "a.yaml:1: unknown key 'sed'; did you mean 'seed'?");
  EXPECT_EQ(error_of("", {"planing.steps=1"}),
            "--set planing.steps: unknown key 'planing'; did you mean 'planning'?");
}

TEST(Config, RejectsWrongTypes) {
  EXPECT_EQ(error_of("planning:\n  steps: 1.5\n"),
            "a.yaml:2: 'steps' is '1.5', expected an integer");
  EXPECT_EQ(error_of("\nenabled: yes\n"), "a.yaml:2: 'enabled' is 'yes', expected true or false");
  EXPECT_EQ(error_of("seed: -1\n"),
            "a.yaml:1: 'seed' is '-1', expected an integer that is not negative");
  EXPECT_EQ(error_of("colour: blue\n"), "a.yaml:1: 'colour' is 'blue', expected one of red green");
  EXPECT_EQ(error_of("planning: 3\n"), "a.yaml:1: 'planning' is '3', expected a map of keys");
  EXPECT_EQ(error_of("offset_m: [1, 2]\n"),
            "a.yaml:1: 'offset_m' has 2 items, expected a list of 3 numbers");
  EXPECT_EQ(error_of("waypoints: {a: 1}\n"),
            "a.yaml:1: 'waypoints' is a map, expected a list [..]");
  EXPECT_EQ(error_of("planning:\n  inflation_m:\n"),
            "a.yaml:2: 'inflation_m' is nothing, expected a finite number");
}

TEST(Config, RejectsNumbersThatAreNotFinite) {
  for (const char* text : {".nan", ".inf", "-.inf", "nan", "inf", "1e999"}) {
    EXPECT_NE(
        error_of(std::string("planning: {inflation_m: ") + text + "}\n").find("a finite number"),
        std::string::npos)
        << text;
  }
}

TEST(Config, RejectsBrokenRulesAtTheLineOfTheKey) {
  EXPECT_EQ(error_of("planning:\n  steps: 4\n  inflation_m: -1\n"),
            "a.yaml:3: out of range: expected inflation_m >= 0");
  EXPECT_EQ(error_of("planning:\n  steps: 0\n"), "a.yaml:2: out of range: expected steps > 0");
  EXPECT_EQ(error_of("", {"planning.steps=0"}),
            "--set planning.steps: out of range: expected steps > 0");
}

TEST(Config, RejectsDuplicateKeysAndBrokenFiles) {
  EXPECT_EQ(error_of("seed: 1\nname: x\nseed: 2\n"),
            "a.yaml:3: duplicate key 'seed', expected each key once");
  EXPECT_EQ(error_of("planning:\n  steps: 1\n  steps: 1\n"),
            "a.yaml:3: duplicate key 'steps', expected each key once");
  EXPECT_EQ(error_of("seed: [1\nname: 2\n").substr(0, 7), "a.yaml:");
  EXPECT_NE(error_of("seed: [1\nname: 2\n").find("not valid YAML"), std::string::npos);
  EXPECT_EQ(error_of("- 1\n"), "a.yaml:1: the file holds a list, expected keys");
  EXPECT_NE(error_of("", {"seed"}).find("expected key=value"), std::string::npos);
  EXPECT_THROW(load_yaml("/does/not/exist.yaml"), ConfigError);
  EXPECT_THROW(load_yaml("/tmp"), ConfigError);
}

/// A section whose keys depend on the kind of thing that it names.
struct Vehicle {
  struct Car {
    int wheels = 4;
    void fields(auto& f) { f("wheels", wheels, "on the road"); }
  };
  struct Boat {
    double draught_m = 1.5;
    void fields(auto& f) {
      f("draught_m", draught_m, "below the water");
      f.check(draught_m > 0, "draught_m > 0");
    }
  };
  std::string name, kind;
  ConfigNode own;

  void read(std::string_view given, const ConfigNode& section) {
    name = given;
    const ConfigNode* named = section.find("kind");
    if (named) config_detail::parse_scalar(*named, "kind", kind);
    own = section;
    std::erase_if(own.entries, [](const auto& entry) { return entry.key == "kind"; });
    static_cast<void>(parameters());
  }
  [[nodiscard]] std::vector<ParameterInfo> parameters() const {
    std::vector<ParameterInfo> all{{"kind", kind, "", "of vehicle"}};
    const auto more = kind == "boat" ? given_parameters<Boat>(own) : given_parameters<Car>(own);
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};
struct Fleet {
  std::map<std::string, Vehicle> vehicles;
  std::map<std::string, Vehicle::Boat> boats;
  void fields(auto& f) {
    f("vehicles", vehicles, "by name");
    f("boats", boats, "by name");
  }
};

TEST(Config, ReadsSectionsByNameWhoseKeysDependOnWhatTheySay) {
  Fleet fleet;
  read_config(parse_yaml("vehicles:\n  ann: {kind: boat, draught_m: 0.7}\n  bob: {kind: car}\n"
                         "boats: {}\n",
                         "a.yaml"),
              fleet);
  ASSERT_EQ(fleet.vehicles.size(), 2U);
  EXPECT_EQ(fleet.vehicles.at("ann").name, "ann");
  const std::string text = write_yaml(list_parameters(fleet));
  EXPECT_EQ(text,
            "vehicles:\n  ann:\n    kind: boat\n    draught_m: 0.7\n  bob:\n    kind: car\n"
            "boats: {}\n");
  Fleet again;
  read_config(parse_yaml(text, "b.yaml"), again);
  EXPECT_EQ(write_yaml(list_parameters(again)), text);
}

TEST(Config, StaysStrictInSectionsByName) {
  const auto error = [](const std::string& yaml) -> std::string {
    Fleet fleet;
    try {
      read_config(parse_yaml(yaml, "a.yaml"), fleet);
    } catch (const ConfigError& refused) {
      return refused.what();
    }
    return "no error";
  };
  EXPECT_EQ(error("vehicles: {ann: {kind: boat, wheels: 4}}\n"),
            "a.yaml:1: unknown key 'wheels'; did you mean 'draught_m'?");
  EXPECT_EQ(error("vehicles:\n  ann: {kind: boat, draught_m: -1}\n"),
            "a.yaml:2: out of range: expected draught_m > 0");
  EXPECT_EQ(error("boats: [1]\n"),
            "a.yaml:1: 'boats' is a list, expected a map of sections by name");
  EXPECT_EQ(error("boats: {ann: 3}\n"), "a.yaml:1: 'ann' is '3', expected a map of keys");
  EXPECT_EQ(error("boats:\n  a.b: {}\n"),
            "a.yaml:2: the name 'a.b', expected at most 40 letters, digits and underscores");
  EXPECT_NE(error("boats: {" + std::string(41, 'x') + ": {}}\n").find("expected at most 40"),
            std::string::npos);
}

TEST(Config, ListsKeysUnitsAndMeanings) {
  const auto list = list_parameters(Outer{});
  const auto found = std::find_if(list.begin(), list.end(),
                                  [](const auto& p) { return p.key == "planning.inflation_m"; });
  ASSERT_NE(found, list.end());
  EXPECT_EQ(found->value, "0.5");
  EXPECT_EQ(found->unit, "m");
  EXPECT_EQ(found->meaning, "obstacle expansion");
}

}  // namespace
}  // namespace arex
