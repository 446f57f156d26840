#include "report/map_picture.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "files/png.h"
#include "report/payload.h"
#include "report/svg.h"
#include "report/targets.h"

namespace arex::sim {
namespace {

constexpr double kCloudCell = 0.2;             // m, of the stand-in for a 2D map
constexpr std::size_t kMaxPath = 3000;         // corners of a drawn path
constexpr std::size_t kMaxOverlaidPath = 800;  // likewise, of one among many

/// A picture of few colours and its place in O.
struct Backdrop {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> indices;  ///< rows from the top
  double x_m = 0;                     ///< left edge
  double y_m = 0;                     ///< top edge
  double cell_m = 0;
};

// Red, green, blue, opacity. Greys of middling lightness, so that light and dark pages both carry
// them.
constexpr std::array<std::array<std::uint8_t, 4>, 4> kPalette = {
    {{0, 0, 0, 0}, {128, 140, 160, 46}, {110, 122, 140, 150}, {92, 104, 124, 255}}};
constexpr std::uint8_t kUnknown = 0, kFree = 1, kSparse = 2, kOccupied = 3;

std::string png_data_uri(const Backdrop& backdrop) {
  const std::string png = png_bytes(backdrop.width, backdrop.height, backdrop.indices, kPalette);
  return "data:image/png;base64," +
         base64({reinterpret_cast<const std::uint8_t*>(png.data()), png.size()});
}

// The known part of the map.
Backdrop backdrop_of(const RecordedMap& map) {
  const auto at = [&](int x, int y) {
    return map.cells[static_cast<std::size_t>(y) * static_cast<std::size_t>(map.width) +
                     static_cast<std::size_t>(x)];
  };
  int x0 = map.width, x1 = -1, y0 = map.height, y1 = -1;
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (at(x, y) == 205) continue;
      x0 = std::min(x0, x);
      x1 = std::max(x1, x);
      y0 = std::min(y0, y);
      y1 = std::max(y1, y);
    }
  }
  if (x1 < 0) return {};
  Backdrop backdrop;
  backdrop.width = x1 - x0 + 1;
  backdrop.height = y1 - y0 + 1;
  backdrop.cell_m = map.resolution_m;
  backdrop.x_m = map.origin_x_m + x0 * map.resolution_m;
  backdrop.y_m = map.origin_y_m + (map.height - y0) * map.resolution_m;
  for (int y = y0; y <= y1; ++y) {
    for (int x = x0; x <= x1; ++x) {
      const std::uint8_t cell = at(x, y);
      backdrop.indices.push_back(cell < 100 ? kOccupied : cell > 230 ? kFree : kUnknown);
    }
  }
  return backdrop;
}

Backdrop backdrop_of(const std::vector<Vec3f>& points_O) {
  if (points_O.empty()) return {};
  Eigen::AlignedBox2f box;
  for (const Vec3f& p : points_O) {
    if (p.allFinite()) box.extend(p.head<2>());
  }
  // Points that lie anywhere, as in a damaged file, make no picture.
  constexpr float kMostCells = 4000;
  if (box.isEmpty() || !(box.sizes().maxCoeff() < kMostCells * kCloudCell)) return {};
  Backdrop backdrop;
  backdrop.cell_m = kCloudCell;
  backdrop.x_m = box.min().x();
  backdrop.y_m = box.max().y();
  backdrop.width = 1 + static_cast<int>(box.sizes().x() / kCloudCell);
  backdrop.height = 1 + static_cast<int>(box.sizes().y() / kCloudCell);
  std::vector<int> counts(static_cast<std::size_t>(backdrop.width) *
                          static_cast<std::size_t>(backdrop.height));
  for (const Vec3f& p : points_O) {
    if (!p.allFinite()) continue;
    const auto x = static_cast<std::size_t>((p.x() - box.min().x()) / kCloudCell);
    const auto y = static_cast<std::size_t>((box.max().y() - p.y()) / kCloudCell);
    ++counts[y * static_cast<std::size_t>(backdrop.width) + x];
  }
  for (const int count : counts) {
    backdrop.indices.push_back(count == 0  ? kUnknown
                               : count < 3 ? kFree
                               : count < 8 ? kSparse
                                           : kOccupied);
  }
  return backdrop;
}

std::string points_text(const std::vector<TimedPose>& poses, std::size_t most) {
  std::string points;
  const std::size_t step = poses.size() / most + 1;
  for (std::size_t i = 0; i < poses.size(); i += step) {
    points += fmt::format("{:.2f},{:.2f} ", poses[i].X.p.x(), -poses[i].X.p.y());
  }
  return points + fmt::format("{:.2f},{:.2f}", poses.back().X.p.x(), -poses.back().X.p.y());
}

std::string polyline(const std::vector<TimedPose>& poses, const char* name) {
  if (poses.empty()) return {};
  return "<polyline class=\"" + std::string(name) + "\" points=\"" + points_text(poses, kMaxPath) +
         "\"/>\n";
}

std::string circle(double x, double y, double radius, const char* name, const std::string& title) {
  return fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" class=\"{}\">", x, -y,
                     radius, name) +
         "<title>" + escape_markup(title) + "</title></circle>\n";
}

