#include "scoring/flight_ways.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace arex::sim {
namespace {

constexpr std::array<std::array<int, 2>, 8> kAround{
    {{1, 0}, {0, 1}, {-1, 0}, {0, -1}, {1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};

}  // namespace

FlightWays::FlightWays(ReachableSpace space) : space_(std::move(space)) {
  find_runs();
  join_runs();
}

void FlightWays::find_runs() {
  const Eigen::Vector3i size = space_.grid.size;
  for (int y = 0; y < size.y(); ++y) {
    for (int x = 0; x < size.x(); ++x) {
      first_run_.push_back(static_cast<Node>(runs_.size()));
      bool inside = false;
      for (int z = 0; z < size.z(); ++z) {
        const bool open = space_.reachable[space_.grid.index({x, y, z})] != 0;
        if (open && !inside) runs_.push_back({x, y, z, z});
        if (open) runs_.back().high = z;
        inside = open;
      }
    }
  }
  first_run_.push_back(static_cast<Node>(runs_.size()));
}

std::span<const FlightWays::Run> FlightWays::column(int x, int y) const {
  const Eigen::Vector3i size = space_.grid.size;
  if (x < 0 || y < 0 || x >= size.x() || y >= size.y()) return {};
  const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x()) +
                  static_cast<std::size_t>(x);
  return std::span(runs_).subspan(first_run_[at], first_run_[at + 1] - first_run_[at]);
}

bool FlightWays::opens_at(int x, int y, const Run& shared) const {
  return std::ranges::any_of(column(x, y), [&](const Run& run) {
    return run.low <= shared.high && run.high >= shared.low;
  });
}

void FlightWays::join_runs() {
  first_edge_.reserve(runs_.size() + 1);
  edges_.reserve(kAround.size() * runs_.size());
  for (const Run& run : runs_) {
    first_edge_.push_back(static_cast<std::uint32_t>(edges_.size()));
    for (const auto& [dx, dy] : kAround) {
      for (const Run& other : column(run.x + dx, run.y + dy)) {
        const Run shared{0, 0, std::max(run.low, other.low), std::min(run.high, other.high)};
        if (shared.low > shared.high) continue;
        const bool diagonal = dx != 0 && dy != 0;
        if (diagonal &&
            !(opens_at(run.x + dx, run.y, shared) && opens_at(run.x, run.y + dy, shared)))
          continue;
        edges_.push_back(
            {static_cast<Node>(&other - runs_.data()), diagonal ? kDiagonal : kStraight});
      }
    }
  }
  first_edge_.push_back(static_cast<std::uint32_t>(edges_.size()));
}

double FlightWays::height(int cell) const { return space_.grid.centre({0, 0, cell}).z(); }

Vec2 FlightWays::place_W(Node node) const {
  return space_.grid.centre({runs_[node].x, runs_[node].y, 0}).head<2>();
}

std::optional<FlightWays::Node> FlightWays::nearest(const Vec3& p_W, double reach_m) const {
  const Eigen::Vector3i home = space_.grid.cell_of(p_W);
  const int reach = static_cast<int>(std::ceil(reach_m / space_.grid.resolution_m));
  std::optional<Node> best;
  double least = reach_m * reach_m;
  for (int y = home.y() - reach; y <= home.y() + reach; ++y) {
    for (int x = home.x() - reach; x <= home.x() + reach; ++x) {
      for (const Run& run : column(x, y)) {
        Vec3 p = space_.grid.centre({x, y, 0});
        p.z() = std::clamp(p_W.z(), height(run.low), height(run.high));
        const double distance = (p - p_W).squaredNorm();
        if (distance > least || (best && distance == least)) continue;
        least = distance;
        best = static_cast<Node>(&run - runs_.data());
      }
    }
  }
  return best;
}

FlightWays::Distances FlightWays::distances_from(Node start) const {
  constexpr std::size_t kBuckets = kDiagonal + 1;  // no step is longer
  Distances distance(runs_.size(), kFar);
  std::array<std::vector<Node>, kBuckets> open;
  distance[start] = 0;
  open[0].push_back(start);
  std::size_t waiting = 1;
  for (std::int32_t here = 0; waiting > 0; ++here) {
    std::vector<Node>& bucket = open[static_cast<std::size_t>(here) % kBuckets];
    waiting -= bucket.size();
    // Steps have a length: none of what is found now comes into this bucket.
    for (const Node node : bucket) {
      if (distance[node] != here) continue;  // a shorter way was found since
      for (std::uint32_t e = first_edge_[node]; e < first_edge_[node + 1]; ++e) {
        const std::int32_t there = here + edges_[e].cost;
        if (there >= distance[edges_[e].to]) continue;
        distance[edges_[e].to] = there;
        open[static_cast<std::size_t>(there) % kBuckets].push_back(edges_[e].to);
        ++waiting;
      }
    }
    bucket.clear();
  }
  return distance;
}

std::vector<Vec3> FlightWays::way_W(const Distances& distances, Node to, double z_m) const {
  std::vector<Node> nodes{to};
  while (distances[nodes.back()] > 0) {
    const Node here = nodes.back();
    for (std::uint32_t e = first_edge_[here]; e < first_edge_[here + 1]; ++e) {
      if (distances[edges_[e].to] != distances[here] - edges_[e].cost) continue;
      nodes.push_back(edges_[e].to);
      break;
    }
  }
  std::reverse(nodes.begin(), nodes.end());
  return tightened(at_heights(nodes, z_m));
}

std::vector<Vec3> FlightWays::at_heights(const std::vector<Node>& nodes, double z_m) const {
  std::vector<Vec3> way;
  double z = z_m;
  for (const Node node : nodes) {
    const Vec2 place = place_W(node);
    z = std::clamp(z, height(runs_[node].low), height(runs_[node].high));
    // Up or down first, in the run where it is: the shared heights belong to both.
    if (!way.empty() && way.back().z() != z) way.push_back({way.back().x(), way.back().y(), z});
    const Vec3 p(place.x(), place.y(), z);
    const std::size_t count = way.size();
    if (count >= 2 &&
        (p - way[count - 1]).normalized().dot((way[count - 1] - way[count - 2]).normalized()) >
            1 - 1e-9) {
      way.pop_back();  // straight on
    }
    way.push_back(p);
  }
  return way;
}

bool FlightWays::is_free(const Vec3& from_W, const Vec3& to_W) const {
  constexpr double kStep = 0.5;  // of a cell
  const double length = (to_W - from_W).norm();
  const int steps = static_cast<int>(std::ceil(length / (kStep * space_.grid.resolution_m)));
  for (int i = 1; i < steps; ++i) {
    if (!space_.at(from_W + (static_cast<double>(i) / steps) * (to_W - from_W))) return false;
  }
  return true;
}

std::vector<Vec3> FlightWays::tightened(std::vector<Vec3> way_W) const {
  // There and back again, each time with points to bend at in what is straight so far, ever closer.
  for (const int cells : {0, 8, 4, 2}) {
    if (cells > 0) way_W = with_points_between(way_W, cells * space_.grid.resolution_m);
    std::vector<Vec3> tight{way_W.front()};
    for (std::size_t i = 1; i < way_W.size(); ++i) {
      const bool last = i + 1 == way_W.size();
      if (last || !is_free(tight.back(), way_W[i + 1])) tight.push_back(way_W[i]);
    }
    way_W = std::move(tight);
    std::reverse(way_W.begin(), way_W.end());
  }
  return way_W;
}

double polyline_length(std::span<const Vec3> points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

std::vector<Vec3> with_points_between(std::span<const Vec3> corners, double step_m) {
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 from = i > 0 ? corners[i - 1] : corners[i];
    const double length = (corners[i] - from).norm();
    const int steps = std::max(1, static_cast<int>(std::ceil(length / step_m - 1e-9)));
    for (int s = 1; s <= steps; ++s) {
      points.push_back(from + (static_cast<double>(s) / steps) * (corners[i] - from));
    }
  }
  return points;
}

}  // namespace arex::sim
