#pragma once

#include <mujoco/mujoco.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "physics/airframe.h"
#include "physics/mesh_contact.h"
#include "physics/physics_config.h"
#include "physics/shape_index.h"
#include "worlds/world.h"

namespace arex::sim {

struct MujocoDeleter {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using MujocoModel = std::unique_ptr<mjModel, MujocoDeleter>;
using MujocoData = std::unique_ptr<mjData, MujocoDeleter>;

/// Compiles models/arex/arex.xml, built into the binary, with `scene_xml` around it. The scene
/// names it `<include file="arex.xml"/>`. @throws std::runtime_error with MuJoCo's message.
MujocoModel compile_model(const std::string& scene_xml);

/// Gives the compiled model its true mass and inertia.
[[nodiscard]] MujocoModel with_body(MujocoModel model, const BodyConfig& body);

/// Reads the airframe out of a compiled model.
Airframe read_airframe(const mjModel& model, const BodyConfig& body = {});

/// The part that a geom of the vehicle belongs to.
AirframePart part_of_geom(const mjModel& model, int geom);

/// MuJoCo's model of the vehicle and the part of the world within its reach.
///
/// MuJoCo's broad phase grows with the number of geoms, and a forest has thousands. So the model
/// holds one height field and a fixed number of slots; the slots take the shapes nearest to the
/// vehicle and are filled again before anything left out could be touched. Forces are the same as
/// with all shapes loaded (up to `slots` shapes within the vehicle's own sphere): shapes stand in
/// the slots in the order of their index, so contacts come in the same order too. While nothing at
/// all is within the vehicle's sphere, MuJoCo's collision stage is switched off.
///
/// Triangles that can be felt are no geoms: MuJoCo knows convex solids only. Their contacts are
/// worked out here and handed to its solver.
class ContactScene {
 public:
  ContactScene(const worlds::World& world, const ContactConfig& config,
               const BodyConfig& body = {});

  /// To be called before each step with the vehicle's position.
  void update(const Vec3& p_WB);
  /// One step of MuJoCo. @pre update() was called for the pose in `data`, X_WB
  void step(mjData& data, const Pose& X_WB);
  /// The vehicle is put somewhere instead of flying there.
  void put_vehicle(const Vec3& p_WB);

  [[nodiscard]] mjModel& model() { return *model_; }
  [[nodiscard]] const Airframe& airframe() const { return airframe_; }
  /// The object that a contact of the last step was with; `geom` is that of the world in it.
  [[nodiscard]] std::uint32_t object_of_contact(int contact, int geom) const;

 private:
  bool is_near_mesh(const Vec3& p_WB, double reach_m);
  void add_mesh_contacts(mjData& data, const Pose& X_WB);
  void load_terrain();
  void refill(const Vec3& p_WB);
  void put(int slot, const worlds::CollisionShape& shape);
  void park(int slot);
  [[nodiscard]] double highest_terrain(const Vec2& centre, double radius_m) const;

  const worlds::World& world_;
  ContactConfig config_;
  ShapeIndex index_;
  MujocoModel model_;
  Airframe airframe_;
  int terrain_geom_ = -1;
  int first_slot_geom_ = -1;
  std::uint32_t terrain_object_ = 0;
  MeshContacts mesh_;
  int mesh_geom_ = -1;  ///< stands for all triangles
  int first_vehicle_geom_ = -1;
  int first_mesh_contact_ = 0;               ///< of the last step
  std::vector<std::uint32_t> mesh_objects_;  ///< of its contacts from there on
  Vec3 mesh_centre_ = Vec3::Zero();          ///< where mesh_distance_m_ was measured
  double mesh_distance_m_ = -1;              ///< to the nearest triangle; negative: not yet
  bool near_mesh_ = false;

  // What the slots were filled for.
  bool filled_ = false;
  Vec3 centre_ = Vec3::Zero();
  double valid_radius_m_ = 0;     ///< everything within this of the centre stands in a slot
  double nearest_shape_m_ = 0;    ///< distance of the nearest from the centre
  double highest_terrain_m_ = 0;  ///< around the centre
  int used_slots_ = 0;
  std::vector<std::uint32_t> shape_of_slot_;
  std::vector<ShapeIndex::Neighbour> neighbours_;  ///< scratch
};

}  // namespace arex::sim
