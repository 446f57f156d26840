#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "app/commands.h"
#include "scoring/figures.h"

namespace arex::app {
namespace {

constexpr std::array<const char*, 3> kBetter{"", "more", "less"};

void print_figures() {
  std::size_t width = 0;
  for (const sim::FigureInfo& figure : sim::figure_list()) {
    width = std::max(width, figure.column().size());
  }
  std::printf(
      "summary.json, a key each; a list is called by its length. In sweep.csv, or in "
      "sweep_host.csv\n"
      "where it is a time of the host, a column each. Null or empty: there was nothing to "
      "measure.\n"
      "Key, unit (1: a share), which is better, meaning:\n\n");
  for (const sim::FigureInfo& figure : sim::figure_list()) {
    std::printf("  %-*s  %-5s  %-4s  %s: %s\n", static_cast<int>(width), figure.column().c_str(),
                figure.unit.c_str(), kBetter[static_cast<std::size_t>(figure.better)],
                figure.label.c_str(), figure.meaning.c_str());
  }
}

void print_columns() {
  std::size_t width = 0;
  for (const sim::ColumnInfo& column : sim::column_list()) {
    width = std::max(width, column.name.size());
  }
  std::string file;
  for (const sim::ColumnInfo& column : sim::column_list()) {
    if (column.file != file) std::printf("\n%s\n\n", column.file.c_str());
    file = column.file;
    std::printf("  %-*s  %-5s  %s\n", static_cast<int>(width), column.name.c_str(),
                column.unit.c_str(), column.meaning.c_str());
  }
}

}  // namespace

int help_figures() {
  print_figures();
  print_columns();
  return 0;
}

}  // namespace arex::app
