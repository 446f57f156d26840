#include "sensors/infrared_imager.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "math/mix.h"

// Plain loops over rows that the compiler turns into vector code (CMakeLists.txt gives this file
// -O3); no loop carries a float sum, so the vector width changes no bit.
namespace arex::sim {
namespace {

constexpr float kFullScale = 255;
constexpr std::size_t kPieces = 8;  // that an image's rows are divided in
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
  for (int u = 0; u < camera.width; ++u) {
    column_x_.push_back(static_cast<float>((u - camera.cx) / camera.fx));
  }
  const double corner = camera.cx * camera.cx + camera.cy * camera.cy;
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const double du = u - camera.cx, dv = v - camera.cy;
      vignette_.push_back(static_cast<float>(1 - config.vignetting * (du * du + dv * dv) / corner));
    }
  }
}

InfraredImager::Rows InfraredImager::rows_of(std::size_t piece) const {
  const auto begin = [this](std::size_t i) {
    return static_cast<int>(i) * camera_.height / static_cast<int>(kPieces);
  };
  return {begin(piece), begin(piece + 1)};
}

void InfraredImager::expose(const InfraredScene& scene, const InfraredExposure& exposure,
                            const CameraTwist& twist, std::uint64_t seed,
                            std::vector<std::uint8_t>& grey, const Split& split) {
  for (std::vector<float>* image : {&smeared_, &rows_, &spread_}) {
    image->resize(scene.light_lx.size());
  }
  grey.resize(scene.light_lx.size());
  split(kPieces, [&](std::size_t piece) {
    const Rows rows = rows_of(piece);
    smear(scene, exposure.exposure_s, twist, rows);
    spread_along_rows(rows);
  });
  split(kPieces, [&](std::size_t piece) {
    const Rows rows = rows_of(piece);
    spread_along_columns(rows);
    read(exposure, seed, rows, grey);
  });
}

/// How far the images of a row's surfaces go while the shutter is open, px: image_velocity() in
/// single precision, its constants taken out of the loop.
void InfraredImager::find_ways(const InfraredScene& scene, int v, double exposure_s,
                               const CameraTwist& twist, Ways& ways) const {
  const auto f = static_cast<float>(exposure_s);
  const float scale_u = f * static_cast<float>(camera_.fx);
  const float scale_v = f * static_cast<float>(camera_.fy);
  const Vec3f vel = twist.v_C.cast<float>(), w = twist.w_C.cast<float>();
  const auto y = static_cast<float>((v - camera_.cy) / camera_.fy);
  const float along_v = y * vel.z() - vel.y(), turn_v = (1 + y * y) * w.x();
  const float slope_u = y * w.x(), slope_v = -(y * w.y() + w.z()), turn_u = y * w.z() - w.y();
  const float* q = &scene.inverse_depth[size(v) * size(camera_.width)];
  float *way_u = ways.u.data(), *way_v = ways.v.data();
  for (std::size_t u = 0; u < size(camera_.width); ++u) {
    const float x = column_x_[u];
    way_u[u] = scale_u * (q[u] * (x * vel.z() - vel.x()) + x * (slope_u - x * w.y()) + turn_u);
    way_v[u] = scale_v * (q[u] * along_v + turn_v + x * slope_v);
  }
}

/// Mean of the image along a way through a pixel's centre.
float InfraredImager::mean_along(const std::vector<float>& in, int u, int v, float du,
                                 float dv) const {
  const float length = std::max(std::abs(du), std::abs(dv));
  const int taps = std::min(kMostTaps, static_cast<int>(length) + 2);
  const float step = 1 / static_cast<float>(taps);
  const float last_u = static_cast<float>(camera_.width) - 1.001F;
  const float last_v = static_cast<float>(camera_.height) - 1.001F;
  float s = 0.5F * step - 0.5F, sum = 0;
  for (int k = 0; k < taps; ++k, s += step) {
    const float cu = std::min(std::max(static_cast<float>(u) + s * du, 0.0F), last_u);
    const float cv = std::min(std::max(static_cast<float>(v) + s * dv, 0.0F), last_v);
    const auto column = static_cast<int>(cu), row = static_cast<int>(cv);
    const float a = cu - static_cast<float>(column), b = cv - static_cast<float>(row);
    const float* at = &in[static_cast<std::size_t>(row * camera_.width + column)];
    const float* below = at + camera_.width;
    const float upper = at[0] + a * (at[1] - at[0]);
    const float lower = below[0] + a * (below[1] - below[0]);
    sum += upper + b * (lower - upper);
  }
  return sum * step;
}

