#include "odometry/visual/feature_tracker.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "math/random.h"
#include "odometry/visual/translation_ransac.h"

namespace arex {
namespace {

using Pyramid = std::vector<cv::Mat>;

// What counts for how much brighter an image is than the one before: pixels of a coarse level that
// are neither black nor white in either of them, as many of them at least.
constexpr int kBrightnessLevel = 3;
constexpr int kBlack = 16, kWhite = 245;
constexpr std::size_t kLeastPixels = 100;
constexpr double kSameBrightness = 0.03;  // relative

cv::Point2f to_cv(const Vec2& p) { return {static_cast<float>(p.x()), static_cast<float>(p.y())}; }

Vec2 from_cv(const cv::Point2f& p) { return {static_cast<double>(p.x), static_cast<double>(p.y)}; }

cv::Mat view(const std::vector<std::uint8_t>& pixels, int width, int height) {
  // OpenCV has no constant view; nothing is written through it.
  return {height, width, CV_8UC1, const_cast<std::uint8_t*>(pixels.data())};
}

}  // namespace

struct FeatureTracker::Impl {
  FeatureTrackerConfig config;
  RandomStream random;
  StereoCamera camera;  ///< of the newest exposure
  std::uint64_t exposures = 0;
  std::int64_t next_id = 0;
  Pyramid before;
  std::vector<ImageFeature> features;

  [[nodiscard]] Vec2 normalised(const Vec2& px) const {
    return {(px.x() - camera.cx) / camera.f_px, (px.y() - camera.cy) / camera.f_px};
  }
  [[nodiscard]] Vec2 pixel(const Vec3& ray) const {
    return {camera.f_px * ray.x() / ray.z() + camera.cx,
            camera.f_px * ray.y() / ray.z() + camera.cy};
  }
  [[nodiscard]] bool inside(const Vec2& px, const cv::Mat& image) const {
    const double border = config.border_px;
    return px.x() >= border && px.y() >= border && px.x() < image.cols - border &&
           px.y() < image.rows - border;
  }

