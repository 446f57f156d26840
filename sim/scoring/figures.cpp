#include "scoring/figures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

// Numbers for people: six decimals are more than any of these hold.
double rounded(double value) { return std::round(value * 1e6) / 1e6; }

ordered_json number_json(double value) {
  return std::isfinite(value) ? ordered_json(rounded(value)) : ordered_json(nullptr);
}

// A section without any value becomes null. @return whether there is one
bool fold(ordered_json& node) {
  if (!node.is_object()) return !node.is_null();
  bool any = false;
  for (auto& child : node) any = fold(child) || any;
  if (!any) node = nullptr;
  return any;
}

const std::map<std::string, const FigureInfo*, std::less<>>& by_column() {
  static const auto index = [] {
    std::map<std::string, const FigureInfo*, std::less<>> made;
    for (const FigureInfo& figure : figure_list()) made[figure.column()] = &figure;
    return made;
  }();
  return index;
}

}  // namespace

std::string FigureInfo::column() const { return kind == Kind::kList ? key + ".count" : key; }

const FigureInfo* find_figure(std::string_view column) {
  const auto found = by_column().find(column);
  return found == by_column().end() ? nullptr : found->second;
}

std::string csv_header(std::string_view file) {
  std::string line;
  for (const ColumnInfo& column : column_list()) {
    if (column.file != file) continue;
    if (!line.empty()) line += ",";
    line += column.name;
  }
  if (line.empty()) throw std::logic_error("no columns are listed of " + std::string(file));
  return line + "\n";
}

std::string csv_number(double value, int decimals) {
  if (!std::isfinite(value)) return "";
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

void Figures::set(std::string_view key, double value) { put(key, value); }

void Figures::set(std::string_view key, const std::optional<double>& value) {
  if (value) set(key, *value);
}

void Figures::set(std::string_view key, std::string_view text) { put(key, std::string(text)); }

void Figures::set(std::string_view key, std::vector<Item> items) { put(key, std::move(items)); }

void Figures::put(std::string_view key, Value value) {
  const bool is_list = std::holds_alternative<std::vector<Item>>(value);
  if (!find_figure(std::string(key) + (is_list ? ".count" : ""))) {
    throw std::logic_error("no figure is listed as " + std::string(key));
  }
  values_.insert_or_assign(std::string(key), std::move(value));
}

ordered_json Figures::json_of(const Value& value) {
  if (const auto* number = std::get_if<double>(&value)) return number_json(*number);
  if (const auto* count = std::get_if<std::uint64_t>(&value)) return *count;
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  ordered_json list = ordered_json::array();
  for (const Item& item : std::get<std::vector<Item>>(value)) {
    ordered_json& members = list.emplace_back(ordered_json::object());
    for (const auto& [name, number] : item) members[name] = number_json(number);
  }
  return list;
}

ordered_json Figures::json() const {
  ordered_json json = ordered_json::object();
  for (const FigureInfo& figure : figure_list()) {
    std::string pointer = "/" + figure.key;
    std::replace(pointer.begin(), pointer.end(), '.', '/');
    const auto value = values_.find(figure.key);
    json[ordered_json::json_pointer(pointer)] =
        value == values_.end() ? ordered_json(nullptr) : json_of(value->second);
  }
  for (auto& section : json) fold(section);
  return json;
}

}  // namespace arex::sim
