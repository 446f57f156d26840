#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "mapping/brick.h"

namespace arex {

/// A plane over one tile of 8 x 8 columns; heights in layers of the map above O's origin.
struct TilePlane {
  double height = 0;         ///< at the tile's middle
  Vec2 rise = Vec2::Zero();  ///< layers per column, along x and y

  /// At column (x, y) of the tile, 0 to 7; beyond for its neighbours.
  [[nodiscard]] double at(double x, double y) const {
    return height + rise.x() * (x - kMiddle) + rise.y() * (y - kMiddle);
  }
  static constexpr double kMiddle = 0.5 * (kBrickCells - 1);
};

/// The columns of a tile by the layer in which a plane meets them: what asks 64 columns at once
/// whether they are so many layers above the floor. Bit i is the column of 2D Morton index i.
class ColumnLayers {
 public:
  /// All columns in one layer.
  explicit ColumnLayers(int layer) : low_(layer), count_(1) { columns_[0] = ~std::uint64_t{0}; }
  /// @pre |plane.rise| <= kSteepest along either axis
  explicit ColumnLayers(const TilePlane& plane);

  static constexpr double kSteepest = 1.0;  ///< layers per column

  [[nodiscard]] int lowest() const { return low_; }
  [[nodiscard]] int highest() const { return low_ + count_ - 1; }
  /// The columns whose layer is `low` or higher and lower than `high`.
  [[nodiscard]] std::uint64_t between(int low, int high) const {
    std::uint64_t out = 0;
    for (int k = std::max(low - low_, 0); k < std::min(high - low_, count_); ++k) {
      out |= columns_[static_cast<std::size_t>(k)];
    }
    return out;
  }
  bool operator==(const ColumnLayers&) const = default;

 private:
  int low_;
  int count_;
  std::array<std::uint64_t, 2 * kBrickCells> columns_{};
};

/// The floor that the vehicle's way lies over, tile by tile: which of the surfaces that lie above
/// each other in a map of several storeys the height band stands on.
///
/// It is one sheet. It begins under the vehicle's start and is followed along its way, and from
/// there from tile to tile: where the voxels of the next tile go on with the floor of the last one,
/// column by column and by one layer at most, they are floor, and a plane through them is that
/// tile's. So it follows ramps, and does not climb a car, whose foot nobody sees. Where nothing was
/// seen the plane goes on and levels out, and takes up what it meets at its height.
///
/// Where storeys lie above each other a tile has the lowest floor that is joined to the vehicle's,
/// and nothing is followed that lies more than 2 m above the vehicle's floor. Within `kCorridor_m`
/// of the way home a tile keeps the floor that was flown over, whatever other storey comes near:
/// the way home stays known. Where neighbours' floors do not meet the higher one ends: its last
/// columns are brinks. A floor that leads under one that is kept for the way home, and over which
/// the vehicle never flew, ends in a mouth: what lies behind it cannot be shown while the vehicle
/// is above, and is still to be explored.
class FloorSheet {
 public:
  /// Voxels of one layer that are occupied over one that is not: where a surface or an object
  /// begins, seen from below. Bit i is the column of 2D Morton index i.
  struct Feet {
    int layer = 0;
    std::uint64_t columns = 0;
  };

  /// @param tile_m edge of a tile, m
  /// @param max_slope steeper surfaces are no floor
  /// @param support columns that make a floor
  FloorSheet(int width, int height, double tile_m, double max_slope, int support);

  /// What was seen in a tile, layers ascending.
  void set_feet(std::size_t tile, std::vector<Feet> feet);
  /// Where the vehicle is: its way goes on to this tile, at this height in layers. Outside the map:
  /// nothing.
  void note_place(const Eigen::Vector2i& tile, int layer);
  /// Works the sheet out anew, if anything was said since it last did.
  /// @return tiles whose plane, brinks or mouth have changed
  std::vector<std::size_t> spread();

