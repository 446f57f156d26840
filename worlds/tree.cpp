#include "worlds/tree.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "worlds/reflectivity.h"
#include "worlds/sampling.h"

namespace arex::worlds {
namespace {

constexpr double kBreastHeight = 1.3;      // forestry's convention, m
constexpr double kTrunkRootDepth = 0.4;    // below the ground, so that no slope bares the end, m
constexpr double kFlareHeight = 0.18;      // over which the root flare fades by 1/e, m
constexpr double kDetailedHeight = 4.0;    // no flight is planned above; full collision detail, m
constexpr double kSolidRadius = 0.008;     // wood at least this thick is solid everywhere, m
constexpr double kGoldenAngle = 2.399963;  // rad; successive branches spread evenly around the stem

/// A piece of wood: a polyline with a radius at each point.
struct Limb {
  std::vector<Vec3> points;
  std::vector<double> radii;

  /// Point at fraction t of the (nearly equal) segments, with the direction there.
  [[nodiscard]] Vec3 at(double t) const {
    const double s = t * static_cast<double>(points.size() - 1);
    const auto i = std::min(static_cast<std::size_t>(s), points.size() - 2);
    return points[i] + (s - static_cast<double>(i)) * (points[i + 1] - points[i]);
  }
  [[nodiscard]] Vec3 direction_at(double t) const {
    const auto i = std::min(static_cast<std::size_t>(t * static_cast<double>(points.size() - 1)),
                            points.size() - 2);
    return (points[i + 1] - points[i]).normalized();
  }
};

struct LimbShape {
  double length, radius, tip_radius;
  int segments;
  double wander;  ///< sideways change of direction per segment, rad
  double rise;    ///< upward change of direction per segment, rad
};

Limb make_limb(RandomStream& random, const Vec3& base, Vec3 heading, const LimbShape& shape) {
  Limb limb{{base}, {shape.radius}};
  for (int i = 1; i <= shape.segments; ++i) {
    const double t = static_cast<double>(i) / shape.segments;
    heading += shape.wander * random.normal3() + shape.rise * Vec3::UnitZ();
    heading.normalize();
    limb.points.push_back(limb.points.back() + shape.length / shape.segments * heading);
    limb.radii.push_back(shape.tip_radius + (shape.radius - shape.tip_radius) * (1 - t));
  }
  return limb;
}

/// Growing one tree: holds what every step needs.
class Tree {
 public:
  Tree(MeshBuilder& builder, const TreeRecipe& recipe, const Vec3& root, const Allowed& allowed,
       RandomStream random, Detail detail)
      : builder_(builder),
        recipe_(recipe),
        root_(root),
        allowed_(allowed),
        random_(random),
        coarse_(detail == Detail::kCoarse) {
    const double bark = kBarkReflectivity.draw(random_);
    trunk_object_ = builder_.add_object(SurfaceClass::kTrunk, bark);
    branch_object_ = builder_.add_object(SurfaceClass::kBranch, bark);
    leaf_object_ = builder_.add_object(SurfaceClass::kLeaf, kLeafReflectivity.draw(random_));

    breast_radius_ = truncated_normal(random_, recipe.trunk_radius_m, recipe.trunk_radius_spread_m,
                                      recipe.trunk_radius_min_m, recipe.trunk_radius_max_m);
    // Height follows the cube root of the radius ratio: slender trees are lower, but less than in
    // proportion. Estimate.
    const double mean = recipe.height_m * std::cbrt(breast_radius_ / recipe.trunk_radius_m);
    height_ = truncated_normal(random_, mean, recipe.height_spread_m, 0.6 * mean, 1.4 * mean);
  }

  void grow() {
    grow_trunk();
    grow_crown();
    grow_low_branches();
    grow_leaves();
  }

 private:
  /// Radius of the trunk at a height above the ground.
  [[nodiscard]] double trunk_radius(double z) const {
    const double top = recipe_.twig_diameter_m / 2;
    const double share = std::max(0.0, (height_ - z) / (height_ - kBreastHeight));
    const double flare = 1 + recipe_.root_flare * std::exp(-std::max(z, 0.0) / kFlareHeight);
    return std::max(top, breast_radius_ * std::pow(share, recipe_.taper_exponent) * flare);
  }