/// The same of eight pixels from (u, v) on, each along its own way.
Float8 InfraredImager::mean_along_eight(const std::vector<float>& in, int u, int v,
                                        const Ways& ways) const {
  Float8 du, dv;
  std::memcpy(&du, &ways.u[size(u)], sizeof du);
  std::memcpy(&dv, &ways.v[size(u)], sizeof dv);
  const Float8 zero{}, across = du < 0 ? -du : du, along = dv < 0 ? -dv : dv;
  const Float8 length = across < along ? along : across;
  const Int8 wanted = __builtin_convertvector(length, Int8) + 2;
  const Int8 taps = wanted < kMostTaps ? wanted : kMostTaps - Int8{};
  int most = 0;
  for (int i = 0; i < 8; ++i) most = std::max(most, taps[i]);
  const Float8 step = 1 / __builtin_convertvector(taps, Float8);
  const Float8 last_u = zero + (static_cast<float>(camera_.width) - 1.001F);
  const Float8 last_v = zero + (static_cast<float>(camera_.height) - 1.001F);
  const auto within = [&zero](const Float8& x, const Float8& last) {
    const Float8 low = x < zero ? zero : x;
    return last < low ? last : low;
  };
  const Float8 from_u = static_cast<float>(u) + Float8{0, 1, 2, 3, 4, 5, 6, 7};
  const Float8 from_v = zero + static_cast<float>(v);
  const float* next_row = in.data() + camera_.width;
  Float8 s = 0.5F * step - 0.5F, sum{};
  for (int k = 0; k < most; ++k, s += step) {
    const Float8 cu = within(from_u + s * du, last_u), cv = within(from_v + s * dv, last_v);
    const Int8 column = __builtin_convertvector(cu, Int8), row = __builtin_convertvector(cv, Int8);
    const Float8 a = cu - __builtin_convertvector(column, Float8);
    const Float8 b = cv - __builtin_convertvector(row, Float8);
    const Int8 at = row * camera_.width + column;
    const Neighbours here = gather_neighbours(in.data(), at);
    const Neighbours below = gather_neighbours(next_row, at);
    const Float8 upper = here.left + a * (here.right - here.left);
    const Float8 lower = below.left + a * (below.right - below.left);
    sum += k < taps ? upper + b * (lower - upper) : zero;
  }
  return sum * step;
}

/// Each pixel takes the mean of the light along the way that its own surface's image goes, and the
/// light that stays where it is.
void InfraredImager::smear(const InfraredScene& scene, double exposure_s, const CameraTwist& twist,
                           const Rows& rows) {
  const int w = camera_.width;
  Ways ways{std::vector<float>(column_x_.size()), std::vector<float>(column_x_.size())};
  for (int v = rows.first; v < rows.end; ++v) {
    const float* in = &scene.light_lx[size(v) * size(w)];
    float* out = &smeared_[size(v) * size(w)];
    std::copy(in, in + w, out);
    if (config_.motion_blur) smear_row(scene, exposure_s, twist, v, ways);
    if (scene.steady_lx.empty()) continue;
    const float* steady = &scene.steady_lx[size(v) * size(w)];
    for (int u = 0; u < w; ++u) out[u] += steady[u];
  }
}

void InfraredImager::smear_row(const InfraredScene& scene, double exposure_s,
                               const CameraTwist& twist, int v, Ways& ways) {
  const int w = camera_.width;
  find_ways(scene, v, exposure_s, twist, ways);
  float* out = &smeared_[size(v) * size(w)];
  const auto moves = [&](int u) {
    return !(std::max(std::abs(ways.u[size(u)]), std::abs(ways.v[size(u)])) < kLeastSmear);
  };
  for (int u = 0; u < w;) {
    if (u + 8 <= w) {
      std::array<bool, 8> moved{};
      for (int i = 0; i < 8; ++i) moved[size(i)] = moves(u + i);
      if (std::find(moved.begin(), moved.end(), true) != moved.end()) {
        const Float8 mean = mean_along_eight(scene.light_lx, u, v, ways);
        for (int i = 0; i < 8; ++i) out[u + i] = moved[size(i)] ? mean[i] : out[u + i];
      }
      u += 8;
      continue;
    }
    if (moves(u)) {
      out[u] = mean_along(scene.light_lx, u, v, ways.u[size(u)], ways.v[size(u)]);
    }
    ++u;
  }
}

/// The optics' kernel: a, 1 - 2a, a along rows, then along columns.
void InfraredImager::spread_along_rows(const Rows& rows) {
  const int w = camera_.width;
  const auto a = static_cast<float>(config_.blur_kernel);
  const float centre = 1 - 2 * a;
  for (int v = rows.first; v < rows.end; ++v) {
    const float* in = &smeared_[size(v) * size(w)];
    float* out = &rows_[size(v) * size(w)];
    out[0] = (centre + a) * in[0] + a * in[1];
    for (int u = 1; u < w - 1; ++u) out[u] = centre * in[u] + a * (in[u - 1] + in[u + 1]);
    out[w - 1] = (centre + a) * in[w - 1] + a * in[w - 2];
  }
}

void InfraredImager::spread_along_columns(const Rows& rows) {
  const int w = camera_.width, h = camera_.height;
  const auto a = static_cast<float>(config_.blur_kernel);
  const float centre = 1 - 2 * a;
  for (int v = rows.first; v < rows.end; ++v) {
    const float* in = &rows_[size(v) * size(w)];
    const float* above = v > 0 ? in - w : in;
    const float* below = v + 1 < h ? in + w : in;
    float* out = &spread_[size(v) * size(w)];
    for (int u = 0; u < w; ++u) out[u] = centre * in[u] + a * (above[u] + below[u]);
  }
}

void InfraredImager::read(const InfraredExposure& exposure, std::uint64_t seed, const Rows& rows,
                          std::vector<std::uint8_t>& grey) const {
  const auto electrons_per_lx =
      static_cast<float>(config_.sensitivity_e_per_lx_s * exposure.exposure_s);
  const auto grey_per_electron =
      static_cast<float>(exposure.gain * static_cast<double>(kFullScale) / config_.full_well_e);
  const auto full_well = static_cast<float>(config_.full_well_e);
  const auto read_variance = static_cast<float>(config_.read_noise_e * config_.read_noise_e);
  const float noise = config_.noise_free ? 0.0F : 1.0F;
  const auto base = static_cast<std::uint32_t>(mix_bits(seed));
  const std::size_t end = size(rows.end) * size(camera_.width);
  for (std::size_t i = size(rows.first) * size(camera_.width); i < end; ++i) {
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