// Kept candidates of every decision as small dots.
std::string candidates_svg(const Table& decisions, double radius) {
  const auto x = decisions.numbers("x_m");
  const auto y = decisions.numbers("y_m");
  std::string path;
  constexpr std::size_t kMaxDots = 4000;
  const std::size_t step = x.size() / kMaxDots + 1;
  for (std::size_t i = 0; i < std::min(x.size(), y.size()); i += step) {
    if (!std::isfinite(x[i]) || !std::isfinite(y[i]) || decisions.text(i, "verdict") != "kept") {
      continue;
    }
    path += fmt::format("M{:.1f} {:.1f}h0", x[i], -y[i]);
  }
  if (path.empty()) return {};
  return fmt::format("<path class=\"candidates\" stroke-width=\"{:.2f}\" d=\"", 1.2 * radius) +
         path + "\"/>\n";
}

/// What a picture shows of the plane, with a rim of one mark's size.
struct View {
  Eigen::AlignedBox2d box;
  double unit = 0;  ///< what a mark measures
};

View view_of(Eigen::AlignedBox2d box, const Backdrop& backdrop) {
  if (backdrop.width > 0) {
    box.extend(Vec2(backdrop.x_m, backdrop.y_m));
    box.extend(Vec2(backdrop.x_m + backdrop.width * backdrop.cell_m,
                    backdrop.y_m - backdrop.height * backdrop.cell_m));
  }
  const double unit = std::max(5.0, box.sizes().maxCoeff()) / 80;
  box.extend(Vec2(box.min() - Vec2::Constant(unit)));
  box.extend(Vec2(box.max() + Vec2::Constant(unit)));
  return {box, unit};
}

// The picture's beginning: its frame and what is known of the plane.
std::string open_svg(const View& view, const Backdrop& backdrop, const char* attributes) {
  const Eigen::AlignedBox2d& box = view.box;
  std::string svg =
      fmt::format(
          "<svg class=\"map\" role=\"img\" viewBox=\"{:.2f} {:.2f} {:.2f} {:.2f}\" "
          "data-unit=\"{:.3f}\" ",
          box.min().x(), -box.max().y(), box.sizes().x(), box.sizes().y(), view.unit) +
      attributes + ">\n";
  if (backdrop.width > 0) {
    svg += fmt::format(
               "<image x=\"{:.3f}\" y=\"{:.3f}\" width=\"{:.3f}\" height=\"{:.3f}\" "
               "preserveAspectRatio=\"none\" href=\"",
               backdrop.x_m, -backdrop.y_m, backdrop.width * backdrop.cell_m,
               backdrop.height * backdrop.cell_m) +
           png_data_uri(backdrop) + "\"/>\n";
  }
  return svg;
}

Backdrop backdrop_of(const RunRecord& run) {
  return run.map ? backdrop_of(*run.map) : backdrop_of(run.cloud.points_O);
}

}  // namespace

std::string map_picture_svg(const RunRecord& run) {
  if (run.truth.empty() && run.estimate.empty()) return {};
  const Backdrop backdrop = backdrop_of(run);
  const std::vector<RunTarget> targets = run_targets(run.events);

  Eigen::AlignedBox2d box;
  for (const auto* poses : {&run.truth, &run.estimate}) {
    for (const TimedPose& pose : *poses) box.extend(pose.X.p.head<2>());
  }
  for (const RunTarget& target : targets) box.extend(target.p_O.head<2>());
  const View view = view_of(box, backdrop);
  const double unit = view.unit;

  std::string svg =
      open_svg(view, backdrop, "id=\"path-map\" aria-label=\"Flown path over the 2D map\"");
  svg += candidates_svg(run.decisions, 0.5 * unit);
  svg += polyline(run.truth, "truth");
  svg += polyline(run.estimate, "estimate");
  for (std::size_t i = 0; i < targets.size(); ++i) {
    const RunTarget& target = targets[i];
    svg +=
        circle(target.p_O.x(), target.p_O.y(), 0.55 * unit, target.reached ? "reached" : "target",
               "target " + std::to_string(i + 1) + ", selected at " +
                   fmt::format("{:.1f} s", target.time_s) + (target.reached ? ", reached" : ""));
  }
  if (!run.truth.empty()) {
    svg += svg_ends(run.truth.front().X.p.head<2>(), run.truth.back().X.p.head<2>(), unit);
  }
  return svg + svg_scale_bar(view.box, unit) + "</svg>\n";
}

std::string overlaid_paths_svg(const RunRecord& backdrop_run, const std::vector<DrawnPath>& paths) {
  Eigen::AlignedBox2d box;
  for (const DrawnPath& path : paths) {
    for (const TimedPose& pose : *path.poses) box.extend(pose.X.p.head<2>());
  }
  if (box.isEmpty()) return {};
  const Backdrop backdrop = backdrop_of(backdrop_run);
  const View view = view_of(box, backdrop);
  std::string svg = open_svg(view, backdrop, "aria-label=\"Flown paths over the map\"");
  std::string ends;
  for (const auto& [poses, colour, title] : paths) {
    if (poses->empty()) continue;
    const std::string name = "<title>" + escape_markup(title) + "</title>";
    svg += fmt::format("<polyline class=\"run\" style=\"stroke:{}\" points=\"{}\">{}</polyline>\n",
                       colour, points_text(*poses, kMaxOverlaidPath), name);
    const Vec3& end = poses->back().X.p;
    ends += fmt::format(
        "<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" style=\"fill:{}\">{}</circle>\n", end.x(),
        -end.y(), 0.6 * view.unit, colour, name);
  }
  const Vec3& start = paths.front().poses->front().X.p;
  svg += ends + circle(start.x(), start.y(), 0.9 * view.unit, "start", "start");
  return svg + svg_scale_bar(view.box, view.unit) + "</svg>\n";
}

}  // namespace arex::sim
