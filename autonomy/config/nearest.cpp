#include "config/nearest.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace arex {
namespace {

constexpr std::size_t kLongest = 64;  // that is worth a guess

// Levenshtein's.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i);
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = std::exchange(row[j], std::min({row[j] + 1, row[j - 1] + 1, substituted}));
    }
  }
  return row.back();
}

// A name that continues or shortens another is what people mean even when the distance is large:
// 'inflation' for 'inflation_m'.
std::size_t dissimilarity(std::string_view given, std::string_view known) {
  const bool prefix = known.starts_with(given) || given.starts_with(known);
  return edit_distance(given, known) / (prefix ? 4 : 1);
}

}  // namespace

std::string nearest(std::string_view given, const std::vector<std::string>& known) {
  given = given.substr(0, kLongest);
  return *std::min_element(known.begin(), known.end(), [&](const auto& a, const auto& b) {
    return dissimilarity(given, a) < dissimilarity(given, b);
  });
}

}  // namespace arex
