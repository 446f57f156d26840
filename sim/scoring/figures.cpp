#include "scoring/figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
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

bool FigureInfo::is_named() const { return key.find(kNamePart) != std::string::npos; }

std::optional<std::string> FigureInfo::name_in(std::string_view column) const {
  const std::size_t at = key.find(kNamePart);
  if (at == std::string::npos || kind == Kind::kList) return std::nullopt;
  const std::string_view before(key.data(), at);
  const std::string_view after = std::string_view(key).substr(at + kNamePart.size());
  if (column.size() <= before.size() + after.size() || !column.starts_with(before) ||
      !column.ends_with(after)) {
    return std::nullopt;
  }
  std::string name(column.substr(at, column.size() - before.size() - after.size()));
  return name.find('.') == std::string::npos ? std::optional(name) : std::nullopt;
}

FigureInfo FigureInfo::named(std::string_view name) const {
  FigureInfo figure = *this;
  figure.key.replace(key.find(kNamePart), kNamePart.size(), name);
  figure.label += ", " + std::string(name);
  return figure;
}

const FigureInfo* find_figure(std::string_view column) {
  const auto found = by_column().find(column);
  if (found != by_column().end()) return found->second;
  for (const FigureInfo& figure : figure_list()) {
    if (figure.name_in(column)) return &figure;
  }
  return nullptr;
}

std::vector<FigureInfo> figures_in(const ordered_json& summary) {
  std::vector<FigureInfo> figures;
  for (const FigureInfo& figure : figure_list()) {
    if (!figure.is_named()) {
      figures.push_back(figure);
      continue;
    }
    const auto section = summary.find(figure.key.substr(0, figure.key.find('.')));
    if (section == summary.end() || !section->is_object()) continue;
    for (const auto& [name, values] : section->items()) {
      FigureInfo named = figure.named(name);
      if (!by_column().contains(named.column())) figures.push_back(std::move(named));
    }
  }
  return figures;
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
  return fmt::format("{:.{}f}", value, decimals);
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
  const auto put = [&](const std::string& key, const ordered_json& value) {
    std::string pointer = "/" + key;
    std::replace(pointer.begin(), pointer.end(), '.', '/');
    json[ordered_json::json_pointer(pointer)] = value;
  };
  for (const FigureInfo& figure : figure_list()) {
    if (figure.is_named()) {
      for (const auto& [key, value] : values_) {
        if (figure.name_in(key)) put(key, json_of(value));
      }
      const std::string section = figure.key.substr(0, figure.key.find('.'));
      if (!json.contains(section)) json[section] = nullptr;
      continue;
    }
    const auto value = values_.find(figure.key);
    put(figure.key, value == values_.end() ? ordered_json(nullptr) : json_of(value->second));
  }
  for (auto& section : json) fold(section);
  return json;
}

}  // namespace arex::sim
