#include "mapping/floor_sheet.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <utility>

#include "mapping/morton_columns.h"

namespace arex {
namespace {

constexpr std::array<int, 8> kDx{1, 0, -1, 0, 1, -1, -1, 1}, kDy{0, 1, 0, -1, 1, 1, -1, -1};
/// Cost of a step between tiles: 7/5 is the square root of 2 to 1 %.
constexpr std::size_t kStraight = 5, kDiagonal = 7;
/// O's origin is the standing vehicle's body, a leg above the ground.
constexpr int kStandLayers = 3;
/// Between the plane that a tile is expected to have and its floor: half a layer of noise, and what
/// a crest or a foot of a ramp bends within a tile.
constexpr int kTolerance = 1;
/// A plane that went on over the unseen may be further off by a layer each so many tiles, up to so
/// many layers: O's tilt, half a degree, is one in ten metres.
constexpr int kGuessedPerLayer = 4;
constexpr int kMostGuessedLayers = FloorSheet::kMostTolerance - kTolerance;
/// Planes that differ by less at a tile's corners say the same: the 2D map is not made anew.
constexpr double kSame = 1.0;
/// What the planes of neighbours err at their common edge, beside the tolerance.
constexpr double kMeet = 1.0;
/// A floor that was seen stays where it comes so near to its neighbour's at their common edge,
/// though rays that graze it wear it off the map: half a metre, for what is left of the neighbour's
/// has a slope of its own, and the next storey is five times as far.
constexpr double kStays = 5.0;
/// Neighbours whose floors are further apart than this do not meet; half a band, that what is free
/// over one is free over the other.
constexpr double kBrink = 10;
/// Along the way the floor of neighbours is the same storey within what the steepest ramp rises.
constexpr double kStorey = 14;
/// Floor that is higher than the vehicle's by more is another storey's, or on the way there: more
/// than what a vehicle passes on a ramp while it looks down, less than a storey.
constexpr double kOwnStorey = 20;
/// A floor that sinks by so much from one tile to the next dives: a ramp of 20 degrees. Of one that
/// goes down the far end is not seen from its top, for rays that graze do not come back: it goes on
/// for so many tiles. What lies so much higher is not its own.
constexpr double kDive = 3;
constexpr int kMostDived = 10;
constexpr double kUnder = 25;
/// Tiles that a floor goes on under another: enough unknown area to be worth a flight.
constexpr int kMostUnder = 3;
/// Layers of the vehicle above the floor that it flies over.
constexpr double kLeastAbove = 3, kMostAbove = 35;
/// Columns of a tile that make a floor where none was expected: half of it, not a wall's top.
constexpr int kLeastBeneath = 32;
/// Tiles about its way of which a vehicle that flies there has seen what there is to see.
constexpr int kFlownBeside = 2;

TilePlane shifted(const TilePlane& plane, const Eigen::Vector2i& step) {
  TilePlane there = plane;
  there.height += kBrickCells * (plane.rise.x() * step.x() + plane.rise.y() * step.y());
  return there;
}

/// Whether a floor goes down steeply that way, and more so than sideways: kerbs and walls along a
/// ramp tilt the planes beside them, across it.
bool dives(const TilePlane& plane, const Eigen::Vector2i& step) {
  const double fall = -plane.rise.dot(step.cast<double>());
  const double across = std::abs(plane.rise.x() * step.y() - plane.rise.y() * step.x());
  return kBrickCells * fall >= kDive && fall >= across;
}

bool say_the_same(const TilePlane& a, const TilePlane& b) {
  constexpr double kEnd = kBrickCells - 1;
  for (const double x : {0.0, kEnd}) {
    for (const double y : {0.0, kEnd}) {
      if (std::abs(a.at(x, y) - b.at(x, y)) >= kSame) return false;
    }
  }
  return true;
}

}  // namespace

FloorSheet::FloorSheet(int width, int height, double tile_m, double max_slope, int support)
    : width_(width),
      height_(height),
      max_slope_(std::min(max_slope, ColumnLayers::kSteepest)),
      support_(support),
      corridor_(static_cast<std::size_t>(std::lround(kStraight * kCorridor_m / tile_m))),
      tiles_(static_cast<std::size_t>(width * height)) {}

void FloorSheet::set_feet(std::size_t tile, std::vector<Feet> feet) {
  tiles_[tile].feet = std::move(feet);
  changed_ = true;
}

void FloorSheet::note_place(const Eigen::Vector2i& tile, int layer) {
  if (!contains(tile)) return;
  if (way_.empty()) {
    way_.push_back({tile, layer});
    changed_ = true;
    return;
  }
  while (way_.back().tile != tile) {
    const Eigen::Vector2i left = tile - way_.back().tile;
    step_to(way_.back().tile + left.cwiseSign(), layer);
    changed_ = true;
  }
  if (changed_) cut_short();
}

/// A loop is cut where the way comes beside itself on the same storey.
void FloorSheet::step_to(const Eigen::Vector2i& tile, int layer) {
  note_flown(tile, layer);
  const double here = tiles_[index(way_.back().tile)].shown.plane.height;
  const auto again = std::find_if(way_.begin(), way_.end() - 1, [&](const Place& p) {
    return (p.tile - tile).cwiseAbs().maxCoeff() <= 1 &&
           std::abs(tiles_[index(p.tile)].shown.plane.height - here) <= kStorey;
  });
  if (again != way_.end() - 1) way_.erase(again + 1, way_.end());
  if (way_.back().tile != tile) way_.push_back({tile, layer});
}

void FloorSheet::note_flown(const Eigen::Vector2i& tile, int layer) {
  for (int y = tile.y() - kFlownBeside; y <= tile.y() + kFlownBeside; ++y) {
    for (int x = tile.x() - kFlownBeside; x <= tile.x() + kFlownBeside; ++x) {
      if (!contains({x, y})) continue;
      int& flown = tiles_[index({x, y})].flown;
      flown = std::min(flown, layer);
    }
  }
}

/// Whether what is shown of two neighbours is one floor.
bool FloorSheet::meet(std::size_t from, std::size_t to, const Eigen::Vector2i& step) const {
  const Label& a = tiles_[from].shown;
  const Label& b = tiles_[to].shown;
  if (!a.known || !a.seen || !b.known || !b.seen) return false;
  const Vec2 edge = 0.5 * kBrickCells * step.cast<double>();
  return std::abs(a.plane.height + a.plane.rise.dot(edge) -
                  (b.plane.height - b.plane.rise.dot(edge))) <= kTolerance + kMeet;
}

/// The way goes straight where the floor does: round a yard and into the ramp at its middle, the
/// way home leads up the ramp, not once more round the yard.
void FloorSheet::cut_short() {
  const Place last = way_.back();
  const double above = last.layer - tiles_[index(last.tile)].shown.plane.height;
  if (above < kLeastAbove || above > kMostAbove) return;  // another storey's floor is shown there
  for (std::size_t k = 0; k + 2 < way_.size(); ++k) {
    std::vector<Place> straight;
    Eigen::Vector2i at = last.tile;
    bool joined = true;
    while (joined && at != way_[k].tile) {
      const Vec2 left = (way_[k].tile - at).cast<double>();
      const Eigen::Vector2i step =
          (left / left.cwiseAbs().maxCoeff()).array().round().cast<int>().matrix();
      joined = meet(index(at), index(at + step), step);
      at += step;
      const double floor = tiles_[index(at)].shown.plane.height;
      straight.push_back({at, static_cast<int>(std::lround(floor + above))});
    }
    if (!joined || straight.size() + k + 1 >= way_.size()) continue;
    way_.resize(k + 1);
    way_.insert(way_.end(), straight.rbegin() + 1, straight.rend());
    way_.push_back(last);
    return;
  }
}

std::optional<TilePlane> FloorSheet::plane(std::size_t tile) const {
  const Label& label = tiles_[tile].shown;
  if (!label.known) return std::nullopt;
  return label.plane;
}

std::vector<std::size_t> FloorSheet::spread() {
  if (!std::exchange(changed_, false) || way_.empty()) return {};
  for (Tile& tile : tiles_) {
    tile.label = {};
    tile.pinned = tile.done = false;
  }
  follow_way();
  pin_corridor();
  join_seen();
  go_under();
  fill_unseen();
  std::vector<std::size_t> changed;
  std::vector<std::uint64_t> brinks(tiles_.size(), 0);
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    Tile& tile = tiles_[t];
    const bool same =
        tile.label.known == tile.shown.known && say_the_same(tile.label.plane, tile.shown.plane);
    const bool was_unseen_ramp = is_unseen_ramp(t);
    tile.shown.seen = tile.label.seen;
    tile.shown.ramp = tile.label.ramp;
    if (!same) tile.shown = tile.label;
    if (!same || is_unseen_ramp(t) != was_unseen_ramp) changed.push_back(t);
  }
  find_brinks(brinks);
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const bool mouth = leads_under_the_way(t);
    if (brinks[t] == tiles_[t].brinks && mouth == tiles_[t].mouth) continue;
    tiles_[t].brinks = brinks[t];
    tiles_[t].mouth = mouth;
    changed.push_back(t);
  }
  return changed;
}