  [[nodiscard]] Vec3 trunk_axis(double z) const {
    const double t = std::clamp(z / height_, 0.0, 1.0);
    // Two half-waves: a bow and an S; both vanish at the root.
    const Vec2 side = z * lean_ + std::sin(std::numbers::pi * t) * bow_ +
                      std::sin(2 * std::numbers::pi * t) * sway_;
    return root_ + Vec3(side.x(), side.y(), z);
  }

  void grow_trunk() {
    lean_ = recipe_.lean_rad * Vec2(random_.normal(), random_.normal());
    bow_ = recipe_.bend_m * Vec2(random_.normal(), random_.normal());
    sway_ = 0.5 * recipe_.bend_m * Vec2(random_.normal(), random_.normal());
    std::vector<double> heights{-kTrunkRootDepth, 0, 0.5 * kFlareHeight, 1.5 * kFlareHeight,
                                3.5 * kFlareHeight};
    const double above = height_ - heights.back();
    constexpr double kSegment = 0.9;
    const int segments = std::max(3, static_cast<int>(std::lround(above / kSegment)));
    for (int i = 1; i <= segments; ++i) heights.push_back(height_ - above + above * i / segments);
    Limb trunk;
    for (const double z : heights) {
      trunk.points.push_back(trunk_axis(z));
      trunk.radii.push_back(trunk_radius(z));
    }
    builder_.add_tube(trunk_object_, trunk.points, trunk.radii, coarse_ ? 5 : 10);
    add_capsules(trunk_object_, trunk);
  }

  void grow_crown() {
    const double base = recipe_.crown_base_fraction * height_;
    const double reach = recipe_.crown_radius_m * height_ / recipe_.height_m;
    const double first_azimuth = random_.uniform(0, 2 * std::numbers::pi);
    for (int i = 0; i < recipe_.branches; ++i) {
      const double t = (i + random_.uniform(0.1, 0.9)) / recipe_.branches;
      const double z = base + 0.95 * t * (height_ - base);
      // The crown's outline: widest at 40 % of its depth, a rounded top.
      const double outline = std::sin(std::numbers::pi * (0.22 + 0.68 * t));
      const double length = reach * outline * random_.uniform(0.75, 1.15);
      const double azimuth = first_azimuth + kGoldenAngle * i + 0.4 * random_.normal();
      const double elevation = 0.25 + 0.75 * t + 0.15 * random_.normal();
      const Limb branch =
          make_limb(random_, trunk_axis(z), direction(azimuth, elevation),
                    {length, branch_radius(length, z), twig_radius(), 4, 0.13, 0.06});
      if (!add_branch(branch, 4)) continue;
      leafy_.push_back(branch);
      add_twigs(branch, recipe_.twigs_per_branch, 0.45 * length, true);
    }
  }

  /// Bare branches under the crown, where the vehicle flies.
  void grow_low_branches() {
    const int count = poisson(random_, recipe_.low_branches);
    for (int i = 0; i < count; ++i) {
      const double z = random_.uniform(recipe_.low_branch_low_m, recipe_.low_branch_high_m);
      const double length = recipe_.low_branch_length_m * random_.uniform(0.5, 1.5);
      const Vec3 heading =
          direction(random_.uniform(0, 2 * std::numbers::pi), random_.uniform(-0.15, 0.55));
      const Limb branch =
          make_limb(random_, trunk_axis(z), heading,
                    {length, 0.7 * branch_radius(length, z), twig_radius(), 4, 0.15, -0.02});
      if (add_branch(branch, 5)) add_twigs(branch, 2, 0.35 * length, false);
    }
  }

  void add_twigs(const Limb& parent, int count, double length, bool leafy) {
    const double start_roll = random_.uniform(0, 2 * std::numbers::pi);
    for (int i = 0; i < count; ++i) {
      const double t = 0.3 + 0.65 * (i + random_.uniform()) / count;
      const Vec3 along = parent.direction_at(t);
      // Sideways out of the parent, around it by the golden angle, flattened to the horizontal.
      Vec3 side = Eigen::AngleAxisd(start_roll + kGoldenAngle * i, along) *
                  along.cross(Vec3(0, 0, 1)).normalized();
      side.z() *= 0.6;
      const double twig_length = length * (1.15 - 0.6 * t) * random_.uniform(0.8, 1.2);
      const double radius = std::max(twig_radius(), 0.6 * (twig_radius() + 0.005 * twig_length));
      const Limb twig = make_limb(random_, parent.at(t), (along + 0.9 * side).normalized(),
                                  {twig_length, radius, twig_radius(), 2, 0.12, 0.05});
      // In the air beside a coarse tree's straight branch, and thinner than is seen from afar.
      const bool grown = coarse_ ? stands_free(twig) : add_branch(twig, 3);
      if (grown && leafy) leafy_.push_back(twig);
    }
  }

