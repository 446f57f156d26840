#include "sensors/d430_stereo.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "math/mix.h"

// Plain loops over rows that the compiler turns into vector code (CMakeLists.txt gives this file
// -O3); no loop carries a float sum, so the vector width changes no bit.
namespace arex::sim {
namespace {

std::size_t size(int n) { return static_cast<std::size_t>(n); }

constexpr std::uint64_t kGolden = 0x9E3779B97F4A7C15ULL;

/// Eight uniform bytes per hash; `bytes` is a multiple of 8.
void fill_with_random_bytes(std::uint64_t seed, void* out, std::size_t bytes) {
  auto* p = static_cast<unsigned char*>(out);
  for (std::size_t i = 0; i < bytes / 8; ++i) {
    const std::uint64_t word = mix_bits(seed + (i + 1) * kGolden);
    std::memcpy(p + 8 * i, &word, 8);
  }
}

std::size_t round_up_to_8(std::size_t n) { return (n + 7) / 8 * 8; }

/// Mean and variance of a uniform signed byte.
constexpr double kByteMean = -0.5;
constexpr double kByteVariance = (256.0 * 256.0 - 1.0) / 12.0;

/// A disparity step between b and c that neither side's slope (a to b, c to d) explains.
inline bool is_step(float a, float b, float c, float d, float threshold) {
  const float from_left = std::abs(c - (2 * b - a));
  const float from_right = std::abs(b - (2 * c - d));
  return std::min(from_left, from_right) > threshold;
}

/// The smaller of two one-sided differences: the slope of the side without a jump.
inline float lesser(float a, float b) { return std::abs(a) < std::abs(b) ? a : b; }

}  // namespace

StereoModel::StereoModel(const D430Config& config)
    : config_(config), width_(config.width_px), height_(config.height_px) {
  const std::size_t pixels = size(width_) * size(height_);
  const int pad = config_.noise_kernel_px - 1;
  disparity_.resize(pixels);
  for (auto* mask : {&lost_, &edge_, &widened_, &near_edge_}) mask->resize(round_up_to_8(pixels));
  white_.resize(round_up_to_8(size(width_ + pad) * size(height_ + pad)));
  smooth_.resize(size(width_) * size(height_ + pad));
  noise_.resize(pixels);
  // The kernel's sum of squares, for the triangle 1, 2, .., m, .., 2, 1.
  const int m = (config_.noise_kernel_px + 1) / 2;
  int squares = m * m;
  for (int k = 1; k < m; ++k) squares += 2 * k * k;
  noise_rms_ = std::sqrt(kByteVariance) * squares;
}

void StereoModel::measure(const std::vector<float>& inverse_depth, std::uint64_t frame_seed,
                          std::vector<float>& depth_m) {
  depth_m.resize(disparity_.size());
  if (config_.noise_free) {
    measure_exactly(inverse_depth, depth_m);
    return;
  }
  const auto focal_baseline = static_cast<float>(config_.focal_px * config_.baseline_m);
  for (std::size_t i = 0; i < disparity_.size(); ++i) {
    disparity_[i] = inverse_depth[i] * focal_baseline;
  }
  find_edges();
  find_lost_at_edges(mix_bits(frame_seed + 1));
  find_occluded();
  find_oblique(inverse_depth);
  draw_noise(mix_bits(frame_seed + 2));
  finish(depth_m);
}

void StereoModel::measure_exactly(const std::vector<float>& inverse_depth,
                                  std::vector<float>& depth_m) const {
  const auto most = static_cast<float>(1 / config_.min_range_m);
  const auto least = static_cast<float>(1 / config_.max_range_m);
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    const float q = inverse_depth[i];
    depth_m[i] = q >= least && q <= most ? 1 / q : 0.0F;
  }
}

/// Marks in edge_ the two pixels that meet at each disparity step, along rows and columns.
void StereoModel::find_edges() {
  const auto threshold = static_cast<float>(config_.edge_step_px);
  const int w = width_;
  std::fill(edge_.begin(), edge_.end(), std::uint8_t{0});
  std::vector<std::uint8_t> step(size(w), 0);  // between u and u + 1
  for (int v = 0; v < height_; ++v) {
    const float* d = &disparity_[size(v) * size(w)];
    std::uint8_t* edge = &edge_[size(v) * size(w)];
    step[0] = is_step(d[0], d[0], d[1], d[2], threshold);
    for (int u = 1; u < w - 2; ++u) {
      step[size(u)] = is_step(d[u - 1], d[u], d[u + 1], d[u + 2], threshold);
    }
    step[size(w - 2)] = is_step(d[w - 3], d[w - 2], d[w - 1], d[w - 1], threshold);
    edge[0] |= step[0];
    for (int u = 1; u < w; ++u) {
      edge[u] = static_cast<std::uint8_t>(edge[u] | step[size(u)] | step[size(u - 1)]);
    }
    if (v + 1 == height_) continue;
    const float* above = v > 0 ? d - w : d;
    const float* below = d + w;
    const float* second = v + 2 < height_ ? below + w : below;
    std::uint8_t* edge_below = edge + w;
    for (int u = 0; u < w; ++u) {
      const std::uint8_t s = is_step(above[u], d[u], below[u], second[u], threshold);
      edge[u] |= s;
      edge_below[u] |= s;
    }
  }
}

