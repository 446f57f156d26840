#include "report/payload.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "math/random.h"
#include "quantised_reader.h"

namespace arex::sim {
namespace {

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

// RFC 4648, section 10.
TEST(Payload, Base64MatchesTheStandardsVectors) {
  const std::vector<std::pair<const char*, const char*>> vectors{{"", ""},
                                                                 {"f", "Zg=="},
                                                                 {"fo", "Zm8="},
                                                                 {"foo", "Zm9v"},
                                                                 {"foob", "Zm9vYg=="},
                                                                 {"fooba", "Zm9vYmE="},
                                                                 {"foobar", "Zm9vYmFy"}};
  for (const auto& [plain, coded] : vectors) EXPECT_EQ(base64(bytes_of(plain)), coded) << plain;
  EXPECT_EQ(base64(std::vector<std::uint8_t>{0xFB, 0xFF, 0xBF}), "+/+/");
}

TEST(Payload, QuantisedValuesReadBackWithinHalfAStep) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    RandomStream random(seed, "quantised");
    std::vector<double> values(5000);
    for (double& value : values) value = random.uniform(-70, 30);
    const std::vector<double> back = test::read_quantised(quantised(values));
    ASSERT_EQ(back.size(), values.size());
    const auto [lo, hi] = std::minmax_element(values.begin(), values.end());
    const double half_step = 0.5 * (*hi - *lo) / 65534;
    for (std::size_t i = 0; i < values.size(); ++i) {
      ASSERT_NEAR(back[i], values[i], half_step * 1.0001) << i;
    }
    EXPECT_EQ(back[static_cast<std::size_t>(lo - values.begin())], *lo);
  }
}

TEST(Payload, MissingValuesStayMissing) {
  const double nan = std::nan("");
  const std::vector<double> back =
      test::read_quantised(quantised(std::vector<double>{nan, 1, nan, 3, INFINITY}));
  ASSERT_EQ(back.size(), 5U);
  EXPECT_TRUE(std::isnan(back[0]));
  EXPECT_EQ(back[1], 1);
  EXPECT_TRUE(std::isnan(back[2]));
  EXPECT_EQ(back[3], 3);
  EXPECT_TRUE(std::isnan(back[4]));
}

TEST(Payload, ConstantAndEmptyColumnsNeedNoScale) {
  EXPECT_EQ(test::read_quantised(quantised(std::vector<double>{2, 2, 2})),
            (std::vector<double>{2, 2, 2}));
  EXPECT_TRUE(test::read_quantised(quantised(std::vector<float>{})).empty());
}

TEST(Payload, SmoothColumnsShrink) {
  std::vector<double> values(6000);
  std::iota(values.begin(), values.end(), 0.0);
  EXPECT_LT(quantised(values)["data"].get<std::string>().size(), values.size() / 10);
}

TEST(Payload, HtmlAndScriptsCannotBeLeft) {
  EXPECT_EQ(escape_markup("<b a=\"1\" c='2'>&"), "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;");
  const nlohmann::ordered_json json{{"k", "</script><!-- \xFF"}};
  const std::string script = json_for_script(json);
  EXPECT_EQ(script.find('<'), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(script)["k"], "</script><!-- \xEF\xBF\xBD");
}

}  // namespace
}  // namespace arex::sim
