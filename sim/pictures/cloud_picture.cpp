#include "pictures/cloud_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <unordered_set>
#include <vector>

#include "math/so3.h"

namespace arex::sim {
namespace {

using Colour = std::array<std::uint8_t, 3>;
constexpr Colour kPaper{28, 30, 36}, kRim{250, 250, 250};
constexpr Colour kVehicle{255, 255, 255}, kNose{255, 60, 200};
constexpr double kNear_m = 0.1;
constexpr int kRim_px = 6;

/// Blue at 0 over cyan, green and yellow to red at 1: the colours of height in RViz.
Colour rainbow(double share) {
  const double x = 4 * std::clamp(share, 0.0, 1.0);
  const auto level = [](double v) {
    return static_cast<std::uint8_t>(std::lround(255 * std::clamp(v, 0.0, 1.0)));
  };
  return {level(x - 2), level(x < 2 ? x : 4 - x), level(2 - x)};
}

Colour shaded(const Colour& colour, double light) {
  Colour out{};
  for (std::size_t i = 0; i < 3; ++i) {
    out[i] = static_cast<std::uint8_t>(std::lround(colour[i] * light));
  }
  return out;
}

/// A picture with the depth of each of its pixels.
class Canvas {
 public:
  explicit Canvas(const CloudView& view) : view_(view) {
    if (view.width < 1 || view.height < 1) throw std::invalid_argument("a picture has pixels");
    const Vec3 forward = (view.target_O - view.eye_O).normalized();
    right_ = forward.cross(Vec3::UnitZ()).normalized();
    down_ = forward.cross(right_);
    forward_ = forward;
    focal_px_ = 0.5 * view.width / std::tan(0.5 * view.field_of_view_rad);
    const auto pixels =
        static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
    depth_.assign(pixels, std::numeric_limits<float>::infinity());
    image_ = {view.width, view.height, std::vector<std::uint8_t>(3 * pixels)};
    for (std::size_t i = 0; i < pixels; ++i) paint(i, kPaper);
  }

  /// A point of O as column, row (px) and depth (m).
  [[nodiscard]] Vec3 project(const Vec3& p_O) const {
    const Vec3 p = p_O - view_.eye_O;
    const double z = forward_.dot(p);
    const double scale = focal_px_ / z;
    return {0.5 * view_.width + scale * right_.dot(p), 0.5 * view_.height + scale * down_.dot(p),
            z};
  }

  [[nodiscard]] Colour colour_at(double z_m) const {
    return rainbow((z_m - view_.low_m) / (view_.high_m - view_.low_m));
  }

  void dot(const Vec3& p_O, const Colour& colour) {
    const Vec3 at = project(p_O);
    if (!(at.z() > kNear_m)) return;
    const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
    for (int dy = 0; dy < 2; ++dy) {
      for (int dx = 0; dx < 2; ++dx) put(x + dx, y + dy, static_cast<float>(at.z()), colour);
    }
  }

  /// @pre convex, in order around it
  void quad(const std::array<Vec3, 4>& corners_O, const Colour& colour) {
    std::array<Vec3, 4> at;
    for (std::size_t i = 0; i < 4; ++i) {
      at[i] = project(corners_O[i]);
      if (!(at[i].z() > kNear_m)) return;
    }
    triangle(at[0], at[1], at[2], colour);
    triangle(at[0], at[2], at[3], colour);
  }

  /// Mixes a colour in where something nearer hides it, puts it where nothing does.
  void ghost(const Vec3& p_O, const Colour& colour) {
    const Vec3 at = project(p_O);
    if (!(at.z() > kNear_m)) return;
    const int x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
    if (x < 0 || y < 0 || x >= view_.width || y >= view_.height) return;
    const std::size_t i = index(x, y);
    if (at.z() <= static_cast<double>(depth_[i])) {
      depth_[i] = static_cast<float>(at.z());
      paint(i, colour);
      return;
    }
    for (std::size_t c = 0; c < 3; ++c) {
      image_.rgb[3 * i + c] =
          static_cast<std::uint8_t>((image_.rgb[3 * i + c] + 2 * colour[c]) / 3);
    }
  }