/// Each pixel near an edge draws its own half width between the least and the most.
void StereoModel::find_lost_at_edges(std::uint64_t seed) {
  const int w = width_;
  const int most = config_.edge_loss_max_px;
  const int span = most - config_.edge_loss_min_px + 1;
  fill_with_random_bytes(seed, lost_.data(), lost_.size());
  if (most == 0) {
    std::fill(lost_.begin(), lost_.end(), std::uint8_t{0});
    return;
  }
  near_edge_ = edge_;
  for (int distance = 2; distance <= most; ++distance) {
    for (int v = 0; v < height_; ++v) {  // one pixel wider along rows, then along columns
      const std::uint8_t* in = &edge_[size(v) * size(w)];
      std::uint8_t* out = &widened_[size(v) * size(w)];
      out[0] = in[0] | in[1];
      for (int u = 1; u < w - 1; ++u) out[u] = in[u - 1] | in[u] | in[u + 1];
      out[w - 1] = in[w - 2] | in[w - 1];
    }
    for (int v = 0; v < height_; ++v) {
      const std::uint8_t* middle = &widened_[size(v) * size(w)];
      const std::uint8_t* above = v > 0 ? middle - w : middle;
      const std::uint8_t* below = v + 1 < height_ ? middle + w : middle;
      std::uint8_t* out = &edge_[size(v) * size(w)];
      std::uint8_t* sum = &near_edge_[size(v) * size(w)];
      for (int u = 0; u < w; ++u) {
        out[u] = above[u] | middle[u] | below[u];
        sum[u] = static_cast<std::uint8_t>(sum[u] + out[u]);
      }
    }
  }
  // A pixel at distance k counts most - k + 1; it is lost if k is at most its drawn half width.
  const int kept_up_to = most - config_.edge_loss_min_px;
  const std::size_t pixels = lost_.size();
  const std::uint8_t* near = near_edge_.data();
  std::uint8_t* lost = lost_.data();
  for (std::size_t i = 0; i < pixels; ++i) {
    lost[i] = near[i] > kept_up_to - ((lost[i] * span) >> 8) ? 1 : 0;
  }
}

/// Left-right consistency: pixel u is matched at column u - d(u) of the right image. It is lost if
/// that is outside, or if a pixel further right, hence nearer, is matched at or left of it.
void StereoModel::find_occluded() {
  constexpr int kRows = 8;  // side by side, because each row is one chain of minima
  for (int first = 0; first < height_; first += kRows) {
    const int rows = std::min(kRows, height_ - first);
    std::array<float, kRows> leftmost;
    leftmost.fill(static_cast<float>(width_));
    for (int u = width_ - 1; u >= 0; --u) {
      for (int r = 0; r < rows; ++r) {
        const std::size_t i = size(first + r) * size(width_) + size(u);
        const float match = static_cast<float>(u) - disparity_[i];
        const bool unmatched = (match < 0.0F) | (match >= leftmost[size(r)]);
        lost_[i] |= static_cast<std::uint8_t>(unmatched);
        leftmost[size(r)] = std::min(leftmost[size(r)], match);
      }
    }
  }
}