void FloorSheet::follow_way() {
  Label label;
  label.known = true;
  label.plane.height = -0.5 * kStandLayers;
  label.guessed = kMostGuessedLayers * kGuessedPerLayer;  // the leg's length is not known here
  for (std::size_t k = 0; k < way_.size(); ++k) {
    const Place& place = way_[k];
    const std::size_t t = index(place.tile);
    label = go_on(label, place.tile - way_[k == 0 ? 0 : k - 1].tile, t);
    // Over an edge it comes to fly over another floor, which was known before from elsewhere.
    const Label& before = tiles_[t].shown;
    const double above = place.layer - before.plane.height;
    const bool follows = label.seen && label.plane.height <= place.layer - kLeastAbove;
    const bool deep = follows && label.plane.height < place.layer - kMostAbove;
    // From high over a ramp's foot it comes over the yard behind: between it and the hall's floor.
    if (const auto beneath = deep ? floor_beneath(tiles_[t].feet, place.layer) : std::nullopt) {
      label.plane = *beneath;
    } else if (!follows && before.known && before.seen && above >= kLeastAbove &&
               above <= kMostAbove) {
      label = before;
    }
    tiles_[t].label = label;
    tiles_[t].pinned = true;
  }
}

/// The highest floor below a vehicle in this layer, if it flies that low.
std::optional<TilePlane> FloorSheet::floor_beneath(const std::vector<Feet>& feet, int layer) const {
  for (std::size_t k = feet.size(); k-- > 0;) {
    const double above = layer - feet[k].layer;
    if (above < kLeastAbove || above > kMostAbove) continue;
    const bool two = k > 0 && feet[k - 1].layer == feet[k].layer - 1;
    const std::uint64_t columns = feet[k].columns | (two ? feet[k - 1].columns : 0);
    if (std::popcount(columns) < kLeastBeneath) continue;
    TilePlane level;
    level.height = feet[k].layer;
    if (auto floor = find_floor(feet, level, kTolerance)) return floor;
  }
  return std::nullopt;
}