  /// None: nothing is known of the floor there, nor of any that leads there.
  [[nodiscard]] std::optional<TilePlane> plane(std::size_t tile) const;
  /// Whether the floor of a tile was seen; otherwise it is its neighbours', gone on.
  [[nodiscard]] bool is_seen(std::size_t tile) const { return tiles_[tile].shown.seen; }
  /// Whether the floor of a tile is a ramp's, gone on unseen: how high it is, nobody knows.
  [[nodiscard]] bool is_unseen_ramp(std::size_t tile) const {
    return !tiles_[tile].shown.seen && tiles_[tile].shown.ramp;
  }
  /// Columns at which the floor of a tile ends above that of its neighbour.
  [[nodiscard]] std::uint64_t brinks(std::size_t tile) const { return tiles_[tile].brinks; }
  /// Whether the floor of a tile leads on to where the map can't show it yet.
  [[nodiscard]] bool is_mouth(std::size_t tile) const { return tiles_[tile].mouth; }

  static constexpr double kCorridor_m = 2.0;
  static constexpr int kMostTolerance = 3;  ///< layers between a floor and where it is expected
  static constexpr double kLevel = 0.2;     ///< layers per column: floors of less slope are level

 private:
  struct Label {
    TilePlane plane;
    bool known = false;
    bool seen = false;
    int guessed = 0;    ///< tiles since the last that was seen
    bool ramp = false;  ///< guessed, and the last that was seen is a ramp
  };
  struct Place {
    Eigen::Vector2i tile = Eigen::Vector2i::Zero();
    int layer = 0;  ///< that the vehicle flew in
  };
  struct Tile {
    std::vector<Feet> feet;
    Label label;  ///< as of this spreading
    Label shown;  ///< as handed out: stays while the label says the same
    std::uint64_t brinks = 0;
    bool mouth = false;
    int flown = kNeverFlown;  ///< the lowest layer that the vehicle was in, here or near
    bool pinned = false;      ///< in the corridor
    bool done = false;        ///< handed on to its neighbours
  };

  static constexpr int kNeverFlown = 1 << 20;

  [[nodiscard]] std::size_t index(const Eigen::Vector2i& tile) const {
    return static_cast<std::size_t>(tile.y() * width_ + tile.x());
  }
  [[nodiscard]] Eigen::Vector2i tile_of(std::size_t index) const {
    return {static_cast<int>(index) % width_, static_cast<int>(index) / width_};
  }
  [[nodiscard]] bool contains(const Eigen::Vector2i& tile) const {
    return tile.minCoeff() >= 0 && tile.x() < width_ && tile.y() < height_;
  }
  void step_to(const Eigen::Vector2i& tile, int layer);
  void note_flown(const Eigen::Vector2i& tile, int layer);
  void cut_short();
  [[nodiscard]] bool meet(std::size_t from, std::size_t to, const Eigen::Vector2i& step) const;
  void follow_way();
  [[nodiscard]] std::optional<TilePlane> floor_beneath(const std::vector<Feet>& feet,
                                                       int layer) const;
  void pin_corridor();
  [[nodiscard]] bool leads_on(std::size_t tile) const;
  [[nodiscard]] bool is_of_ramp(std::size_t tile, const Eigen::Vector2i& step) const;
  void join_seen();
  void go_under();
  void fill_unseen();
  void settle(std::size_t tile);
  void find_brinks(std::vector<std::uint64_t>& brinks) const;
  [[nodiscard]] bool leads_under_the_way(std::size_t tile) const;
  /// The floor of `tile` if that of a neighbour goes on into it.
  [[nodiscard]] Label go_on(const Label& from, const Eigen::Vector2i& step, std::size_t tile) const;
  [[nodiscard]] std::optional<TilePlane> find_floor(const std::vector<Feet>& feet,
                                                    const TilePlane& expected, int tolerance) const;

  int width_, height_;
  double max_slope_;
  int support_;
  std::size_t corridor_;  ///< cost
  bool changed_ = true;
  std::vector<Tile> tiles_;
  std::vector<Place> way_;  ///< from the start to the vehicle, straight over floor that was seen
};

}  // namespace arex
