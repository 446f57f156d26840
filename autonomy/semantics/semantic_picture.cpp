#include "semantics/semantic_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace arex {
namespace {

struct Colour {
  std::uint8_t r = 0, g = 0, b = 0;
};

constexpr Colour kPaper{252, 251, 248}, kInk{40, 40, 44}, kPath{36, 100, 200};
constexpr int kMargin = 24, kKey = 64;  // px

Colour colour_of(SemanticClass kind) {
  switch (kind) {
    case SemanticClass::kGround:
      return {196, 180, 150};
    case SemanticClass::kTrunk:
      return {178, 44, 30};
    case SemanticClass::kCanopy:
      return {92, 150, 84};
    case SemanticClass::kUndergrowth:
      return {170, 190, 110};
    case SemanticClass::kFloor:
      return {222, 222, 218};
    case SemanticClass::kRamp:
      return {236, 206, 120};
    case SemanticClass::kWall:
      return {70, 74, 84};
    case SemanticClass::kPillar:
      return {190, 40, 40};
    case SemanticClass::kCar:
      return {52, 104, 190};
    case SemanticClass::kDoor:
      return {236, 140, 30};
    default:
      return {150, 150, 150};
  }
}

Colour mix(Colour a, Colour b, double share) {
  const auto one = [&](std::uint8_t x, std::uint8_t y) {
    return static_cast<std::uint8_t>(std::lround((1 - share) * x + share * y));
  };
  return {one(a.r, b.r), one(a.g, b.g), one(a.b, b.b)};
}

// Columns of 7 dots, the lowest bit on top: A to Z, 0 to 9.
constexpr std::array<std::array<std::uint8_t, 5>, 36> kFont{{
    {0x7e, 0x11, 0x11, 0x11, 0x7e}, {0x7f, 0x49, 0x49, 0x49, 0x36}, {0x3e, 0x41, 0x41, 0x41, 0x22},
    {0x7f, 0x41, 0x41, 0x22, 0x1c}, {0x7f, 0x49, 0x49, 0x49, 0x41}, {0x7f, 0x09, 0x09, 0x09, 0x01},
    {0x3e, 0x41, 0x49, 0x49, 0x7a}, {0x7f, 0x08, 0x08, 0x08, 0x7f}, {0x00, 0x41, 0x7f, 0x41, 0x00},
    {0x20, 0x40, 0x41, 0x3f, 0x01}, {0x7f, 0x08, 0x14, 0x22, 0x41}, {0x7f, 0x40, 0x40, 0x40, 0x40},
    {0x7f, 0x02, 0x0c, 0x02, 0x7f}, {0x7f, 0x04, 0x08, 0x10, 0x7f}, {0x3e, 0x41, 0x41, 0x41, 0x3e},
    {0x7f, 0x09, 0x09, 0x09, 0x06}, {0x3e, 0x41, 0x51, 0x21, 0x5e}, {0x7f, 0x09, 0x19, 0x29, 0x46},
    {0x46, 0x49, 0x49, 0x49, 0x31}, {0x01, 0x01, 0x7f, 0x01, 0x01}, {0x3f, 0x40, 0x40, 0x40, 0x3f},
    {0x1f, 0x20, 0x40, 0x20, 0x1f}, {0x3f, 0x40, 0x38, 0x40, 0x3f}, {0x63, 0x14, 0x08, 0x14, 0x63},
    {0x07, 0x08, 0x70, 0x08, 0x07}, {0x61, 0x51, 0x49, 0x45, 0x43}, {0x3e, 0x51, 0x49, 0x45, 0x3e},
    {0x00, 0x42, 0x7f, 0x40, 0x00}, {0x42, 0x61, 0x51, 0x49, 0x46}, {0x21, 0x41, 0x45, 0x4b, 0x31},
    {0x18, 0x14, 0x12, 0x7f, 0x10}, {0x27, 0x45, 0x45, 0x45, 0x39}, {0x3c, 0x4a, 0x49, 0x49, 0x30},
    {0x01, 0x71, 0x09, 0x05, 0x03}, {0x36, 0x49, 0x49, 0x49, 0x36}, {0x06, 0x49, 0x49, 0x29, 0x1e},
}};

/// Draws in metres of the map, or in pixels.
class Canvas {
 public:
  Canvas(const Raster& extent, double px_per_m)
      : low_(extent.low), high_y_(extent.low.y() + extent.rows * extent.cell_m), scale_(px_per_m) {
    image.width =
        2 * kMargin + static_cast<int>(std::ceil(extent.columns * extent.cell_m * scale_));
    image.width = std::max(image.width, 520);
    image.height =
        2 * kMargin + kKey + static_cast<int>(std::ceil(extent.rows * extent.cell_m * scale_));
    image.rgb.resize(3 * static_cast<std::size_t>(image.width) *
                     static_cast<std::size_t>(image.height));
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) set(x, y, kPaper, 1);
    }
  }
  RgbImage image;

  [[nodiscard]] Vec2 pixel(const Vec2& p) const {
    return {kMargin + (p.x() - low_.x()) * scale_, kMargin + (high_y_ - p.y()) * scale_};
  }
  void set(int x, int y, Colour colour, double share) {
    if (x < 0 || y < 0 || x >= image.width || y >= image.height) return;
    std::uint8_t* at =
        &image.rgb[3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(x))];
    const Colour now = share >= 1 ? colour : mix({at[0], at[1], at[2]}, colour, share);
    at[0] = now.r;
    at[1] = now.g;
    at[2] = now.b;
  }
  /// Every pixel within a shape given by its signed distance in pixels from `centre`, soft edges.
  template <class Distance>
  void fill(const Vec2& centre, double reach, Colour colour, double share, Distance distance) {
    const int x0 = std::max(0, static_cast<int>(centre.x() - reach) - 1);
    const int x1 = std::min(image.width - 1, static_cast<int>(centre.x() + reach) + 1);
    const int y0 = std::max(0, static_cast<int>(centre.y() - reach) - 1);
    const int y1 = std::min(image.height - 1, static_cast<int>(centre.y() + reach) + 1);
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x) {
        const double d = distance(Vec2(x + 0.5 - centre.x(), y + 0.5 - centre.y()));
        if (d < 0.5) set(x, y, colour, share * std::clamp(0.5 - d, 0.0, 1.0));
      }
    }
  }
  void disc(const Vec2& p, double radius_px, Colour colour, double share) {
    fill(pixel(p), radius_px, colour, share, [&](const Vec2& d) { return d.norm() - radius_px; });
  }
  void ring(const Vec2& p, double radius_px, double width_px, Colour colour, double share) {
    fill(pixel(p), radius_px + width_px, colour, share,
         [&](const Vec2& d) { return std::abs(d.norm() - radius_px) - width_px / 2; });
  }
  void line(const Vec2& a, const Vec2& b, double width_px, Colour colour, double share = 1) {
    const Vec2 p = pixel(a), q = pixel(b), d = q - p;
    fill(0.5 * (p + q), 0.5 * d.norm() + width_px, colour, share, [&](const Vec2& at) {
      const Vec2 from = at + 0.5 * (p + q) - p;
      const double t =
          d.squaredNorm() > 0 ? std::clamp(from.dot(d) / d.squaredNorm(), 0.0, 1.0) : 0;
      return (from - t * d).norm() - width_px / 2;
    });
  }
  void rectangle(const SemanticObject& object, Colour colour, double share, double border_px) {
    const Vec2 u(std::cos(object.yaw_rad), -std::sin(object.yaw_rad)), v(-u.y(), u.x());
    const double a = 0.5 * object.size.x() * scale_, b = 0.5 * object.size.y() * scale_;
    const auto distance = [&](const Vec2& d) {
      return std::max(std::abs(d.dot(u)) - a, std::abs(d.dot(v)) - b);
    };
    const Vec2 centre = pixel(object.position.head<2>());
    fill(centre, std::hypot(a, b) + border_px, colour, share, distance);
    if (border_px <= 0) return;
    fill(centre, std::hypot(a, b) + border_px, colour, 1,
         [&](const Vec2& d) { return std::abs(distance(d)) - border_px / 2; });
  }
  /// Text in capitals, twice the font's size. @return the pixels that it took
  int text(int x, int y, std::string_view words, Colour colour) {
    constexpr int kSize = 2;
    const int start = x;
    for (const char raw : words) {
      const char c = static_cast<char>(std::toupper(static_cast<unsigned char>(raw)));
      const int glyph = c >= 'A' && c <= 'Z' ? c - 'A' : c >= '0' && c <= '9' ? 26 + c - '0' : -1;
      for (int column = 0; glyph >= 0 && column < 5; ++column) {
        const std::uint8_t dots =
            kFont[static_cast<std::size_t>(glyph)][static_cast<std::size_t>(column)];
        for (int row = 0; row < 7 * kSize; ++row) {
          if ((dots >> (row / kSize) & 1) == 0) continue;
          for (int k = 0; k < kSize; ++k) set(x + column * kSize + k, y + row, colour, 1);
        }
      }
      x += 6 * kSize;
    }
    return x - start;
  }
  void box(int x, int y, int width, int height, Colour colour) {
    for (int j = 0; j < height; ++j) {
      for (int i = 0; i < width; ++i) set(x + i, y + j, colour, 1);
    }
  }
  [[nodiscard]] double scale() const { return scale_; }

 private:
  Vec2 low_;
  double high_y_, scale_;
};