  [[nodiscard]] const Vec3& eye() const { return view_.eye_O; }
  [[nodiscard]] RgbImage take() { return std::move(image_); }

 private:
  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(view_.width) +
           static_cast<std::size_t>(x);
  }
  void paint(std::size_t i, const Colour& colour) {
    std::copy(colour.begin(), colour.end(),
              image_.rgb.begin() + static_cast<std::ptrdiff_t>(3 * i));
  }
  void put(int x, int y, float depth, const Colour& colour) {
    if (x < 0 || y < 0 || x >= view_.width || y >= view_.height) return;
    const std::size_t i = index(x, y);
    if (!(depth < depth_[i])) return;
    depth_[i] = depth;
    paint(i, colour);
  }

  // Pixels whose centres lie inside, by the three edge functions; 1/z is linear in the picture.
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c, const Colour& colour) {
    const auto side = [](const Vec3& p, const Vec3& q, double x, double y) {
      return (q.x() - p.x()) * (y - p.y()) - (q.y() - p.y()) * (x - p.x());
    };
    const double area = side(a, b, c.x(), c.y());
    if (area == 0) return;
    const auto pixel = [](double v, int last) {
      return static_cast<int>(std::clamp(std::floor(v), 0.0, static_cast<double>(last)));
    };
    const int x0 = pixel(std::min({a.x(), b.x(), c.x()}), view_.width - 1);
    const int x1 = pixel(std::max({a.x(), b.x(), c.x()}), view_.width - 1);
    const int y0 = pixel(std::min({a.y(), b.y(), c.y()}), view_.height - 1);
    const int y1 = pixel(std::max({a.y(), b.y(), c.y()}), view_.height - 1);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const double px = x + 0.5, py = y + 0.5;
        const double wa = side(b, c, px, py) / area, wb = side(c, a, px, py) / area;
        const double wc = 1 - wa - wb;
        if (wa < 0 || wb < 0 || wc < 0) continue;
        put(x, y, static_cast<float>(1 / (wa / a.z() + wb / b.z() + wc / c.z())), colour);
      }
    }
  }

  CloudView view_;
  Vec3 right_, down_, forward_;
  double focal_px_ = 1;
  std::vector<float> depth_;
  RgbImage image_;
};

/// A ring around the vehicle and a line to its nose, thick enough to be found.
void draw_vehicle(Canvas& canvas, const VehicleMark& vehicle) {
  constexpr int kSteps = 720;
  for (double grown = 0.85; grown <= 1.151; grown += 0.05) {
    for (int i = 0; i < kSteps; ++i) {
      const double angle = 2 * std::numbers::pi * i / kSteps;
      const Vec3 p(std::cos(angle), std::sin(angle), 0);
      canvas.ghost(vehicle.X_OB * Vec3(grown * vehicle.radius_m * p), kVehicle);
    }
  }
  for (int i = 0; i < kSteps; ++i) {
    const double along = 2.5 * vehicle.radius_m * i / kSteps;
    for (double across = -0.1; across <= 0.101; across += 0.025) {
      canvas.ghost(vehicle.X_OB * Vec3(along, across * vehicle.radius_m, 0), kNose);
    }
  }
}

/// Cells of a lattice, to be asked whether they are there.
class CellSet {
 public:
  CellSet(std::span<const Vec3f> centres, double edge_m) : edge_m_(edge_m) {
    for (const Vec3f& p : centres) keys_.insert(key(cell_of(p)));
  }
  [[nodiscard]] Eigen::Vector3i cell_of(const Vec3f& p) const {
    return (p.cast<double>() / edge_m_).array().floor().cast<int>();
  }
  [[nodiscard]] bool contains(const Eigen::Vector3i& cell) const {
    return keys_.contains(key(cell));
  }