  [[nodiscard]] Pyramid pyramid_of(const cv::Mat& image) const;
  [[nodiscard]] double brightness_over_before(const Pyramid& now, const Mat3& turn) const;
  [[nodiscard]] Pyramid brightened(const cv::Mat& image, double by) const;
  [[nodiscard]] std::vector<std::optional<Vec2>> follow(const Pyramid& from, const Pyramid& to,
                                                        const std::vector<Vec2>& points,
                                                        const std::vector<Vec2>& guesses) const;
  void follow_in_time(const Pyramid& now, const Mat3& turn);
  void test_translation(const std::vector<ImageFeature>& earlier, const Mat3& turn);
  void detect(const cv::Mat& image);
  void look_right(const Pyramid& left, const Pyramid& right);
};

FeatureTracker::FeatureTracker(const FeatureTrackerConfig& config, std::uint64_t seed)
    : impl_(std::make_unique<Impl>(
          Impl{config, RandomStream(seed, "feature tracker"), {}, 0, 0, {}, {}})) {
  cv::setNumThreads(1);  // the flight's jobs are what runs side by side
}
FeatureTracker::~FeatureTracker() = default;
FeatureTracker::FeatureTracker(FeatureTracker&&) noexcept = default;
FeatureTracker& FeatureTracker::operator=(FeatureTracker&&) noexcept = default;

const std::vector<ImageFeature>& FeatureTracker::features() const { return impl_->features; }

void FeatureTracker::forget(std::span<const std::int64_t> ids) {
  std::erase_if(impl_->features, [&](const ImageFeature& f) {
    return std::find(ids.begin(), ids.end(), f.id) != ids.end();
  });
}

FeatureFrame FeatureTracker::track(const StereoImage& images, const Mat3& turn) {
  Impl& my = *impl_;
  my.camera = images.camera;
  const cv::Mat left = view(images.left, images.width, images.height);
  Pyramid now = my.pyramid_of(left);
  if (!my.before.empty()) {
    // Patches are compared by their grey values: the darker image is brought to the other's
    // exposure, and what that one has overexposed is white in both.
    const double brighter = my.brightness_over_before(now, turn);
    if (brighter > 1 + kSameBrightness) my.before = my.brightened(my.before.front(), brighter);
    const bool darker = 1 / brighter > 1 + kSameBrightness;
    my.follow_in_time(darker ? my.brightened(now.front(), 1 / brighter) : now, turn);
  }
  ++my.exposures;
  my.detect(left);
  for (ImageFeature& feature : my.features) feature.right_px.reset();
  if (!images.right.empty()) {
    my.look_right(now, my.pyramid_of(view(images.right, images.width, images.height)));
  }
  my.before = std::move(now);

  FeatureFrame frame;
  frame.stamp = images.time_ns;
  frame.f_px = images.camera.f_px;
  frame.baseline_m = images.camera.baseline_m;
  for (const ImageFeature& feature : my.features) {
    TrackedFeature tracked{feature.id, my.normalised(feature.left_px), std::nullopt};
    if (feature.right_px) tracked.right = my.normalised(*feature.right_px);
    frame.features.push_back(tracked);
  }
  return frame;
}

Pyramid FeatureTracker::Impl::pyramid_of(const cv::Mat& image) const {
  Pyramid pyramid;
  const cv::Size patch(config.patch_px, config.patch_px);
  // Copies even the finest level: the image may go before the next one comes.
  cv::buildOpticalFlowPyramid(image, pyramid, patch, config.pyramid_levels, true,
                              cv::BORDER_REFLECT_101, cv::BORDER_CONSTANT, false);
  return pyramid;
}

/// By how much the exposure has changed, as most of the pixels have it whose place the turn tells.
double FeatureTracker::Impl::brightness_over_before(const Pyramid& now, const Mat3& turn) const {
  const int level = std::min(kBrightnessLevel, static_cast<int>(now.size()) / 2 - 1);
  const cv::Mat& here = now[static_cast<std::size_t>(2 * level)];  // derivatives lie between levels
  const cv::Mat& there = before[static_cast<std::size_t>(2 * level)];
  const double scale = 1 << level;
  std::vector<double> ratios;
  for (int v = 0; v < there.rows; ++v) {
    for (int u = 0; u < there.cols; ++u) {
      const int was = there.at<std::uint8_t>(v, u);
      if (was < kBlack || was > kWhite) continue;
      const Vec3 ray = turn.transpose() * normalised(scale * Vec2(u, v)).homogeneous();
      if (ray.z() <= 0) continue;
      const Vec2 at = pixel(ray) / scale;
      const double x = std::round(at.x()), y = std::round(at.y());
      if (!(x >= 0 && y >= 0 && x < here.cols && y < here.rows)) continue;
      const int is = here.at<std::uint8_t>(static_cast<int>(y), static_cast<int>(x));
      if (is >= kBlack && is <= kWhite) ratios.push_back(static_cast<double>(is) / was);
    }
  }
  if (ratios.size() < kLeastPixels) return 1;
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return *middle;
}

Pyramid FeatureTracker::Impl::brightened(const cv::Mat& image, double by) const {
  cv::Mat grey(1, 256, CV_8UC1), brighter;
  for (int value = 0; value < 256; ++value) {
    grey.at<std::uint8_t>(value) =
        static_cast<std::uint8_t>(std::lround(std::min(255.0, by * value)));
  }
  cv::LUT(image, grey, brighter);
  return pyramid_of(brighter);
}

std::vector<std::optional<Vec2>> FeatureTracker::Impl::follow(
    const Pyramid& from, const Pyramid& to, const std::vector<Vec2>& points,
    const std::vector<Vec2>& guesses) const {
  std::vector<std::optional<Vec2>> found(points.size());
  if (points.empty()) return found;
  std::vector<cv::Point2f> begin, there, back;
  for (const Vec2& p : points) begin.push_back(to_cv(p));
  for (const Vec2& p : guesses) there.push_back(to_cv(p));
  const cv::Size patch(config.patch_px, config.patch_px);
  const cv::TermCriteria enough(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, config.iterations,
                                0.01);
  std::vector<std::uint8_t> forward, backward;
  std::vector<float> error;
  cv::calcOpticalFlowPyrLK(from, to, begin, there, forward, error, patch, config.pyramid_levels,
                           enough, cv::OPTFLOW_USE_INITIAL_FLOW);
  // Back from where it was found: one level does, for it ought to be near.
  back = begin;
  cv::calcOpticalFlowPyrLK(to, from, there, back, backward, error, patch,
                           std::min(1, config.pyramid_levels), enough,
                           cv::OPTFLOW_USE_INITIAL_FLOW);
  const auto most = static_cast<float>(config.back_check_px);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const cv::Point2f miss = back[i] - begin[i];
    if (forward[i] == 0 || backward[i] == 0 || std::hypot(miss.x, miss.y) > most) continue;
    if (inside(from_cv(there[i]), to.front())) found[i] = from_cv(there[i]);
  }
  return found;
}

