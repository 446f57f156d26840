#include "evaluation/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <utility>

namespace arex::sim {
namespace {

using nlohmann::ordered_json;

struct AlignmentWords {
  Alignment alignment;
  std::string_view name;
  std::string_view text;
};
constexpr std::array<AlignmentWords, 6> kAlignments{
    {{Alignment::kNone, "none", "not aligned"},
     {Alignment::kOrigin, "origin", "aligned at the first pose"},
     {Alignment::kYaw, "yaw", "aligned by the best yaw and translation"},
     {Alignment::kSe3, "se3", "aligned by the best rotation and translation"},
     {Alignment::kSim3, "sim3", "aligned by the best rotation, translation and scale"},
     {Alignment::kScale, "scale", "scaled, not aligned otherwise"}}};

const AlignmentWords& words_of(Alignment alignment) {
  return *std::find_if(kAlignments.begin(), kAlignments.end(),
                       [&](const AlignmentWords& words) { return words.alignment == alignment; });
}

// The last parts of a path without its ending: of a/run/estimate.tum two are run/estimate.
std::string last_parts(const std::filesystem::path& file, std::size_t count) {
  std::filesystem::path parts;
  std::filesystem::path rest = file.parent_path() / file.stem();
  for (std::size_t i = 0; i < count && rest.has_filename(); ++i) {
    parts = parts.empty() ? rest.filename() : rest.filename() / parts;
    rest = rest.parent_path();
  }
  return parts.string();
}

std::vector<std::string> names_of(const std::vector<Trajectory>& estimates) {
  constexpr std::size_t kMostParts = 8;
  std::vector<std::string> names(estimates.size());
  for (std::size_t parts = 1; parts <= kMostParts; ++parts) {
    for (std::size_t i = 0; i < names.size(); ++i) names[i] = last_parts(estimates[i].file, parts);
    std::vector<std::string> sorted = names;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end()) return names;
  }
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = estimates[i].file;
  return names;
}

ordered_json number(double value) { return std::isfinite(value) ? ordered_json(value) : nullptr; }

ordered_json statistics_json(const Statistics& s) {
  if (std::isnan(s.rmse)) return nullptr;
  return {{"rmse", s.rmse}, {"mean", s.mean}, {"median", s.median}, {"std", s.std},
          {"min", s.min},   {"max", s.max},   {"sse", s.sse}};
}

ordered_json trajectory_json(const Trajectory& trajectory) {
  return {{"file", trajectory.file},
          {"format", format_name(trajectory.format)},
          {"poses", trajectory.poses.size()},
          {"left_out_not_finite", trajectory.not_finite},
          {"left_out_cut_short", trajectory.cut_short},
          {"out_of_order", trajectory.out_of_order},
          {"same_stamp", trajectory.same_stamp},
          {"normalised_quaternions", trajectory.normalised}};
}

ordered_json alignment_json(const Similarity& alignment) {
  const Quat q = alignment.X_WO.quaternion();
  const Vec3& p = alignment.X_WO.p;
  return {{"translation_m", {p.x(), p.y(), p.z()}},
          {"rotation_xyzw", {q.x(), q.y(), q.z(), q.w()}},
          {"scale", alignment.scale}};
}

// Pairs of sub-paths of one length: all of them, then the consecutive ones.
ordered_json relative_json(const Evaluation& evaluation) {
  ordered_json list = ordered_json::array();
  for (const RelativeError& error : evaluation.relative) {
    if (error.which == SubPaths::kAll)
      list.push_back(ordered_json::object({{"delta_m", error.delta_m}}));
    list.back()[error.which == SubPaths::kAll ? "all" : "consecutive"] = {
        {"sub_paths", error.count},
        {"translation_m", statistics_json(error.translation_m)},
        {"rotation_deg", statistics_json(error.rotation_deg)}};
  }
  return list;
}

ordered_json estimate_json(const ComparedEstimate& estimate, const EvaluationOptions& options) {
  const Evaluation& e = estimate.evaluation;
  ordered_json json{{"name", estimate.name}};
  json.update(trajectory_json(estimate.trajectory));
  json.update({{"matched", e.pairs.size()},
               {"duration_s", number(e.duration_s)},
               {"reference_length_m", e.reference_length_m},
               {"estimate_length_m", e.estimate_length_m},
               {"alignment", alignment_json(e.alignment)},
               {"ate",
                {{"translation_m", statistics_json(e.position_m)},
                 {"rotation_deg", statistics_json(e.rotation_deg)}}},
               {"yaw_error_deg", statistics_json(e.yaw_deg)},
               {"rpe", relative_json(e)},
               {"end_error_m", e.end_error_m},
               {"drift_percent", number(e.drift_percent)},
               {"notes", notes_of(estimate, options)}});
  return json;
}

std::string counted(std::size_t count, std::string_view one, std::string_view several) {
  return fmt::format("{} {}", count, count == 1 ? one : several);
}

}  // namespace

