#include "evaluation/trajectory_file.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <sstream>
#include <utility>

#include "config/config.h"
#include "config/text.h"

namespace arex::sim {
namespace {

// Two decimals a component, which is the coarsest that anybody writes, leave a norm that is off by
// 0.01 at most: half a digit in each of four.
constexpr double kRounding = 0.01;
// What is beyond it counts as infinite: squares of squares of what is not are still numbers.
constexpr double kInfinite = 1e60;
// Nobody's clock counts so many seconds: they are nanoseconds.
constexpr double kNoSeconds = 1e12;
constexpr std::array<std::pair<TrajectoryFormat, std::string_view>, 3> kNames{
    {{TrajectoryFormat::kTum, "tum"},
     {TrajectoryFormat::kEuroc, "euroc"},
     {TrajectoryFormat::kKitti, "kitti"}}};
constexpr std::size_t kTumColumns = 8;
constexpr std::size_t kKittiColumns = 12;

/// The numbers of one line, and how they were written.
struct Row {
  std::vector<double> numbers;
  bool commas = false;
  bool decimal_stamp = false;   ///< the first has a point
  std::string_view not_number;  ///< the first word that is none
};

// NaN and infinity are numbers here: such a line is left out, not misunderstood.
bool parse_number(std::string_view word, double& value) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  const char* end = word.data() + word.size();
  const auto [last, error] = std::from_chars(word.data(), end, value);
  return error == std::errc() && last == end;
}

void skip_blanks(std::string_view& rest) {
  rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r"), rest.size()));
}

// False if a word is no number, which row.not_number then is; between two commas it is empty.
bool read_row(std::string_view line, Row& row) {
  row.numbers.clear();
  row.commas = false;
  for (skip_blanks(line); !line.empty();) {
    const std::string_view word = line.substr(0, line.find_first_of(" \t\r,"));
    line.remove_prefix(word.size());
    skip_blanks(line);
    if (line.starts_with(',')) {
      row.commas = true;
      line.remove_prefix(1);
      skip_blanks(line);
    }
    double value = 0;
    if (!parse_number(word, value)) {
      row.not_number = word;
      return false;
    }
    if (row.numbers.empty()) row.decimal_stamp = word.find('.') != std::string_view::npos;
    row.numbers.push_back(value);
  }
  return true;
}

bool may_be(TrajectoryFormat format, std::size_t columns) {
  switch (format) {
    case TrajectoryFormat::kTum:
      return columns == kTumColumns;
    case TrajectoryFormat::kKitti:
      return columns == kKittiColumns;
    case TrajectoryFormat::kEuroc:
      return columns >= kTumColumns;
  }
  return false;
}

// Nothing where seconds with a quaternion x y z w and nanoseconds with one w x y z look alike.
std::optional<TrajectoryFormat> tell_format(const Row& row) {
  const bool nanoseconds = row.numbers[0] >= kNoSeconds;
  if (row.numbers.size() == kKittiColumns && !nanoseconds) return TrajectoryFormat::kKitti;
  if (row.numbers.size() != kTumColumns || (nanoseconds && row.commas)) {
    return TrajectoryFormat::kEuroc;
  }
  if (nanoseconds || (row.commas && !row.decimal_stamp)) return std::nullopt;
  return TrajectoryFormat::kTum;
}

class Parser {
 public:
  Parser(const std::string& name, std::optional<TrajectoryFormat> asked) : asked_(asked) {
    trajectory_.file = name;
  }

  Trajectory parse(std::string_view text) {
    if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
    while (!text.empty()) {
      const std::size_t end = text.find('\n');
      add_line(text.substr(0, end), end != std::string_view::npos);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    }
    if (trajectory_.poses.empty()) {
      refuse("no pose until here, expected a trajectory: TUM, EuRoC or KITTI");
    }
    if (trajectory_.has_time()) sort();
    return std::move(trajectory_);
  }

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw ConfigError(trajectory_.file + ":" + std::to_string(std::max<std::size_t>(line_, 1)) +
                      ": " + what);
  }

  void add_line(std::string_view line, bool ended) {
    ++line_;
    skip_blanks(line);
    if (line.empty() || line.front() == '#') return;
    const bool numbers = read_row(line, row_);
    if (!ended && format_ && !(numbers && may_be(*format_, row_.numbers.size()))) {
      ++trajectory_.cut_short;
      return;
    }
    if (!numbers) {
      const bool heading = !format_ && !heading_ && row_.numbers.empty();
      heading_ = true;
      if (heading) return;
      refuse("'" + shortened(row_.not_number) + "' is no number");
    }
    if (!format_) determine_format();
    if (!may_be(*format_, row_.numbers.size())) {
      refuse(std::to_string(row_.numbers.size()) + " numbers, expected " +
             (*format_ == TrajectoryFormat::kKitti ? "12" : "8") + " as before");
    }
    if (!pose_is_finite()) {
      ++trajectory_.not_finite;
    } else if (*format_ == TrajectoryFormat::kKitti) {
      add_kitti_pose();
    } else {
      add_stamped_pose();
    }
  }