void FeatureTracker::Impl::follow_in_time(const Pyramid& now, const Mat3& turn) {
  std::vector<Vec2> points, guesses;
  for (const ImageFeature& feature : features) {
    points.push_back(feature.left_px);
    const Vec3 ray = turn.transpose() * normalised(feature.left_px).homogeneous();
    constexpr double kAhead = 0.1;  // a turn may have taken it out of the image
    guesses.push_back(ray.z() > kAhead ? pixel(ray) : feature.left_px);
  }
  const auto found = follow(before, now, points, guesses);
  std::vector<ImageFeature> earlier, kept;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!found[i]) continue;
    earlier.push_back(features[i]);
    kept.push_back(features[i]);
    kept.back().left_px = *found[i];
    ++kept.back().age;
  }
  features = std::move(kept);
  test_translation(earlier, turn);
}

void FeatureTracker::Impl::test_translation(const std::vector<ImageFeature>& earlier,
                                            const Mat3& turn) {
  std::vector<Vec3> was, is;
  for (std::size_t i = 0; i < features.size(); ++i) {
    was.push_back(normalised(earlier[i].left_px).homogeneous());
    const Vec3 turned = turn * normalised(features[i].left_px).homogeneous();
    is.push_back(turned / turned.z());
  }
  const MotionFit off{config.ransac_px / camera.f_px, config.epipolar_px / camera.f_px};
  const std::vector<bool> fits =
      fit_translation(was, is, off, config.ransac_trials, random.fork(exposures));
  std::vector<ImageFeature> kept;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (fits[i]) kept.push_back(features[i]);
  }
  features = std::move(kept);
}

void FeatureTracker::Impl::detect(const cv::Mat& image) {
  const int columns = (image.cols + config.cell_px - 1) / config.cell_px;
  const int rows = (image.rows + config.cell_px - 1) / config.cell_px;
  const auto cell_of = [&](const Vec2& p) {
    return static_cast<std::size_t>(static_cast<int>(p.y()) / config.cell_px * columns +
                                    static_cast<int>(p.x()) / config.cell_px);
  };
  // Each cell's share; the rounding goes up, and the total is cut below.
  const int share = (config.max_features + columns * rows - 1) / (columns * rows);
  std::vector<int> count(static_cast<std::size_t>(columns * rows), 0);
  for (const ImageFeature& feature : features) ++count[cell_of(feature.left_px)];
  if (static_cast<int>(features.size()) >= config.max_features) return;

  cv::Mat score;
  cv::cornerMinEigenVal(image, score, 3, 3);
  // OpenCV scales grey values to 1 and the sums of the gradient's and the block's kernel.
  constexpr float kScale = 255.0F * 255.0F;
  const int border = config.border_px, cell = config.cell_px;
  const auto min_distance = static_cast<int>(config.min_distance_px);
  cv::Mat taken(image.size(), CV_8UC1, cv::Scalar(0));
  for (const ImageFeature& f : features) {
    cv::circle(taken, cv::Point(to_cv(f.left_px)), min_distance, cv::Scalar(1), cv::FILLED);
  }
  struct Corner {
    float score;
    cv::Point at;
  };
  std::vector<Corner> corners;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (count[static_cast<std::size_t>(r * columns + c)] >= share) continue;
      Corner best{static_cast<float>(config.least_corner), {}};
      const int top = std::max(border, r * cell), left = std::max(border, c * cell);
      for (int y = top; y < std::min((r + 1) * cell, image.rows - border); ++y) {
        const float* row = score.ptr<float>(y);
        const std::uint8_t* barred = taken.ptr<std::uint8_t>(y);
        for (int x = left; x < std::min((c + 1) * cell, image.cols - border); ++x) {
          if (row[x] * kScale > best.score && barred[x] == 0) best = {row[x] * kScale, {x, y}};
        }
      }
      if (best.score > static_cast<float>(config.least_corner)) corners.push_back(best);
    }
  }
  std::stable_sort(corners.begin(), corners.end(),
                   [](const Corner& a, const Corner& b) { return a.score > b.score; });
  for (const Corner& corner : corners) {
    if (static_cast<int>(features.size()) >= config.max_features) break;
    if (taken.at<std::uint8_t>(corner.at) != 0) continue;
    cv::circle(taken, corner.at, min_distance, cv::Scalar(1), cv::FILLED);
    features.push_back({next_id++, from_cv(corner.at), std::nullopt, 1});
  }
}

void FeatureTracker::Impl::look_right(const Pyramid& left, const Pyramid& right) {
  std::vector<Vec2> points;
  for (const ImageFeature& feature : features) points.push_back(feature.left_px);
  const auto found = follow(left, right, points, points);
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (!found[i]) continue;
    const Vec2 difference = features[i].left_px - *found[i];
    if (std::abs(difference.y()) > config.stereo_rows_px) continue;
    if (difference.x() < config.least_disparity_px) continue;
    features[i].right_px = found[i];
  }
}

}  // namespace arex