 private:
  static std::uint64_t key(const Eigen::Vector3i& cell) {
    constexpr int kMiddle = 1 << 20;
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      key = key << 21 | static_cast<std::uint64_t>(cell[axis] + kMiddle);
    }
    return key;
  }
  double edge_m_;
  std::unordered_set<std::uint64_t> keys_;
};

// A face of a cell, if it looks at the eye and no other cell stands before it.
void draw_face(Canvas& canvas, const CellSet& cells, const Vec3f& centre, double edge_m, int axis,
               int sign) {
  constexpr std::array<double, 3> kLight{0.78, 0.62, 1.0};  // of faces across x, y and z
  const Vec3 normal = sign * Vec3::Unit(axis);
  const Vec3 middle = centre.cast<double>() + 0.5 * edge_m * normal;
  if (normal.dot(canvas.eye() - middle) <= 0) return;
  Eigen::Vector3i before = cells.cell_of(centre);
  before[axis] += sign;
  if (cells.contains(before)) return;
  const Vec3 u = 0.5 * edge_m * Vec3::Unit((axis + 1) % 3);
  const Vec3 v = 0.5 * edge_m * Vec3::Unit((axis + 2) % 3);
  canvas.quad({middle - u - v, middle + u - v, middle + u + v, middle - u + v},
              shaded(canvas.colour_at(static_cast<double>(centre.z())),
                     kLight[static_cast<std::size_t>(axis)]));
}

}  // namespace

CloudView view_behind(const Pose& X_OB, double reach_m) {
  CloudView view;
  const Mat3 R = so3::from_yaw(so3::yaw(X_OB.R));
  view.eye_O = X_OB.p + R * Vec3(-0.95 * reach_m, 0, 0.95 * reach_m);
  view.target_O = X_OB.p + R * Vec3(0.1 * reach_m, 0, 0);
  view.low_m = X_OB.p.z() - 1.5;
  view.high_m = X_OB.p.z() + 1.5;
  return view;
}

RgbImage draw_points(std::span<const Vec3f> points_O, const CloudView& view,
                     const VehicleMark& vehicle) {
  Canvas canvas(view);
  for (const Vec3f& p : points_O) {
    if (p.allFinite()) {
      canvas.dot(p.cast<double>(), canvas.colour_at(static_cast<double>(p.z())));
    }
  }
  draw_vehicle(canvas, vehicle);
  return canvas.take();
}

RgbImage draw_cells(std::span<const Vec3f> centres_O, double edge_m, const CloudView& view,
                    const VehicleMark& vehicle) {
  Canvas canvas(view);
  const CellSet cells(centres_O, edge_m);
  for (const Vec3f& centre : centres_O) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int sign : {-1, 1}) draw_face(canvas, cells, centre, edge_m, axis, sign);
    }
  }
  draw_vehicle(canvas, vehicle);
  return canvas.take();
}

RgbImage tile_of_four(const RgbImage& upper_left, const RgbImage& upper_right,
                      const RgbImage& lower_left, const RgbImage& lower_right) {
  const int width = upper_left.width, height = upper_left.height;
  RgbImage all{2 * width + kRim_px, 2 * height + kRim_px, {}};
  for (int i = 0; i < all.width * all.height; ++i) {
    all.rgb.insert(all.rgb.end(), kRim.begin(), kRim.end());
  }
  const auto place = [&](const RgbImage& part, int x0, int y0) {
    if (part.width != width || part.height != height) {
      throw std::invalid_argument("four pictures of one size make one");
    }
    for (int y = 0; y < height; ++y) {
      const auto row = part.rgb.begin() + 3 * static_cast<std::ptrdiff_t>(y) * width;
      std::copy(row, row + 3 * static_cast<std::ptrdiff_t>(width),
                all.rgb.begin() + 3 * (static_cast<std::ptrdiff_t>(y0 + y) * all.width + x0));
    }
  };
  place(upper_left, 0, 0);
  place(upper_right, width + kRim_px, 0);
  place(lower_left, 0, height + kRim_px);
  place(lower_right, width + kRim_px, height + kRim_px);
  return all;
}

}  // namespace arex::sim