Comparison compare(Trajectory reference, std::vector<Trajectory> estimates,
                   const EvaluationOptions& options) {
  Comparison comparison{std::move(reference), options, {}};
  const std::vector<std::string> names = names_of(estimates);
  for (std::size_t i = 0; i < estimates.size(); ++i) {
    Evaluation evaluation = evaluate(comparison.reference, estimates[i], options);
    comparison.estimates.push_back({names[i], std::move(estimates[i]), std::move(evaluation)});
  }
  return comparison;
}

std::vector<ComparedFigure> figures_of(const Comparison& comparison) {
  std::vector<ComparedFigure> figures;
  const auto add = [&](const std::string& label, const std::string& unit, bool less_is_better,
                       const auto& value_of) {
    ComparedFigure figure{label, unit, {}, less_is_better};
    for (const ComparedEstimate& estimate : comparison.estimates) {
      figure.values.push_back(static_cast<double>(value_of(estimate.evaluation)));
    }
    const auto known = [](double value) { return std::isfinite(value); };
    if (std::any_of(figure.values.begin(), figure.values.end(), known)) figures.push_back(figure);
  };
  const auto add_statistics = [&](const std::string& label, const std::string& unit,
                                  const auto& statistics_of_estimate) {
    const auto add_one = [&](const char* name, double Statistics::*which) {
      add(label + ", " + name, unit, true,
          [&](const Evaluation& e) { return statistics_of_estimate(e).*which; });
    };
    add_one("RMSE", &Statistics::rmse);
    add_one("mean", &Statistics::mean);
    add_one("median", &Statistics::median);
    add_one("standard deviation", &Statistics::std);
    add_one("minimum", &Statistics::min);
    add_one("maximum", &Statistics::max);
    add(label + ", sum of squares", unit + "²", false,
        [&](const Evaluation& e) { return statistics_of_estimate(e).sse; });
  };
  add("matched poses", "", false, [](const Evaluation& e) { return e.pairs.size(); });
  add("duration", "s", false, [](const Evaluation& e) { return e.duration_s; });
  add("length of the reference", "m", false,
      [](const Evaluation& e) { return e.reference_length_m; });
  add("length of the estimate", "m", false,
      [](const Evaluation& e) { return e.estimate_length_m; });
  const Alignment alignment = comparison.options.alignment;
  if (alignment == Alignment::kSim3 || alignment == Alignment::kScale) {
    add("scale", "", false, [](const Evaluation& e) { return e.alignment.scale; });
  }
  add_statistics("position error (ATE)", "m", [](const Evaluation& e) { return e.position_m; });
  add_statistics("rotation error", "deg", [](const Evaluation& e) { return e.rotation_deg; });
  add_statistics("yaw error", "deg", [](const Evaluation& e) { return e.yaw_deg; });
  for (std::size_t i = 0; i < 2 * comparison.options.deltas_m.size(); ++i) {
    const RelativeError& first = comparison.estimates.front().evaluation.relative[i];
    const std::string over = fmt::format("{:g} m, {}", first.delta_m,
                                         first.which == SubPaths::kAll ? "all" : "consecutive");
    add("relative position error (RPE), " + over + ", RMSE", "m", true,
        [&](const Evaluation& e) { return e.relative[i].translation_m.rmse; });
    add("relative rotation error, " + over + ", RMSE", "deg", true,
        [&](const Evaluation& e) { return e.relative[i].rotation_deg.rmse; });
    add("sub-paths of " + over, "", false,
        [&](const Evaluation& e) { return e.relative[i].count; });
  }
  add("error at the end, aligned at the first pose", "m", true,
      [](const Evaluation& e) { return e.end_error_m; });
  add("drift: the same, of the length", "%", true,
      [](const Evaluation& e) { return e.drift_percent; });
  return figures;
}