void FloorSheet::pin_corridor() {
  std::vector<std::vector<std::size_t>> open(corridor_ + kDiagonal + 1);
  for (auto place = way_.rbegin(); place != way_.rend(); ++place) {
    open[0].push_back(index(place->tile));
  }
  for (std::size_t cost = 0; cost <= corridor_; ++cost) {
    for (std::size_t k = 0; k < open[cost].size(); ++k) {
      const std::size_t t = open[cost][k];
      if (std::exchange(tiles_[t].done, true)) continue;
      for (std::size_t s = 0; s < kDx.size(); ++s) {
        const Eigen::Vector2i step(kDx[s], kDy[s]);
        if (!contains(tile_of(t) + step)) continue;
        const std::size_t there = index(tile_of(t) + step);
        const std::size_t reached = cost + (s < 4 ? kStraight : kDiagonal);
        if (tiles_[there].pinned || reached > corridor_) continue;
        const Label label = go_on(tiles_[t].label, step, there);
        if (!label.seen) continue;
        tiles_[there].label = label;
        tiles_[there].pinned = true;
        open[reached].push_back(there);
      }
    }
  }
  for (Tile& tile : tiles_) tile.done = false;
}

/// Not from what lies a storey above the vehicle: it was left, or is still to be climbed to, and
/// may lie over what is to be explored down here.
bool FloorSheet::leads_on(std::size_t t) const {
  const double here = tiles_[index(way_.back().tile)].label.plane.height;
  return tiles_[t].label.plane.height <= here + kOwnStorey;
}