/// Ground or floor by its height, lit from the north-west, and the canopy over it.
void draw_ground(const SemanticMap& map, Canvas& canvas) {
  const Raster& seen = map.density;
  std::vector<float> heights;
  const auto ground_at = [&](const Vec2& p) {
    return map.ground.values[map.ground.cell_of(p.x(), p.y())];
  };
  for (int r = 0; r < seen.rows; ++r) {
    for (int c = 0; c < seen.columns; ++c) {
      const float z = ground_at(seen.centre(c, r));
      if (seen.values[seen.index(c, r)] > 0 && std::isfinite(z)) heights.push_back(z);
    }
  }
  if (heights.empty()) return;
  std::sort(heights.begin(), heights.end());
  const auto low = static_cast<double>(heights[heights.size() / 20]);
  const auto high = static_cast<double>(heights[heights.size() - 1 - heights.size() / 20]);
  const bool forest = map.scene == SceneKind::kForest;
  const Colour base = colour_of(forest ? SemanticClass::kGround : SemanticClass::kFloor);
  const int px = static_cast<int>(std::ceil(seen.cell_m * canvas.scale()));
  for (int r = 0; r < seen.rows; ++r) {
    for (int c = 0; c < seen.columns; ++c) {
      const std::size_t i = seen.index(c, r);
      const Vec2 p = seen.centre(c, r);
      const auto z = static_cast<double>(ground_at(p));
      if (!(seen.values[i] > 0) || !std::isfinite(z)) continue;
      const double share = high > low ? std::clamp((z - low) / (high - low), 0.0, 1.0) : 0.5;
      Colour colour =
          mix(mix(base, {120, 100, 70}, forest ? 0.35 : 0.1), {255, 252, 240}, 0.6 * share);
      const auto top = static_cast<double>(map.canopy.values[i]);
      if (forest && top > 1.5) {
        colour = mix(colour, colour_of(SemanticClass::kCanopy), std::min(0.75, 0.25 + 0.05 * top));
      } else if (forest && top > 0.3) {
        colour = mix(colour, colour_of(SemanticClass::kUndergrowth), 0.5);
      }
      const Vec2 corner = canvas.pixel(p + 0.5 * seen.cell_m * Vec2(-1, 1));
      canvas.box(static_cast<int>(std::floor(corner.x())), static_cast<int>(std::floor(corner.y())),
                 px, px, colour);
    }
  }
}

