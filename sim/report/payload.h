#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "run/markup.h"

/// How numbers travel inside a report: small, and readable by the viewer without a network.
namespace arex::sim {

std::string base64(std::span<const std::uint8_t> bytes);

/// zlib stream (RFC 1950): what a browser's DecompressionStream('deflate') reads.
std::vector<std::uint8_t> deflated(std::span<const std::uint8_t> bytes);

/// Level of a value that is missing (not a number); the others are 0..65534.
inline constexpr std::uint16_t kMissingLevel = 65535;

/// {"n", "lo", "hi", "data"}: value = lo + level / 65534 * (hi - lo). `data` is base64 of the
/// deflated levels: differences of neighbours modulo 2^16, all low bytes before all high bytes.
/// Half a step of error at most: 0.8 mm over 100 m.
nlohmann::ordered_json quantised(std::span<const double> values);
nlohmann::ordered_json quantised(std::span<const float> values);

/// JSON that may stand inside `<script>`: no '<' appears in it.
std::string json_for_script(const nlohmann::ordered_json& json);

}  // namespace arex::sim