/// A ramp is larger than a tile; one tile alone that slopes is the foot of something.
bool FloorSheet::is_of_ramp(std::size_t t, const Eigen::Vector2i& step) const {
  if (contains(tile_of(t) - step)) {
    const Label& above = tiles_[index(tile_of(t) - step)].label;
    if (above.known && dives(above.plane, step)) return true;
  }
  for (const int side : {-1, 1}) {
    const Eigen::Vector2i across(-side * step.y(), side * step.x());
    if (!contains(tile_of(t) + across)) continue;
    const Label beside = go_on(tiles_[t].label, across, index(tile_of(t) + across));
    if (beside.seen && dives(beside.plane, step)) return true;
  }
  return false;
}

/// From the corridor over all that goes on with it. Where floors lie above each other a tile has
/// the lowest that is joined; one that dives under another goes on under it, unseen.
void FloorSheet::join_seen() {
  std::deque<std::size_t> open;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (tiles_[t].pinned) open.push_back(t);
  }
  for (; !open.empty(); open.pop_front()) {
    const std::size_t t = open.front();
    if (!leads_on(t)) continue;
    for (std::size_t s = 0; s < kDx.size(); ++s) {
      const Eigen::Vector2i step(kDx[s], kDy[s]);
      if (!contains(tile_of(t) + step)) continue;
      const std::size_t there = index(tile_of(t) + step);
      const Label& before = tiles_[there].label;
      const TilePlane expected = shifted(tiles_[t].label.plane, step);
      if (tiles_[there].pinned) continue;
      if (before.seen && expected.height > before.plane.height - kBrink) continue;
      Label label = go_on(tiles_[t].label, step, there);
      if (!label.seen) {
        if (s >= 4 || label.guessed > kMostDived || !dives(tiles_[t].label.plane, step)) continue;
        if (tiles_[t].label.seen && !is_of_ramp(t, step)) continue;
        label.plane = expected;
      }
      const double above = label.plane.height - before.plane.height;
      const bool better = label.seen ? above <= (before.seen ? -kBrink : kUnder)
                                     : above <= (before.seen ? -kUnder : -kBrink);
      if (before.known && !better) continue;
      tiles_[there].label = label;
      open.push_back(there);
    }
  }
}

/// A floor that comes to lie under another's goes on under it, unseen, for a few tiles: there is
/// something to explore.
void FloorSheet::go_under() {
  for (int ring = 0; ring < kMostUnder; ++ring) {
    std::vector<std::pair<std::size_t, Label>> under;
    for (std::size_t t = 0; t < tiles_.size(); ++t) {
      if (!tiles_[t].label.known || !leads_on(t)) continue;
      for (std::size_t s = 0; s < 4; ++s) {
        const Eigen::Vector2i step(kDx[s], kDy[s]);
        if (!contains(tile_of(t) + step)) continue;
        const std::size_t there = index(tile_of(t) + step);
        const double expected = shifted(tiles_[t].label.plane, step).height;
        const Tile& over = tiles_[there];
        const bool roof = over.label.seen && over.label.plane.rise.norm() < kLevel;  // no ramp
        if (over.pinned || !roof || over.label.plane.height - expected <= kUnder) continue;
        under.emplace_back(there, go_on(tiles_[t].label, step, there));
      }
    }
    for (const auto& [tile, label] : under) tiles_[tile].label = label;
  }
}

/// The others, from their nearest neighbours on.
void FloorSheet::fill_unseen() {
  std::vector<std::vector<std::size_t>> open(kDiagonal + 1);  // a ring
  std::size_t waiting = 0;
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    if (!tiles_[t].label.known || !leads_on(t)) continue;
    open[0].push_back(t);
    ++waiting;
  }
  for (std::size_t cost = 0; waiting > 0; ++cost) {
    std::vector<std::size_t>& bucket = open[cost % open.size()];
    for (std::size_t k = 0; k < bucket.size(); ++k) {
      const std::size_t t = bucket[k];
      --waiting;
      if (std::exchange(tiles_[t].done, true)) continue;
      if (!tiles_[t].label.known) settle(t);
      for (std::size_t s = 0; s < kDx.size(); ++s) {
        const Eigen::Vector2i there = tile_of(t) + Eigen::Vector2i(kDx[s], kDy[s]);
        if (!contains(there) || tiles_[index(there)].label.known) continue;
        open[(cost + (s < 4 ? kStraight : kDiagonal)) % open.size()].push_back(index(there));
        ++waiting;
      }
    }
    bucket.clear();
  }
}

