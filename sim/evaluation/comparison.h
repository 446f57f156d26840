#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "evaluation/trajectory_error.h"

namespace arex::sim {

/// An estimate and what came of it.
struct ComparedEstimate {
  std::string name;  ///< tells it from the others
  Trajectory trajectory;
  Evaluation evaluation;
};

/// Several estimates against one reference.
struct Comparison {
  Trajectory reference;
  EvaluationOptions options;
  std::vector<ComparedEstimate> estimates;
};

/// Evaluates each and names it: by its file's stem, or by as much of its path as tells it from the
/// others. @throws ConfigError as evaluate() does.
Comparison compare(Trajectory reference, std::vector<Trajectory> estimates,
                   const EvaluationOptions& options);

/// A figure of every estimate, for people.
struct ComparedFigure {
  std::string label;
  std::string unit;  ///< empty: a count or a factor
  std::vector<double> values;
  bool less_is_better = false;

  /// Of one estimate: four digits, six of a factor, and all of those before the point.
  [[nodiscard]] std::string text(std::size_t i) const;
  /// Whether less is better, and this is the least of different ones.
  [[nodiscard]] bool is_best(std::size_t i) const;
};
std::vector<ComparedFigure> figures_of(const Comparison& comparison);

/// none, origin, yaw, se3, sim3, scale
std::string_view alignment_name(Alignment alignment);
std::optional<Alignment> alignment_named(std::string_view name);
/// What it does, as part of a sentence.
std::string_view alignment_text(Alignment alignment);

/// What was done to the lines of a file, and what a reader of the figures should know; a sentence
/// each.
std::vector<std::string> notes_of(const Trajectory& trajectory);
std::vector<std::string> notes_of(const ComparedEstimate& estimate,
                                  const EvaluationOptions& options);

/// evaluation.json
nlohmann::ordered_json comparison_json(const Comparison& comparison);

}  // namespace arex::sim
