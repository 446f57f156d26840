// Explores a map that was flown, in the plane and within seconds: what an explorer makes of a
// change before it is flown.
//
//   explore_map RUN [key=value ...]
//
// RUN is the folder of a flight of one storey: its map2d is taken for the world, its resolved.yaml
// for the configuration, with the keys said over it (exploration.strategy=nearest, plug-ins
// included). The vehicle sees 20 m in the plane without error and flies 1.4 m a second along the
// shortest known way, a decision each second. Prints what it flew up to 90, 99 and 99.9 % of the
// area, and in all.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "autonomy/exploration/test_map.h"
#include "config/config.h"
#include "exploration/exploration_space.h"
#include "run/scenario.h"
#include "stack/modules.h"

namespace arex {
namespace {

constexpr double kSight_m = 20, kSpeed_mps = 1.4;
constexpr int kLongest_s = 1800;

/// Back from map_server's trinary format.
OccupancyMap2D read_map(const std::filesystem::path& folder, double resolution_m) {
  OccupancyMap2D map;
  map.resolution = resolution_m;
  std::ifstream yaml(folder / "map2d.yaml");
  for (std::string line; std::getline(yaml, line);) {
    std::sscanf(line.c_str(), "origin: [%lf, %lf", &map.origin.x(), &map.origin.y());
  }
  std::ifstream in(folder / "map2d.pgm", std::ios::binary);
  std::string magic;
  int top = 0;
  in >> magic >> map.width >> map.height >> top;
  in.get();
  if (!in || magic != "P5") throw std::runtime_error("no map2d.pgm in " + folder.string());
  map.cells.assign(static_cast<std::size_t>(map.width) * static_cast<std::size_t>(map.height),
                   OccupancyMap2D::kUnknown);
  for (int y = map.height - 1; y >= 0; --y) {
    for (int x = 0; x < map.width; ++x) {
      const int value = in.get();
      if (value == 0) map.cells[map.index({x, y})] = OccupancyMap2D::kOccupied;
      if (value == 254) map.cells[map.index({x, y})] = OccupancyMap2D::kFree;
    }
  }
  if (!in) throw std::runtime_error("map2d.pgm ends early");
  return map;
}

class Flight {
 public:
  Flight(const ExplorerConfig& config, OccupancyMap2D truth)
      : config_(config), truth_(std::move(truth)), map_(test::unknown_like(truth_)) {
    const ExplorationSpace space(truth_, config_.bounds, config_.space, p_);
    for (int y = 0; y < truth_.height; ++y) {
      for (int x = 0; x < truth_.width; ++x) {
        const Eigen::Vector2i cell(x, y);
        if (space.is_reachable(cell) && space.is_inside(cell)) area_.push_back(truth_.index(cell));
      }
    }
    test::reveal(truth_, p_, kSight_m, map_);
  }

  void explore(Explorer& explorer) {
    for (seconds_ = 0; seconds_ < kLongest_s; ++seconds_) {
      ExplorerInput input;
      input.now = seconds_ * kNanosecondsPerSecond;
      input.p_OB = {p_.x(), p_.y(), config_.flight_height_m};
      input.progress = progress_;
      input.energy = ConsumptionModel(config_.consumption);
      const Decision decision = explorer.decide(map_, input);
      if (decision.kind == DecisionKind::kNewTarget) ++targets_;
      if (decision.kind == DecisionKind::kStop) {
        reason_ = decision.stop_reason;
        break;
      }
      if (decision.kind != DecisionKind::kWait) fly(decision.goal_O.head<2>());
    }
    const ExplorationSpace home(truth_, config_.bounds, config_.space, Vec2::Zero());
    home_m_ = home.travel_distance(truth_.cell_of(p_));
  }

  void print() const {
    std::printf("%8s %8s %8s %8s %8s %8s %8s  %s\n", "90 %, m", "99 %, m", "99.9 %,m", "all, m",
                "home, m", "targets", "known", "stopped for");
    std::printf("%8.0f %8.0f %8.0f %8.0f %8.0f %8d %8.5f  %s\n", reached_m_[0], reached_m_[1],
                reached_m_[2], flown_m_ + home_m_, home_m_, targets_, known(),
                std::string(kStopReasonNames[static_cast<std::size_t>(reason_)]).c_str());
  }

 private:
  /// A second's flight towards a goal.
  void fly(const Vec2& goal) {
    const ExplorationSpace field(map_, config_.bounds, config_.space, goal);
    progress_ = TargetProgress::kUnderWay;
    for (double left = kSpeed_mps; left > 0;) {
      const Eigen::Vector2i here = map_.cell_of(p_);
      const Eigen::Vector2i next = test::next_towards(field, here);
      if (next == here) {
        const bool there = (map_.centre_of(here) - goal).norm() < 2 * map_.resolution;
        progress_ = there ? TargetProgress::kReached : TargetProgress::kUnreachable;
        break;
      }
      const double step = (map_.centre_of(next) - p_).norm();
      flown_m_ += step;
      left -= step;
      p_ = map_.centre_of(next);
    }
    test::reveal(truth_, p_, kSight_m, map_);
    constexpr std::array kShares{0.9, 0.99, 0.999};
    for (std::size_t k = 0; k < kShares.size(); ++k) {
      if (std::isnan(reached_m_[k]) && known() >= kShares[k]) reached_m_[k] = flown_m_;
    }
  }

  [[nodiscard]] double known() const {
    const auto known = std::count_if(area_.begin(), area_.end(), [&](std::size_t cell) {
      return map_.cells[cell] != OccupancyMap2D::kUnknown;
    });
    return static_cast<double>(known) / static_cast<double>(area_.size());
  }

  ExplorerConfig config_;
  OccupancyMap2D truth_, map_;
  std::vector<std::size_t> area_;  ///< cells that can be flown to
  Vec2 p_ = Vec2::Zero();
  TargetProgress progress_ = TargetProgress::kUnderWay;
  StopReason reason_ = StopReason::kNone;
  int seconds_ = 0, targets_ = 0;
  double flown_m_ = 0, home_m_ = 0;
  std::array<double, 3> reached_m_{std::nan(""), std::nan(""), std::nan("")};
};

int run(const std::filesystem::path& folder, const std::vector<std::string>& overrides) {
  const sim::Scenario scenario =
      sim::load_scenario(folder / "resolved.yaml", overrides, std::nullopt);
  const StackConfig stack = with_shared_values(scenario.config.stack);
  Flight flight(stack.exploration.explorer, read_map(folder, stack.mapping.resolution_m));
  const std::string& strategy = stack.exploration.strategy;
  ConfigNode own;
  own.kind = ConfigNode::Kind::kMap;
  const auto said = stack.modules.find(strategy);
  if (said != stack.modules.end()) own = said->second.own;
  const auto explorer = modules()
                            .explorers.at(strategy, "exploration.strategy")
                            .make(own, {stack, scenario.config.seed});
  flight.explore(*explorer);
  flight.print();
  return 0;
}

}  // namespace
}  // namespace arex

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: explore_map RUN [key=value ...]\n");
    return 2;
  }
  try {
    return arex::run(argv[1], {argv + 2, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "explore_map: %s\n", error.what());
    return 2;
  }
}
