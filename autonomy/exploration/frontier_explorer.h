#pragma once

#include <optional>
#include <span>
#include <vector>

#include "exploration/exploration_space.h"
#include "exploration/explorer.h"
#include "exploration/explorer_config.h"
#include "exploration/frontier_search.h"

namespace arex {

/// What explorers of frontiers share: the battery, what becomes of a target, the way out of a
/// pocket of the 2D map, and when to stop. Which frontier is next is the business of those derived
/// from it.
class FrontierExplorer : public Explorer {
 public:
  /// @param resolution_m of every map that decide() will be given.
  FrontierExplorer(const ExplorerConfig& config, double resolution_m);

  [[nodiscard]] Decision decide(const OccupancyMap2D& map, const ExplorerInput& input) final;

 protected:
  /// Sees every map, whether there is something to decide or not.
  virtual void observe(const ExplorationSpace& /*space*/) {}
  /// Fills source, candidates and winner of a decision. No winner: there is nothing left that is
  /// worth a flight.
  virtual void choose(Decision& decision, const ExplorationSpace& space,
                      const ExplorerInput& input) = 0;
  /// The target was dropped on the way there.
  virtual void note_dropped(const Vec3& /*p_OB*/) {}

  /// A candidate for each point, with its f_I; what the blacklist bars is marked.
  /// @param forgiving only what was given up for good is barred
  [[nodiscard]] std::vector<Candidate> candidates_at(std::span<const FrontierPoint> points,
                                                     const ExplorationSpace& space, Stamp now,
                                                     bool forgiving) const;
  /// Drops candidates by cases A and B, and those that cannot be seen from anywhere; fills the
  /// viewpoint of the others.
  void filter(std::vector<Candidate>& candidates, const ExplorationSpace& space) const;
  /// f_N along the known-free path.
  [[nodiscard]] static double path_length(const Candidate& candidate,
                                          const ExplorationSpace& space);
  /// Whether any candidate is kept that shows enough to be worth a flight.
  [[nodiscard]] bool any_worthwhile(std::span<const Candidate> candidates) const;

  [[nodiscard]] const ExplorerConfig& config() const { return config_; }

 private:
  struct Target {
    Vec2 point = Vec2::Zero();
    Vec2 viewpoint = Vec2::Zero();
  };

  /// Whether what may be left to fly to, and each of the candidates, is not worth going on for.
  [[nodiscard]] bool little_is_left(const Decision& decision, const ExplorationSpace& space) const;
  void balance(Decision& decision, const ExplorationSpace& space, const ExplorerInput& input) const;
  TargetEnd settle_target(const ExplorationSpace& space, const ExplorerInput& input);
  /// Whether there still is something to see at a target: enough unknown area, and a border to it.
  [[nodiscard]] bool is_worthwhile(const ExplorationSpace& space, const Vec2& point) const;
  void go_on(Decision& decision, const ExplorationSpace& space, const ExplorerInput& input);
  /// Back to the nearest place that it flew through, but does not reach any more. @return whether
  /// there is one to try
  bool go_back(Decision& decision, const ExplorationSpace& space, const ExplorerInput& input);
  static void stop(Decision& decision, const ExplorationSpace& space, StopReason reason);
  void set_goal(Decision& decision, const OccupancyMap2D& map) const;

  ExplorerConfig config_;
  ViewpointFinder viewpoints_;
  Blacklist blacklist_;
  std::optional<Target> target_;
  std::optional<Vec3> way_back_O_;  ///< where it is under way to instead
  int lost_ways_back_ = 0;          ///< that failed since the last target
  int sequence_ = 0;
};

}  // namespace arex
