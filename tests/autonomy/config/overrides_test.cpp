#include <gtest/gtest.h>

#include "config/config.h"

// Whatever is wrong with a value, the message names who gave it: the file's line or the option.
namespace arex {
namespace {

struct Section {
  double low_m = 0;
  double high_m = 10;
  int steps = 1;
  void fields(auto& f) {
    f("low_m", low_m, "lower edge");
    f("high_m", high_m, "upper edge");
    f("steps", steps, "how many");
    f.check(low_m < high_m, "low_m < high_m");
  }
};
struct Root {
  Section one, two;
  int seed = 1;
  void fields(auto& f) {
    f("one", one, "a section");
    f("two", two, "a section");
    f("seed", seed, "the seed");
    f.check(one.steps <= two.steps + 5, "one.steps <= two.steps + 5");
  }
};

std::string refusal_of(const std::string& text, const std::vector<std::string>& overrides) {
  try {
    ConfigNode node = parse_yaml(text, "a.yaml");
    for (const std::string& assignment : overrides) apply_override(node, assignment);
    Root root;
    read_config(node, root);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Overrides, ABrokenRuleNamesWhoGaveItsLastValue) {
  const std::string file = "one:\n  low_m: 1\n  high_m: 2\n";
  EXPECT_EQ(refusal_of(file, {"one.high_m=0"}),
            "--set one.high_m: out of range: expected low_m < high_m");
  EXPECT_EQ(refusal_of(file, {"one.low_m=3"}),
            "--set one.low_m: out of range: expected low_m < high_m");
  EXPECT_EQ(refusal_of(file, {"one.high_m=3", "one.low_m=4"}),
            "--set one.low_m: out of range: expected low_m < high_m");
  EXPECT_EQ(refusal_of("one:\n  low_m: 3\n  high_m: 2\n", {"one.steps=2"}),
            "a.yaml:2: out of range: expected low_m < high_m");
}

TEST(Overrides, ARuleOverSectionsNamesTheKeyNotTheSection) {
  const std::string file = "two:\n  steps: 1\none:\n  low_m: 1\n  steps: 3\n";
  EXPECT_EQ(refusal_of(file, {"one.steps=9"}),
            "--set one.steps: out of range: expected one.steps <= two.steps + 5");
  EXPECT_EQ(refusal_of(file, {"two.steps=-7"}),
            "--set two.steps: out of range: expected one.steps <= two.steps + 5");
  EXPECT_EQ(refusal_of("two:\n  low_m: 1\none:\n  low_m: 1\n  steps: 9\n", {}),
            "a.yaml:5: out of range: expected one.steps <= two.steps + 5");
}

TEST(Overrides, OfNothingNameTheirKey) {
  EXPECT_EQ(refusal_of("seed: 5\n", {"one.steps="}).find("--set one.steps: "), 0U)
      << refusal_of("seed: 5\n", {"one.steps="});
}

TEST(Overrides, GoIntoSectionsOnly) {
  EXPECT_EQ(refusal_of("one: 5\n", {"one.steps=2"}),
            "--set one.steps: goes into '5' of a.yaml:1, expected a map of keys there");
  EXPECT_EQ(refusal_of("one:\n", {"one.steps=2"}), "no error");
  EXPECT_EQ(refusal_of("seed: 5\n", {"seed.x=2"}),
            "--set seed.x: goes into '5' of a.yaml:1, expected a map of keys there");
  for (const char* assignment : {"=1", "seed", "one..steps=1", ".seed=1", "one.=1", ""}) {
    EXPECT_EQ(refusal_of("seed: 5\n", {assignment}).find("--set "), 0u) << assignment;
  }
}

TEST(Overrides, AreReadAsStrictlyAsFiles) {
  EXPECT_EQ(refusal_of("seed: 5\n", {"seed=&a [*a]"}).find("--set seed: an alias"), 0u);
  EXPECT_EQ(refusal_of("seed: 5\n", {"seed=1\n---\n2"}).find("--set seed: a second document"), 0u);
  EXPECT_EQ(refusal_of("seed: 5\n", {"seed=[1"}).find("--set seed: a key must be a plain word"),
            0u);
  EXPECT_EQ(refusal_of("seed: 5\n", {"seed=\x1b[31m"}).find("--set seed: control character \\x1b"),
            0u);
  EXPECT_EQ(refusal_of("seed: 5\n", {"one={low_m: 1, steps: many}"}),
            "--set one: 'steps' is 'many', expected an integer");
  EXPECT_EQ(refusal_of("seed: 5\n", {"one={lowm: 1}"}),
            "--set one: unknown key 'lowm'; did you mean 'low_m'?");
  const std::string digits(310, '1');
  EXPECT_LT(refusal_of("seed: 5\n", {"seed=" + digits}).size(), 200u);
}

}  // namespace
}  // namespace arex
