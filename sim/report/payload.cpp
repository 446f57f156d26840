#include "report/payload.h"

#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace arex::sim {
namespace {

template <typename Value>
nlohmann::ordered_json quantise(std::span<const Value> values) {
  double lo = std::numeric_limits<double>::infinity();
  double hi = -lo;
  for (const Value value : values) {
    if (!std::isfinite(value)) continue;
    lo = std::min<double>(lo, value);
    hi = std::max<double>(hi, value);
  }
  if (lo > hi) lo = hi = 0;
  const double scale = hi > lo ? (kMissingLevel - 1) / (hi - lo) : 0.0;

  const std::size_t n = values.size();
  std::vector<std::uint8_t> bytes(2 * n);
  std::uint16_t previous = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint16_t level =
        std::isfinite(values[i]) ? static_cast<std::uint16_t>(std::lround((values[i] - lo) * scale))
                                 : kMissingLevel;
    const auto difference = static_cast<std::uint16_t>(level - previous);
    bytes[i] = static_cast<std::uint8_t>(difference & 0xFF);
    bytes[n + i] = static_cast<std::uint8_t>(difference >> 8);
    previous = level;
  }
  return {{"n", n}, {"lo", lo}, {"hi", hi}, {"data", base64(deflated(bytes))}};
}

}  // namespace

std::string base64(std::span<const std::uint8_t> bytes) {
  static constexpr char kDigits[] =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t left = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = static_cast<std::uint32_t>(bytes[i]) << 16;
    if (left > 1) group |= static_cast<std::uint32_t>(bytes[i + 1]) << 8;
    if (left > 2) group |= bytes[i + 2];
    for (std::size_t digit = 0; digit < 4; ++digit) {
      text += digit <= left ? kDigits[group >> (18 - 6 * digit) & 63] : '=';
    }
  }
  return text;
}

std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::vector<std::uint8_t> out(size);
  if (compress2(out.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 9) != Z_OK) {
    throw std::runtime_error("zlib refuses to compress");
  }
  out.resize(size);
  return out;
}

nlohmann::ordered_json quantised(std::span<const double> values) { return quantise(values); }
nlohmann::ordered_json quantised(std::span<const float> values) { return quantise(values); }

std::string json_for_script(const nlohmann::ordered_json& json) {
  // A stray byte that is no UTF-8 (a name from somebody's file system) becomes U+FFFD.
  const std::string text =
      json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::string safe;
  safe.reserve(text.size());
  for (const char c : text) {
    if (c == '<') {
      safe += "\\u003c";  // inside a string: JSON has it nowhere else
    } else {
      safe += c;
    }
  }
  return safe;
}

}  // namespace arex::sim
