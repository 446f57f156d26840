#include <gtest/gtest.h>

#include <limits>

#include "config/config.h"
#include "config/text.h"

namespace arex {
namespace {

TEST(Numbers, AreDecimalAndWhole) {
  EXPECT_EQ(parse_uint64("010"), 10u);
  EXPECT_EQ(parse_uint64("08"), 8u);
  EXPECT_EQ(parse_uint64("+7"), 7u);
  EXPECT_EQ(parse_uint64("18446744073709551615"), std::numeric_limits<std::uint64_t>::max());
  for (const char* text :
       {"18446744073709551616", "99999999999999999999999", "-1", "-0", "0x10", "0o17", "0b1",
        "1_000", "1e3", "1.0", "", " 1", "1 ", "+", "+-1", "abc", "\xd9\xa1", "1,000", "NaN"}) {
    EXPECT_FALSE(parse_uint64(text)) << text;
  }
  EXPECT_EQ(parse_int("-2147483648"), std::numeric_limits<int>::min());
  EXPECT_FALSE(parse_int("2147483648"));
  EXPECT_EQ(parse_double("1e3"), 1000.0);
  EXPECT_EQ(parse_double("-.5"), -0.5);
  for (const char* text : {"nan", "inf", "-inf", ".inf", ".nan", "1e400", "0x1p3", "1e", "e1",
                           "--1", "+-1", "1..2", "infinity"}) {
    EXPECT_FALSE(parse_double(text)) << text;
  }
}

struct Timed {
  double burst_s = 1;
  double rate_hz = 10;
  double length_m = 1;
  double decay_per_s = 1;
  std::vector<double> times_s;
  int count = 1;
  std::uint64_t seed = 1;
  void fields(auto& f) {
    f("burst_s", burst_s, "a duration");
    f("rate_hz", rate_hz, "a rate");
    f("length_m", length_m, "a length");
    f("decay_per_s", decay_per_s, "no duration");
    f("times_s", times_s, "several durations");
    f("count", count, "an integer");
    f("seed", seed, "a seed");
  }
};

std::string refusal_of(const std::string& text) {
  try {
    Timed config;
    read_config(parse_yaml(text, "a.yaml"), config);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Numbers, TimesAndRatesFitAClockOfNanoseconds) {
  EXPECT_EQ(refusal_of("burst_s: 1e10\n"),
            "a.yaml:1: 'burst_s' is '1e10', expected at most 1e+09 s");
  EXPECT_EQ(refusal_of("burst_s: -1e300\n").find("a.yaml:1: 'burst_s' is '-1e300'"), 0u);
  EXPECT_EQ(refusal_of("burst_s: 1e-10\n"),
            "a.yaml:1: 'burst_s' is '1e-10', expected 0, or at least 1e-09 s");
  EXPECT_NE(refusal_of("rate_hz: 1e-300\n").find("at least 1e-09 Hz"), std::string::npos);
  EXPECT_NE(refusal_of("rate_hz: 1e12\n").find("at most 1e+09 Hz"), std::string::npos);
  EXPECT_NE(refusal_of("times_s: [1, 2, 1e-12]\n").find("at least"), std::string::npos);
  EXPECT_NE(refusal_of("length_m: 1e9\n").find("at most 1e+06 m"), std::string::npos);
  EXPECT_EQ(refusal_of("{burst_s: 0, rate_hz: 1e9, length_m: 1e-30, decay_per_s: 1e12}\n"),
            "no error");
}

TEST(Numbers, SecondsBecomeTheNearestNanosecondOrForever) {
  EXPECT_EQ(from_seconds(1.5), 1'500'000'000);
  EXPECT_EQ(from_seconds(-1e-9), -1);
  EXPECT_EQ(from_seconds(1e9), 1'000'000'000'000'000'000);
  for (const double endless : {1e10, 1e300, std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(from_seconds(endless), kForever);
    EXPECT_EQ(from_seconds(-endless), -kForever);
  }
  EXPECT_GT(kForever + kForever, kForever);
  EXPECT_GT(kForever, from_seconds(1e9));
}

TEST(Numbers, IntegersThatDoNotFitSayWhatWould) {
  EXPECT_EQ(
      refusal_of("count: 3000000000\n"),
      "a.yaml:1: 'count' is '3000000000', expected an integer from -2147483648 to 2147483647");
  EXPECT_EQ(refusal_of("seed: 18446744073709551616\n"),
            "a.yaml:1: 'seed' is '18446744073709551616', expected an integer from 0 to "
            "18446744073709551615");
  EXPECT_EQ(refusal_of("seed: 010\n"), "no error");
  EXPECT_EQ(refusal_of("seed: 0x10\n"),
            "a.yaml:1: 'seed' is '0x10', expected an integer that is not negative");
  const std::string digits(5000, '9');
  EXPECT_LT(refusal_of("seed: " + digits + "\n").size(), 200u);
}

}  // namespace
}  // namespace arex