void draw_object(const SemanticObject& object, Canvas& canvas) {
  const Colour colour = colour_of(object.kind);
  const Vec2 p = object.position.head<2>();
  const Vec2 half =
      0.5 * object.size.x() * Vec2(std::cos(object.yaw_rad), std::sin(object.yaw_rad));
  switch (object.kind) {
    case SemanticClass::kTrunk:
      canvas.ring(p, 0.5 * object.canopy_diameter * canvas.scale(), 1.2, {40, 96, 44}, 0.5);
      canvas.disc(p, std::max(3.0, 0.5 * object.size.x() * canvas.scale()), colour, 1);
      break;
    case SemanticClass::kWall:
      canvas.line(p - half, p + half, std::max(2.0, 0.12 * canvas.scale()), colour);
      break;
    case SemanticClass::kDoor:
      canvas.line(p - half, p + half, std::max(4.0, 0.3 * canvas.scale()), colour);
      break;
    case SemanticClass::kPillar:
      canvas.rectangle(object, colour, 1, 0);
      break;
    default:
      canvas.rectangle(object, colour, 0.35, 2);
  }
}

/// Colours with the number of each class, and the scale's bar.
void draw_key(const SemanticMap& map, Canvas& canvas) {
  const int y = canvas.image.height - kKey - kMargin / 2 + 8;
  int x = kMargin;
  for (std::size_t k = 0; k < kSemanticClassNames.size(); ++k) {
    const auto kind = static_cast<SemanticClass>(k);
    const std::size_t count = map.count(kind);
    if (count == 0) continue;
    canvas.box(x, y, 14, 14, colour_of(kind));
    x += 20;
    x += canvas.text(x, y, std::string(kSemanticClassNames[k]) + " " + std::to_string(count), kInk);
    x += 18;
  }
  double length = 1;
  for (const double candidate : {2., 5., 10., 20., 50., 100., 200.}) {
    if (candidate * canvas.scale() < 0.25 * canvas.image.width) length = candidate;
  }
  const int bar = static_cast<int>(length * canvas.scale());
  canvas.box(kMargin, y + 36, bar, 3, kInk);
  canvas.box(kMargin, y + 30, 2, 9, kInk);
  canvas.box(kMargin + bar - 2, y + 30, 2, 9, kInk);
  canvas.text(kMargin + bar + 10, y + 28, std::to_string(static_cast<int>(length)) + " m", kInk);
}

}  // namespace

RgbImage draw_semantic_map(const SemanticMap& map, std::span<const Vec3f> path) {
  constexpr double kSide = 1400;  // px, of the map's longer side
  if (map.density.values.empty()) return {};
  const double extent = std::max(map.density.columns, map.density.rows) * map.density.cell_m;
  Canvas canvas(map.density, std::clamp(kSide / extent, 0.5, 60.0));
  draw_ground(map, canvas);
  for (const SemanticClass first : {SemanticClass::kRamp, SemanticClass::kWall, SemanticClass::kCar,
                                    SemanticClass::kDoor, SemanticClass::kPillar}) {
    for (const SemanticObject& object : map.objects) {
      if (object.kind == first) draw_object(object, canvas);
    }
  }
  for (std::size_t i = 1; i < path.size(); ++i) {
    canvas.line(path[i - 1].head<2>().cast<double>(), path[i].head<2>().cast<double>(), 2, kPath,
                0.8);
  }
  for (const SemanticObject& object : map.objects) {
    if (object.kind == SemanticClass::kTrunk) draw_object(object, canvas);
  }
  draw_key(map, canvas);
  return std::move(canvas.image);
}

}  // namespace arex
