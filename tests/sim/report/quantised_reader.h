#pragma once

#include <zlib.h>

#include <array>
#include <cstdint>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace arex::sim::test {

/// What scripts/report/src/payload.ts does, once more and independently of the writer.
inline std::vector<double> read_quantised(const nlohmann::ordered_json& q) {
  const auto n = q.at("n").get<std::size_t>();
  const double lo = q.at("lo").get<double>();
  const double hi = q.at("hi").get<double>();
  std::array<int, 256> digit{};
  digit.fill(-1);
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < 64; ++i) {
    digit[static_cast<unsigned char>(digits[i])] = static_cast<int>(i);
  }
  std::vector<std::uint8_t> packed;
  unsigned bits = 0, count = 0;
  for (const char c : q.at("data").get<std::string>()) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digit[static_cast<unsigned char>(c)]);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    packed.push_back(static_cast<std::uint8_t>(bits >> count & 0xFF));
  }
  std::vector<std::uint8_t> bytes(2 * n + 1);
  uLongf size = bytes.size();
  if (uncompress(bytes.data(), &size, packed.data(), packed.size()) != Z_OK || size != 2 * n) {
    throw std::runtime_error("not what zlib wrote");
  }
  std::vector<double> values;
  unsigned level = 0;
  for (std::size_t i = 0; i < n; ++i) {
    level = (level + bytes[i] + 256U * bytes[n + i]) % 65536;
    values.push_back(level == 65535 ? std::numeric_limits<double>::quiet_NaN()
                                    : lo + level / 65534.0 * (hi - lo));
  }
  return values;
}

}  // namespace arex::sim::test