  [[nodiscard]] bool stands_free(const Limb& limb) const {
    return std::all_of(limb.points.begin(), limb.points.end(), allowed_);
  }

  /// Draws a limb and makes it solid, unless it enters a forbidden place.
  bool add_branch(const Limb& limb, int sides) {
    if (!stands_free(limb)) return false;
    const Limb straight{{limb.points.front(), limb.points.back()},
                        {limb.radii.front(), limb.radii.back()}};
    const Limb& drawn = coarse_ ? straight : limb;
    builder_.add_tube(branch_object_, drawn.points, drawn.radii, coarse_ ? 3 : sides);
    add_capsules(branch_object_, drawn);
    return true;
  }

  void add_capsules(std::uint32_t object, const Limb& limb) {
    for (std::size_t i = 0; i + 1 < limb.points.size(); ++i) {
      const double radius = std::max(limb.radii[i], limb.radii[i + 1]);
      const double low = std::min(limb.points[i].z(), limb.points[i + 1].z()) - root_.z();
      if (radius >= kSolidRadius || low < kDetailedHeight) {
        builder_.add_collision_capsule(object, limb.points[i], limb.points[i + 1], radius);
      }
    }
  }

  /// Sprays of leaves, one diamond each, around the outer parts of branches and twigs.
  void grow_leaves() {
    if (leafy_.empty()) return;
    // A crown's leaves grow with its surface, hence with the height squared.
    const double size = height_ / recipe_.height_m;
    const double merged = coarse_ ? kLeavesMerged : 1;
    const double scale = std::sqrt(merged);
    const int count = static_cast<int>(std::lround(recipe_.leaves * size * size / merged));
    constexpr double kSpread = 0.17;  // of a spray around its twig, standard deviation, m
    for (int i = 0; i < count; ++i) {
      const Limb& limb = leafy_[static_cast<std::size_t>(i) % leafy_.size()];
      const double t = 1 - 0.75 * random_.uniform() * random_.uniform();
      const Vec3 base = limb.at(t) + kSpread * random_.normal3();
      const Vec3 normal = (0.75 * random_.normal3() + Vec3::UnitZ()).normalized();
      Vec3 along = limb.direction_at(t) + random_.normal3();
      along = (along - along.dot(normal) * normal).normalized();
      const double length = scale * recipe_.leaf_length_m * random_.uniform(0.7, 1.3);
      const Vec3 across = 0.28 * length * normal.cross(along);
      const Vec3 middle = base + 0.45 * length * along;
      const Vec3 tip = base + length * along;
      if (!allowed_(base) || !allowed_(tip)) continue;
      builder_.add_quad(leaf_object_, base, middle + across, tip, middle - across);
    }
  }

  [[nodiscard]] double twig_radius() const { return recipe_.twig_diameter_m / 2; }
  /// Of a branch of this length that leaves the trunk at height z: about 1 % of the length
  /// (estimate), and thinner than its trunk.
  [[nodiscard]] double branch_radius(double length, double z) const {
    return std::clamp(twig_radius() + 0.009 * length, twig_radius(),
                      std::max(twig_radius(), 0.65 * trunk_radius(z)));
  }

  MeshBuilder& builder_;
  const TreeRecipe& recipe_;
  Vec3 root_;
  const Allowed& allowed_;
  RandomStream random_;
  bool coarse_;
  std::uint32_t trunk_object_ = 0, branch_object_ = 0, leaf_object_ = 0;
  double breast_radius_ = 0, height_ = 0;
  Vec2 lean_ = Vec2::Zero(), bow_ = Vec2::Zero(), sway_ = Vec2::Zero();
  std::vector<Limb> leafy_;
};

}  // namespace

void add_tree(MeshBuilder& builder, const TreeRecipe& recipe, const Vec3& root,
              const Allowed& allowed, RandomStream random, Detail detail) {
  Tree(builder, recipe, root, allowed, random, detail).grow();
}

}  // namespace arex::worlds