  void determine_format() {
    const std::size_t columns = row_.numbers.size();
    if (columns < kTumColumns) {
      refuse(std::to_string(columns) +
             " numbers, expected 8 (TUM), 12 (KITTI), or 8 and more with nanoseconds (EuRoC)");
    }
    format_ = asked_ && may_be(*asked_, columns) ? asked_ : tell_format(row_);
    if (!format_) refuse("may be TUM or EuRoC, expected --format tum or --format euroc");
    trajectory_.format = *format_;
  }

  // What follows the pose, EuRoC's velocities and biases, may be anything.
  [[nodiscard]] bool pose_is_finite() const {
    const bool kitti = *format_ == TrajectoryFormat::kKitti;
    const auto end =
        row_.numbers.begin() + static_cast<std::ptrdiff_t>(kitti ? kKittiColumns : kTumColumns);
    return std::all_of(row_.numbers.begin(), end,
                       [](double number) { return std::abs(number) < kInfinite; });
  }

  void add_stamped_pose() {
    const std::vector<double>& v = row_.numbers;
    const bool euroc = *format_ == TrajectoryFormat::kEuroc;
    TimedPose pose;
    pose.time_s = euroc ? v[0] / static_cast<double>(kNanosecondsPerSecond) : v[0];
    pose.X.p = {v[1], v[2], v[3]};
    const Quat q = euroc ? Quat(v[4], v[5], v[6], v[7]) : Quat(v[7], v[4], v[5], v[6]);
    const double norm = q.norm();
    if (norm < kRounding) refuse("the quaternion is zero, expected a rotation");
    if (std::abs(norm - 1) > kRounding) ++trajectory_.normalised;
    pose.X.R = q.normalized().toRotationMatrix();
    trajectory_.poses.push_back(pose);
  }

  void add_kitti_pose() {
    TimedPose pose;
    Mat3 R;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double* row = row_.numbers.data() + 4 * i;
      R.row(i) << row[0], row[1], row[2];
      pose.X.p[i] = row[3];
    }
    const double skew = (R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff();
    if (skew > 2 * kRounding || R.determinant() < 0) refuse("the matrix is no rotation");
    pose.X.R = Quat(R).normalized().toRotationMatrix();
    trajectory_.poses.push_back(pose);
  }

  void sort() {
    std::vector<TimedPose>& poses = trajectory_.poses;
    for (std::size_t i = 1; i < poses.size(); ++i) {
      if (poses[i].time_s < poses[i - 1].time_s) ++trajectory_.out_of_order;
    }
    std::stable_sort(poses.begin(), poses.end(),
                     [](const TimedPose& a, const TimedPose& b) { return a.time_s < b.time_s; });
    for (std::size_t i = 1; i < poses.size(); ++i) {
      if (poses[i].time_s == poses[i - 1].time_s) ++trajectory_.same_stamp;
    }
  }

  std::optional<TrajectoryFormat> asked_;
  std::optional<TrajectoryFormat> format_;
  Trajectory trajectory_;
  std::size_t line_ = 0;
  bool heading_ = false;
  Row row_;
};

}  // namespace

std::string_view format_name(TrajectoryFormat format) {
  return std::find_if(kNames.begin(), kNames.end(),
                      [&](const auto& name) { return name.first == format; })
      ->second;
}

std::optional<TrajectoryFormat> format_named(std::string_view name) {
  for (const auto& [format, its_name] : kNames) {
    if (its_name == name) return format;
  }
  return std::nullopt;
}

Trajectory read_trajectory(const std::filesystem::path& file,
                           std::optional<TrajectoryFormat> format) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream || std::filesystem::is_directory(file)) {
    throw ConfigError(file.string() + ":1: cannot be read, expected a trajectory");
  }
  std::ostringstream text;
  text << stream.rdbuf();
  return parse_trajectory(text.view(), printable(file.string()), format);
}

Trajectory parse_trajectory(std::string_view text, const std::string& name,
                            std::optional<TrajectoryFormat> format) {
  return Parser(name, format).parse(text);
}

}  // namespace arex::sim