/// The floor that it has if that of any neighbour goes on into it; otherwise a neighbour's, gone
/// on.
void FloorSheet::settle(std::size_t t) {
  const Eigen::Vector2i here = tile_of(t);
  for (std::size_t s = 0; s < kDx.size() && !tiles_[t].label.seen; ++s) {
    const Eigen::Vector2i step(kDx[s], kDy[s]);
    if (!contains(here - step)) continue;
    const std::size_t from = index(here - step);
    if (!tiles_[from].done) continue;
    const Label label = go_on(tiles_[from].label, step, t);
    if (label.seen || !tiles_[t].label.known) tiles_[t].label = label;
  }
}

/// Down a ramp or over level floor, not sideways out of a ramp, whose walls end it there.
bool FloorSheet::leads_under_the_way(std::size_t t) const {
  const Tile& here = tiles_[t];
  const double below_vehicle =
      tiles_[index(way_.back().tile)].label.plane.height - here.label.plane.height;
  if (!here.label.known || here.pinned || below_vehicle <= kUnder) return false;
  if (here.flown - here.label.plane.height <= kMostAbove) return false;
  for (std::size_t s = 0; s < 4; ++s) {
    const Eigen::Vector2i step(kDx[s], kDy[s]);
    if (!contains(tile_of(t) + step)) continue;
    const Tile& over = tiles_[index(tile_of(t) + step)];
    if (!over.pinned || over.label.plane.rise.norm() >= kLevel) continue;
    const double fall = -here.label.plane.rise.dot(step.cast<double>());
    const double across =
        std::abs(here.label.plane.rise.x() * step.y() - here.label.plane.rise.y() * step.x());
    if (across > std::max(fall, kLevel)) continue;
    if (over.label.plane.height - shifted(here.label.plane, step).height > kUnder) return true;
  }
  return false;
}

FloorSheet::Label FloorSheet::go_on(const Label& from, const Eigen::Vector2i& step,
                                    std::size_t tile) const {
  Label label;
  label.known = true;
  const TilePlane expected = shifted(from.plane, step);
  const int most = kTolerance + std::min(from.guessed / kGuessedPerLayer, kMostGuessedLayers);
  for (int tolerance = kTolerance; tolerance <= most; ++tolerance) {  // the nearest one first
    if (const auto floor = find_floor(tiles_[tile].feet, expected, tolerance)) {
      label.plane = *floor;
      label.seen = true;
      return label;
    }
  }
  if (const Label& before = tiles_[tile].shown; before.known && before.seen) {
    const Vec2 edge = Vec2::Constant(TilePlane::kMiddle) - 0.5 * kBrickCells * step.cast<double>();
    const double apart = before.plane.at(edge.x(), edge.y()) - expected.at(edge.x(), edge.y());
    if (std::abs(apart) <= kStays) {
      label.plane = before.plane;
      label.seen = true;
      return label;
    }
  }
  label.plane = expected;
  label.plane.rise *= 0.5;
  label.guessed = from.guessed + 1;
  label.ramp = from.ramp || (from.seen && from.plane.rise.norm() >= kLevel);
  return label;
}

void FloorSheet::find_brinks(std::vector<std::uint64_t>& brinks) const {
  constexpr double kEnd = kBrickCells - 1;
  constexpr std::array<std::uint64_t, 4> kSide{columns_where(8, 7, 0), columns_where(8, 7, 1),
                                               columns_where(8, 0, 0), columns_where(8, 0, 1)};
  for (std::size_t t = 0; t < tiles_.size(); ++t) {
    const Label& here = tiles_[t].shown;
    if (!here.known || !here.seen) continue;
    for (std::size_t s = 0; s < kSide.size(); ++s) {
      const Eigen::Vector2i step(kDx[s], kDy[s]);
      if (!contains(tile_of(t) + step)) continue;
      const Label& there = tiles_[index(tile_of(t) + step)].shown;
      if (!there.known) {
        // The storey above, followed along the way home alone: what is beside it was left.
        if (tiles_[t].pinned && !leads_on(t)) brinks[t] |= kSide[s];
        continue;
      }
      const auto edge = [&](const TilePlane& plane, int side) {
        const double half = 0.5 * kEnd * side;
        return plane.height + half * (plane.rise.x() * step.x() + plane.rise.y() * step.y());
      };
      if (edge(here.plane, 1) - edge(there.plane, -1) > kBrink) brinks[t] |= kSide[s];
    }
  }
}

}  // namespace arex