/// 1/z is linear across the image of a plane, q = a u + b v + c, so the plane's normal is
/// n = (a fx, b fy, q - a (u - cx) - b (v - cy)), and n . ray = q for the ray (x, y, 1) of the
/// pixel: cos(incidence) = q / (|n| |ray|).
void StereoModel::find_oblique(const std::vector<float>& inverse_depth) {
  const PinholeCamera camera = config_.camera();
  const auto f = static_cast<float>(camera.fx);
  const float f2 = f * f;
  const float per_f = 1 / f;
  const auto cx = static_cast<float>(camera.cx);
  const auto cos_limit = static_cast<float>(std::cos(config_.max_incidence_rad));
  const float cos2 = cos_limit * cos_limit;
  const int w = width_;
  std::vector<float> columns(size(w));  // u - cx
  for (int u = 0; u < w; ++u) columns[size(u)] = static_cast<float>(u) - cx;
  std::vector<float> row(size(w + 2));  // with one pixel extrapolated on both sides
  std::vector<float> beyond(size(w));   // the row extrapolated above the first or below the last
  for (int v = 0; v < height_; ++v) {
    const float* q = &inverse_depth[size(v) * size(w)];
    const float* above = q - w;
    const float* below = q + w;
    if (v == 0) {
      for (int u = 0; u < w; ++u) beyond[size(u)] = 2 * q[u] - below[u];
      above = beyond.data();
    } else if (v + 1 == height_) {
      for (int u = 0; u < w; ++u) beyond[size(u)] = 2 * q[u] - above[u];
      below = beyond.data();
    }
    std::copy(q, q + w, row.begin() + 1);
    row.front() = 2 * q[0] - q[1];
    row.back() = 2 * q[w - 1] - q[w - 2];
    const float* padded = row.data();
    const float* column = columns.data();
    const float dv = static_cast<float>(v) - static_cast<float>(camera.cy);
    const float y2 = 1 + (dv * per_f) * (dv * per_f);
    std::uint8_t* lost = &lost_[size(v) * size(w)];
    for (int u = 0; u < w; ++u) {
      const float du = column[u], q_u = padded[u + 1];
      const float a = lesser(q_u - padded[u], padded[u + 2] - q_u);
      const float b = lesser(q_u - above[u], below[u] - q_u);
      const float n_z = q_u - a * du - b * dv;
      const float n2 = (a * a + b * b) * f2 + n_z * n_z;
      const float ray2 = y2 + (du * per_f) * (du * per_f);
      lost[u] = static_cast<std::uint8_t>(lost[u] | (q_u * q_u < cos2 * n2 * ray2 ? 1 : 0));
    }
  }
}

/// White bytes smoothed by a triangle along rows and columns, in integers: exact, and Gaussian to
/// 0.1 in kurtosis, being a sum of noise_kernel_px^2 terms.
void StereoModel::draw_noise(std::uint64_t seed) {
  const int m = (config_.noise_kernel_px + 1) / 2;
  const int pad = config_.noise_kernel_px - 1;
  const int w = width_;
  fill_with_random_bytes(seed, white_.data(), white_.size());
  for (int v = 0; v < height_ + pad; ++v) {
    const std::int8_t* in = &white_[size(v) * size(w + pad)];
    std::int16_t* out = &smooth_[size(v) * size(w)];
    for (int u = 0; u < w; ++u) out[u] = 0;
    for (int k = 0; k <= pad; ++k) {
      const auto weight = static_cast<std::int16_t>(m - std::abs(k - m + 1));
      for (int u = 0; u < w; ++u) out[u] = static_cast<std::int16_t>(out[u] + weight * in[u + k]);
    }
  }
  for (int v = 0; v < height_; ++v) {
    std::int16_t* out = &noise_[size(v) * size(w)];
    for (int u = 0; u < w; ++u) out[u] = 0;
    for (int k = 0; k <= pad; ++k) {
      const std::int16_t* in = &smooth_[size(v + k) * size(w)];
      const auto weight = static_cast<std::int16_t>(m - std::abs(k - m + 1));
      for (int u = 0; u < w; ++u) out[u] = static_cast<std::int16_t>(out[u] + weight * in[u]);
    }
  }
}

void StereoModel::finish(std::vector<float>& depth_m) const {
  const int m = (config_.noise_kernel_px + 1) / 2;
  const auto scale = static_cast<float>(config_.disparity_sigma_px / noise_rms_);
  const auto mean = static_cast<float>(kByteMean * m * m * m * m);  // the kernel sums to m^2
  const auto step = static_cast<float>(config_.disparity_step_px);
  const auto per_step = static_cast<float>(1 / config_.disparity_step_px);
  const auto focal_baseline = static_cast<float>(config_.focal_px * config_.baseline_m);
  const auto nearest = static_cast<float>(config_.min_range_m);
  const auto furthest = static_cast<float>(config_.max_range_m);
  for (std::size_t i = 0; i < depth_m.size(); ++i) {
    const float noisy = disparity_[i] + scale * (static_cast<float>(noise_[i]) - mean);
    const float z = focal_baseline / (step * std::floor(noisy * per_step + 0.5F));
    // Zero or negative disparities give infinite or negative depths: out of range as well.
    const bool good = (z >= nearest) & (z <= furthest) & (lost_[i] == 0);
    depth_m[i] = good ? z : 0.0F;
  }
}

}  // namespace arex::sim
