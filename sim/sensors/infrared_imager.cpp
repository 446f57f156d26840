#include "sensors/infrared_imager.h"

#include <algorithm>
#include <cmath>

#include "math/mix.h"

// Plain loops over rows that the compiler turns into vector code (CMakeLists.txt gives this file
// -O3); no loop carries a float sum, so the vector width changes no bit.
namespace arex::sim {
namespace {

constexpr float kFullScale = 255;
constexpr int kMostTaps = 48;
constexpr float kLeastSmear = 0.25F;  // less changes nothing that noise and optics leave, px

std::size_t size(int n) { return static_cast<std::size_t>(n); }

/// Mean 0 and standard deviation 1, from a number: the sum of its hash's four bytes, which are
/// uniform. Its tails end at 3.5.
inline float unit_noise(std::uint32_t n) {
  // Two rounds of xor-shift and multiplication (MurmurHash3's finaliser).
  std::uint32_t h = n;
  h ^= h >> 16;
  h *= 0x85EBCA6BU;
  h ^= h >> 13;
  h *= 0xC2B2AE35U;
  h ^= h >> 16;
  const std::uint32_t pairs = (h & 0x00FF00FFU) + ((h >> 8) & 0x00FF00FFU);
  const auto sum = static_cast<std::int32_t>((pairs & 0xFFFFU) + (pairs >> 16));
  constexpr float kMean = 510, kPerSigma = 0.0067658234F;  // 1 / sqrt(4 (256^2 - 1) / 12)
  return (static_cast<float>(sum) - kMean) * kPerSigma;
}

}  // namespace

Vec2 image_velocity(const PinholeCamera& camera, const CameraTwist& twist, double x, double y,
                    double q) {
  const Vec3 &v = twist.v_C, &w = twist.w_C;
  return {camera.fx * (q * (x * v.z() - v.x()) + x * y * w.x() - (1 + x * x) * w.y() + y * w.z()),
          camera.fy * (q * (y * v.z() - v.y()) + (1 + y * y) * w.x() - x * y * w.y() - x * w.z())};
}

InfraredImager::InfraredImager(const InfraredSensorConfig& config, const PinholeCamera& camera)
    : config_(config), camera_(camera) {
  const double corner = camera.cx * camera.cx + camera.cy * camera.cy;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double du = u - camera.cx, dv = v - camera.cy;
      vignette_.push_back(static_cast<float>(1 - config.vignetting * (du * du + dv * dv) / corner));
    }
  }
}

void InfraredImager::expose(const InfraredScene& scene, const InfraredExposure& exposure,
                            const CameraTwist& twist, std::uint64_t seed,
                            std::vector<std::uint8_t>& grey) {
  if (config_.motion_blur) {
    smear(scene, exposure.exposure_s, twist);
  } else {
    smeared_ = scene.light_lx;
  }
  spread();
  read(exposure, seed, grey);
}

/// Each pixel takes the mean of the light along the way that its own surface's image goes.
void InfraredImager::smear(const InfraredScene& scene, double exposure_s,
                           const CameraTwist& twist) {
  const int w = camera_.width, h = camera_.height;
  const std::vector<float>& in = scene.light_lx;
  smeared_.resize(in.size());
  const auto sample = [&](float u, float v) {
    const float cu = std::clamp(u, 0.0F, static_cast<float>(w) - 1.001F);
    const float cv = std::clamp(v, 0.0F, static_cast<float>(h) - 1.001F);
    const auto column = static_cast<int>(cu), row = static_cast<int>(cv);
    const float du = cu - static_cast<float>(column), dv = cv - static_cast<float>(row);
    const float* at = &in[size(row) * size(w) + size(column)];
    const float upper = at[0] + du * (at[1] - at[0]);
    const float lower = at[w] + du * (at[w + 1] - at[w]);
    return upper + dv * (lower - upper);
  };
  for (int v = 0; v < h; ++v) {
    const double y = (v - camera_.cy) / camera_.fy;
    for (int u = 0; u < w; ++u) {
      const std::size_t i = size(v) * size(w) + size(u);
      const double x = (u - camera_.cx) / camera_.fx;
      const double q = static_cast<double>(scene.inverse_depth[i]);
      const Vec2 way = exposure_s * image_velocity(camera_, twist, x, y, q);
      const auto du = static_cast<float>(way.x()), dv = static_cast<float>(way.y());
      const float length = std::max(std::abs(du), std::abs(dv));
      if (length < kLeastSmear) {
        smeared_[i] = in[i];
        continue;
      }
      const int taps = std::min(kMostTaps, static_cast<int>(length) + 2);
      const float step = 1 / static_cast<float>(taps);
      float sum = 0;
      for (int k = 0; k < taps; ++k) {
        const float s = (static_cast<float>(k) + 0.5F) * step - 0.5F;
        sum += sample(static_cast<float>(u) + s * du, static_cast<float>(v) + s * dv);
      }
      smeared_[i] = sum * step;
    }
  }
}

/// The optics' kernel: a, 1 - 2a, a along rows, then along columns.
void InfraredImager::spread() {
  const int w = camera_.width, h = camera_.height;
  const auto a = static_cast<float>(config_.blur_kernel);
  const float centre = 1 - 2 * a;
  rows_.resize(smeared_.size());
  spread_.resize(smeared_.size());
  for (int v = 0; v < h; ++v) {
    const float* in = &smeared_[size(v) * size(w)];
    float* out = &rows_[size(v) * size(w)];
    out[0] = (centre + a) * in[0] + a * in[1];
    for (int u = 1; u < w - 1; ++u) out[u] = centre * in[u] + a * (in[u - 1] + in[u + 1]);
    out[w - 1] = (centre + a) * in[w - 1] + a * in[w - 2];
  }
  for (int v = 0; v < h; ++v) {
    const float* in = &rows_[size(v) * size(w)];
    const float* above = v > 0 ? in - w : in;
    const float* below = v + 1 < h ? in + w : in;
    float* out = &spread_[size(v) * size(w)];
    for (int u = 0; u < w; ++u) out[u] = centre * in[u] + a * (above[u] + below[u]);
  }
}

void InfraredImager::read(const InfraredExposure& exposure, std::uint64_t seed,
                          std::vector<std::uint8_t>& grey) {
  const auto electrons_per_lx =
      static_cast<float>(config_.sensitivity_e_per_lx_s * exposure.exposure_s);
  const auto grey_per_electron =
      static_cast<float>(exposure.gain * static_cast<double>(kFullScale) / config_.full_well_e);
  const auto full_well = static_cast<float>(config_.full_well_e);
  const auto read_variance = static_cast<float>(config_.read_noise_e * config_.read_noise_e);
  const float noise = config_.noise_free ? 0.0F : 1.0F;
  const auto base = static_cast<std::uint32_t>(mix_bits(seed));
  grey.resize(spread_.size());
  for (std::size_t i = 0; i < grey.size(); ++i) {
    const float light = spread_[i] * vignette_[i] * electrons_per_lx;
    const float electrons = light < full_well ? light : full_well;
    const float sigma = std::sqrt(electrons + read_variance) * noise;
    const auto pixel = static_cast<std::uint32_t>(i) * 0x9E3779B9U + base;
    const float value = (electrons + sigma * unit_noise(pixel)) * grey_per_electron + 0.5F;
    const float clipped = value < 0 ? 0.0F : value > kFullScale ? kFullScale : value;
    grey[i] = static_cast<std::uint8_t>(static_cast<std::int32_t>(clipped));
  }
}

}  // namespace arex::sim
