#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

/// JSON files as they lie on a disk: ours, cut short, or somebody else's.
namespace arex::sim {

/// Null for what is no JSON object, and for what nests deeper than any of our files does: what
/// copies and prints it is recursive.
inline nlohmann::ordered_json parse_object(const std::string& text) {
  using Json = nlohmann::ordered_json;
  constexpr int kDeepest = 32;
  int deepest = 0;
  const auto measure = [&deepest](int depth, Json::parse_event_t, Json&) {
    deepest = std::max(deepest, depth);
    return depth <= kDeepest;  // what is deeper is not kept
  };
  Json json = Json::parse(text, measure, false);
  return json.is_object() && deepest <= kDeepest ? json : Json(nullptr);
}

/// The field, or `otherwise` where the object has none of this type.
inline std::string text_field(const nlohmann::ordered_json& object, const char* key,
                              const std::string& otherwise = "") {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : otherwise;
}

}  // namespace arex::sim