std::string ComparedFigure::text(std::size_t i) const {
  const double value = values[i];
  if (!std::isfinite(value)) return "–";
  const bool whole = value == std::round(value) && std::abs(value) < 1e15;
  if (whole || std::abs(value) >= 1000) return fmt::format("{:.0f}", value);
  return fmt::format("{:.{}g}", value, unit.empty() ? 6 : 4);
}

bool ComparedFigure::is_best(std::size_t i) const {
  const auto less = [&](double other) { return other < values[i]; };
  const auto more = [&](double other) { return other > values[i]; };
  return less_is_better && std::none_of(values.begin(), values.end(), less) &&
         std::any_of(values.begin(), values.end(), more);
}

std::string_view alignment_name(Alignment alignment) { return words_of(alignment).name; }

std::string_view alignment_text(Alignment alignment) { return words_of(alignment).text; }

std::optional<Alignment> alignment_named(std::string_view name) {
  for (const AlignmentWords& words : kAlignments) {
    if (words.name == name) return words.alignment;
  }
  return std::nullopt;
}

std::vector<std::string> notes_of(const Trajectory& trajectory) {
  std::vector<std::string> notes;
  const auto add = [&](std::size_t count, std::string_view one, std::string_view several) {
    if (count > 0) notes.push_back(counted(count, one, several));
  };
  add(trajectory.not_finite, "line with a NaN or an infinity left out",
      "lines with a NaN or an infinity left out");
  add(trajectory.cut_short, "last line cut short, left out", "");
  add(trajectory.out_of_order, "pose earlier than the one before it, sorted by time",
      "poses earlier than the one before them, sorted by time");
  add(trajectory.same_stamp, "pose with the stamp of the one before it",
      "poses with the stamp of the one before them");
  add(trajectory.normalised, "quaternion far from unit length, normalised",
      "quaternions far from unit length, normalised");
  return notes;
}

std::vector<std::string> notes_of(const ComparedEstimate& estimate,
                                  const EvaluationOptions& options) {
  std::vector<std::string> notes = notes_of(estimate.trajectory);
  const Evaluation& e = estimate.evaluation;
  const bool turned = options.alignment == Alignment::kSe3 || options.alignment == Alignment::kSim3;
  if (turned && e.width_m < e.position_m.rmse) {
    notes.push_back(
        fmt::format("the reference is a line but for {:.2g} m, less than the error: the rotation "
                    "about it is not determined, expected --align yaw or origin",
                    e.width_m));
  }
  return notes;
}

ordered_json comparison_json(const Comparison& comparison) {
  const EvaluationOptions& options = comparison.options;
  ordered_json reference = trajectory_json(comparison.reference);
  reference["notes"] = notes_of(comparison.reference);
  ordered_json estimates = ordered_json::array();
  for (const ComparedEstimate& estimate : comparison.estimates) {
    estimates.push_back(estimate_json(estimate, options));
  }
  return {{"reference", reference},
          {"options",
           {{"align", alignment_name(options.alignment)},
            {"poses_to_align", options.poses_to_align},
            {"max_time_difference_s", options.max_time_difference_s},
            {"time_offset_s", options.time_offset_s},
            {"delta_m", options.deltas_m},
            {"pairs_from", options.pairs_from_reference ? "reference" : "estimate"}}},
          {"estimates", estimates}};
}

}  // namespace arex::sim
