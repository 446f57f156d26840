#include "physics/contact_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "physics/arex_model.h"

namespace arex::sim {
namespace {

using worlds::CollisionShape;

/// Added to the vehicle's sphere wherever it decides what may be left out.
constexpr double kGuard_m = 0.01;
/// MuJoCo's solid under a height field's lowest point: thicker than any tick's travel.
constexpr double kTerrainBase_m = 2.0;

void ignore_warning(const char*) {}  // counted in mjData::warning, which Physics checks

void add_file(mjVFS& files, const char* name, std::string_view text) {
  if (mj_makeEmptyFileVFS(&files, name, static_cast<int>(text.size())) != 0) {
    throw std::runtime_error(std::string("MuJoCo's file system refuses ") + name);
  }
  std::memcpy(files.filedata[mj_findFileVFS(&files, name)], text.data(), text.size());
}

/// The scene with room for terrain and slots; their contents follow at run time.
std::string scene_xml(const worlds::HeightField& terrain, double relief_m, int slots,
                      bool has_mesh) {
  std::ostringstream xml;
  xml.precision(17);
  xml << "<mujoco model='scene'><include file='arex.xml'/>";
  if (terrain.columns > 0) {
    const double half_x = 0.5 * (terrain.columns - 1) * terrain.spacing_m;
    const double half_y = 0.5 * (terrain.rows - 1) * terrain.spacing_m;
    xml << "<asset><hfield name='terrain' nrow='" << terrain.rows << "' ncol='" << terrain.columns
        << "' size='" << half_x << ' ' << half_y << ' ' << relief_m << ' ' << kTerrainBase_m
        << "'/></asset>";
  }
  xml << "<worldbody>";
  if (terrain.columns > 0) xml << "<geom name='terrain' type='hfield' hfield='terrain'/>";
  for (int i = 0; i < slots; ++i) {
    xml << "<geom name='slot_" << i << "' type='box' size='1 1 1' contype='0' conaffinity='0'/>";
  }
  if (has_mesh) {
    xml << "<geom name='mesh' type='sphere' size='1' contype='0' conaffinity='0'/>";
  }
  xml << "</worldbody></mujoco>";
  return xml.str();
}

bool has_contact_mesh(const worlds::World& world) {
  return std::any_of(world.objects.begin(), world.objects.end(),
                     [](const worlds::Object& object) { return object.felt; });
}

double relief(const worlds::HeightField& terrain) {
  if (terrain.columns == 0) return 0;
  const auto [low, high] = std::minmax_element(terrain.height_m.begin(), terrain.height_m.end());
  return std::max(static_cast<double>(*high) - static_cast<double>(*low), 1e-3);
}

Pose pose_of(const mjtNum* position, const mjtNum* quaternion) {
  return {Quat(quaternion[0], quaternion[1], quaternion[2], quaternion[3]).toRotationMatrix(),
          Vec3(position[0], position[1], position[2])};
}

/// Height in B of a solid's lowest point.
double lowest_of(const CollisionShape& shape) {
  const Vec3 down = shape.X_WS.R.row(2).cwiseAbs().transpose();  // |z| of each of its axes
  const Vec3& size = shape.size;
  double reach = 0;
  switch (shape.kind) {
    case CollisionShape::Kind::kBox:
      reach = down.dot(size);
      break;
    case CollisionShape::Kind::kCapsule:
      reach = size.x() + size.y() * down.z();
      break;
    case CollisionShape::Kind::kCylinder:
      reach = size.x() * std::hypot(down.x(), down.y()) + size.y() * down.z();
      break;
  }
  return shape.X_WS.p.z() - reach;
}

/// The normal and two tangents, row by row, as MuJoCo chooses them.
void put_frame(const Vec3& normal, mjtNum* frame) {
  const Vec3 seed = std::abs(normal.y()) < 0.5 ? Vec3::UnitY() : Vec3::UnitZ();
  const Vec3 first = (seed - seed.dot(normal) * normal).normalized();
  const Vec3 second = normal.cross(first);
  std::copy_n(normal.data(), 3, frame);
  std::copy_n(first.data(), 3, frame + 3);
  std::copy_n(second.data(), 3, frame + 6);
}

int require_name(const mjModel& model, mjtObj kind, const std::string& name) {
  const int id = mj_name2id(&model, kind, name.c_str());
  if (id < 0) throw std::runtime_error("arex.xml has no " + name);
  return id;
}

}  // namespace

MujocoModel compile_model(const std::string& scene_xml) {
  // MuJoCo would print, and write a log file. Once: its hook is a global.
  static const bool quiet = (mju_user_warning = ignore_warning, true);
  static_cast<void>(quiet);
  // The struct holds 2 MB of file names: not for the stack.
  const auto free_files = [](mjVFS* files) {
    mj_deleteVFS(files);
    delete files;
  };
  std::unique_ptr<mjVFS, decltype(free_files)> files(new mjVFS, free_files);
  mj_defaultVFS(files.get());
  add_file(*files, "arex.xml", kArexModelXml);
  add_file(*files, "scene.xml", scene_xml);
  std::array<char, 1024> error{};
  MujocoModel model(
      mj_loadXML("scene.xml", files.get(), error.data(), static_cast<int>(error.size())));
  if (!model) throw std::runtime_error(std::string("models/arex/arex.xml: ") + error.data());
  model->opt.gravity[0] = model->opt.gravity[1] = 0;
  model->opt.gravity[2] = -kGravity;
  return model;
}

AirframePart part_of_geom(const mjModel& model, int geom) {
  static constexpr std::array<std::string_view, 6> kPrefixes{"body",  "arm",    "rotor",
                                                             "lidar", "camera", "leg"};
  const char* name = mj_id2name(&model, mjOBJ_GEOM, geom);
  for (std::size_t i = 0; i < kPrefixes.size(); ++i) {
    if (name && std::string_view(name).starts_with(kPrefixes[i])) {
      return static_cast<AirframePart>(i);
    }
  }
  throw std::runtime_error(std::string("arex.xml: unknown part ") + (name ? name : "(unnamed)"));
}

MujocoModel with_body(MujocoModel model, const BodyConfig& body) {
  const int id = require_name(*model, mjOBJ_BODY, "arex");
  model->body_mass[id] = body.mass_kg;
  for (int i = 0; i < 3; ++i) model->body_inertia[3 * id + i] *= body.inertia_scale;
  const MujocoData data(mj_makeData(model.get()));
  mj_setConst(model.get(), data.get());  // what the compiler derived of both
  return model;
}

Airframe read_airframe(const mjModel& model, const BodyConfig& body_config) {
  const int body = require_name(model, mjOBJ_BODY, "arex");
  Airframe airframe;
  airframe.mass_kg = model.body_mass[body];
  const Pose X_BI = pose_of(model.body_ipos + 3 * body, model.body_iquat + 4 * body);
  airframe.p_BBcm = X_BI.p;
  const Vec3 principal(model.body_inertia[3 * body], model.body_inertia[3 * body + 1],
                       model.body_inertia[3 * body + 2]);
  airframe.inertia_kgm2 = X_BI.R * principal.asDiagonal() * X_BI.R.transpose();
  for (int i = 0; i < 4; ++i) {
    const int rotor = require_name(model, mjOBJ_GEOM, "rotor_" + std::to_string(i));
    airframe.p_BR[static_cast<std::size_t>(i)] =
        pose_of(model.geom_pos + 3 * rotor, model.geom_quat + 4 * rotor).p;
  }
  const int lidar = require_name(model, mjOBJ_SITE, "lidar");
  const int camera = require_name(model, mjOBJ_SITE, "camera");
  airframe.X_BL = body_config.lidar_mount.applied_to(
      pose_of(model.site_pos + 3 * lidar, model.site_quat + 4 * lidar));
  airframe.X_BC = body_config.camera_mount.applied_to(
      pose_of(model.site_pos + 3 * camera, model.site_quat + 4 * camera));
  for (int i = 0; i < model.body_geomnum[body]; ++i) {
    const int geom = model.body_geomadr[body] + i;
    CollisionShape shape;
    switch (model.geom_type[geom]) {
      case mjGEOM_BOX:
        shape.kind = CollisionShape::Kind::kBox;
        break;
      case mjGEOM_CAPSULE:
        shape.kind = CollisionShape::Kind::kCapsule;
        break;
      case mjGEOM_CYLINDER:
        shape.kind = CollisionShape::Kind::kCylinder;
        break;
      default:
        throw std::runtime_error("arex.xml: only boxes, capsules and cylinders are known");
    }
    const mjtNum* size = model.geom_size + 3 * geom;
    shape.X_WS = pose_of(model.geom_pos + 3 * geom, model.geom_quat + 4 * geom);
    shape.size = {size[0], size[1], size[2]};
    shape.object = static_cast<std::uint32_t>(part_of_geom(model, geom));
    airframe.radius_m = std::max(airframe.radius_m, reach_from(shape, Vec3::Zero()));
    airframe.standing_height_m = std::max(airframe.standing_height_m, -lowest_of(shape));
    airframe.shapes.push_back(shape);
  }
  // The compiler's rounding is no part of the model, whose numbers have millimetres.
  airframe.standing_height_m = std::round(1e6 * airframe.standing_height_m) / 1e6;
  return airframe;
}

Airframe load_airframe() {
  return read_airframe(*compile_model("<mujoco><include file='arex.xml'/></mujoco>"));
}

ContactScene::ContactScene(const worlds::World& world, const ContactConfig& config,
                           const BodyConfig& body)
    : world_(world),
      config_(config),
      index_(world.collision_shapes),
      model_(with_body(compile_model(scene_xml(world.terrain, relief(world.terrain), config.slots,
                                               has_contact_mesh(world))),
                       body)),
      airframe_(read_airframe(*model_, body)),
      mesh_(world, airframe_.shapes),
      shape_of_slot_(static_cast<std::size_t>(config.slots)) {
  if (config.search_radius_m <= airframe_.radius_m + kGuard_m) {
    throw std::invalid_argument("contact.search_radius_m must exceed the vehicle's radius");
  }
  first_slot_geom_ = require_name(*model_, mjOBJ_GEOM, "slot_0");
  for (int slot = 0; slot < config.slots; ++slot) {
    // The compiler found the geom in its body's own frame and would copy that instead of the pose.
    model_->geom_sameframe[first_slot_geom_ + slot] = 0;
  }
  if (!mesh_.empty()) mesh_geom_ = require_name(*model_, mjOBJ_GEOM, "mesh");
  first_vehicle_geom_ = model_->body_geomadr[require_name(*model_, mjOBJ_BODY, "arex")];
  load_terrain();
}

void ContactScene::load_terrain() {
  const worlds::HeightField& terrain = world_.terrain;
  if (terrain.columns == 0) return;
  terrain_geom_ = require_name(*model_, mjOBJ_GEOM, "terrain");
  const auto ground = std::find_if(
      world_.objects.begin(), world_.objects.end(),
      [](const auto& object) { return object.surface_class == worlds::SurfaceClass::kGround; });
  if (ground == world_.objects.end()) {
    throw std::invalid_argument("a world with terrain needs an object of class ground");
  }
  terrain_object_ = static_cast<std::uint32_t>(ground - world_.objects.begin());

  // MuJoCo: height = data * size[2], data in 0..1, rows along y, centred on the geom.
  const double low = *std::min_element(terrain.height_m.begin(), terrain.height_m.end());
  const double scale = relief(terrain);
  for (std::size_t i = 0; i < terrain.height_m.size(); ++i) {
    model_->hfield_data[i] =
        static_cast<float>((static_cast<double>(terrain.height_m[i]) - low) / scale);
  }
  mjtNum* position = model_->geom_pos + 3 * terrain_geom_;
  position[0] = terrain.origin.x() + 0.5 * (terrain.columns - 1) * terrain.spacing_m;
  position[1] = terrain.origin.y() + 0.5 * (terrain.rows - 1) * terrain.spacing_m;
  position[2] = low;
  model_->geom_sameframe[terrain_geom_] = 0;
}

void ContactScene::update(const Vec3& p_WB) {
  const double reach = airframe_.radius_m + kGuard_m;
  double moved = (p_WB - centre_).norm();
  if (!filled_ || moved + reach > valid_radius_m_) {
    refill(p_WB);
    moved = 0;
  }
  near_mesh_ = !mesh_.empty() && is_near_mesh(p_WB, reach);
  const bool may_touch =
      near_mesh_ || moved + reach >= nearest_shape_m_ || p_WB.z() - reach <= highest_terrain_m_;
  if (may_touch) {
    model_->opt.disableflags &= ~mjDSBL_CONTACT;
  } else {
    model_->opt.disableflags |= mjDSBL_CONTACT;
  }
}

// Measured anew only when the vehicle may have come within reach since.
bool ContactScene::is_near_mesh(const Vec3& p_WB, double reach_m) {
  const double moved = (p_WB - mesh_centre_).norm();
  if (mesh_distance_m_ < 0 || mesh_distance_m_ - moved <= reach_m) {
    mesh_centre_ = p_WB;
    mesh_distance_m_ = mesh_.distance(p_WB, config_.search_radius_m + reach_m);
  }
  const bool near = mesh_.held() || mesh_distance_m_ - (p_WB - mesh_centre_).norm() <= reach_m;
  // As long as nothing is in reach, the vehicle's middle has not passed through anything.
  if (!near && !near_mesh_) mesh_.reset(p_WB);
  return near;
}

void ContactScene::put_vehicle(const Vec3& p_WB) {
  mesh_.reset(p_WB);
  mesh_distance_m_ = -1;
}

void ContactScene::step(mjData& data, const Pose& X_WB) {
  if (!near_mesh_) {
    mesh_objects_.clear();
    mj_step(model_.get(), &data);
    return;
  }
  mj_step1(model_.get(), &data);
  add_mesh_contacts(data, X_WB);
  mj_step2(model_.get(), &data);
}

// Between MuJoCo's own collision stage and its solver; what the first half of the step worked out
// of the contacts is worked out again.
void ContactScene::add_mesh_contacts(mjData& data, const Pose& X_WB) {
  first_mesh_contact_ = data.ncon;
  mesh_objects_.clear();
  for (const MeshTouch& touch : mesh_.find(X_WB)) {
    mjContact contact{};
    contact.dist = -touch.depth_m;
    std::copy_n(touch.p_W.data(), 3, contact.pos);
    put_frame(touch.normal_W, contact.frame);
    contact.geom1 = mesh_geom_;
    contact.geom2 = first_vehicle_geom_ + static_cast<int>(touch.shape);
    // All geoms of the model are of one material.
    const mjtNum* friction = model_->geom_friction + 3 * contact.geom2;
    const std::array<mjtNum, 5> per_axis{friction[0], friction[0], friction[1], friction[2],
                                         friction[2]};
    std::copy(per_axis.begin(), per_axis.end(), contact.friction);
    std::copy_n(model_->geom_solref + mjNREF * contact.geom2, mjNREF, contact.solref);
    std::copy_n(model_->geom_solimp + mjNIMP * contact.geom2, mjNIMP, contact.solimp);
    contact.dim = model_->geom_condim[contact.geom2];
    if (mj_addContact(model_.get(), &data, &contact) != 0) break;
    mesh_objects_.push_back(world_.mesh.object_of_triangle[touch.triangle]);
  }
  if (mesh_objects_.empty()) return;
  mj_makeConstraint(model_.get(), &data);
  mj_projectConstraint(model_.get(), &data);
  mj_referenceConstraint(model_.get(), &data);
}

void ContactScene::refill(const Vec3& p_WB) {
  index_.find(p_WB, config_.search_radius_m, neighbours_);
  filled_ = true;
  centre_ = p_WB;
  valid_radius_m_ = config_.search_radius_m;
  highest_terrain_m_ = highest_terrain(p_WB.head<2>(), config_.search_radius_m);
  nearest_shape_m_ = neighbours_.empty() ? std::numeric_limits<double>::infinity()
                                         : neighbours_.front().distance_m;

  const auto slots = static_cast<std::size_t>(config_.slots);
  if (neighbours_.size() > slots) {
    valid_radius_m_ = neighbours_[slots].distance_m;
    neighbours_.resize(slots);
  }
  std::sort(neighbours_.begin(), neighbours_.end(),
            [](const auto& a, const auto& b) { return a.shape < b.shape; });
  int slot = 0;
  for (const ShapeIndex::Neighbour& neighbour : neighbours_) {
    shape_of_slot_[static_cast<std::size_t>(slot)] = neighbour.shape;
    put(slot++, world_.collision_shapes[neighbour.shape]);
  }
  for (int unused = slot; unused < used_slots_; ++unused) park(unused);
  used_slots_ = slot;
}

void ContactScene::put(int slot, const CollisionShape& shape) {
  const int geom = first_slot_geom_ + slot;
  const Quat q = shape.X_WS.quaternion();
  const std::array<mjtNum, 4> quaternion{q.w(), q.x(), q.y(), q.z()};
  std::copy_n(shape.X_WS.p.data(), 3, model_->geom_pos + 3 * geom);
  std::copy_n(quaternion.data(), 4, model_->geom_quat + 4 * geom);
  std::copy_n(shape.size.data(), 3, model_->geom_size + 3 * geom);
  model_->geom_contype[geom] = model_->geom_conaffinity[geom] = 1;
  switch (shape.kind) {
    case CollisionShape::Kind::kBox:
      model_->geom_type[geom] = mjGEOM_BOX;
      break;
    case CollisionShape::Kind::kCapsule:
      model_->geom_type[geom] = mjGEOM_CAPSULE;
      break;
    case CollisionShape::Kind::kCylinder:
      model_->geom_type[geom] = mjGEOM_CYLINDER;
      break;
  }
  model_->geom_rbound[geom] = reach_from(shape, shape.X_WS.p);
}

void ContactScene::park(int slot) {
  const int geom = first_slot_geom_ + slot;
  model_->geom_contype[geom] = model_->geom_conaffinity[geom] = 0;
}

double ContactScene::highest_terrain(const Vec2& centre, double radius_m) const {
  const worlds::HeightField& terrain = world_.terrain;
  double highest = -std::numeric_limits<double>::infinity();
  if (terrain.columns == 0) return highest;
  const auto sample = [&](double offset, int count, bool up) {
    const double index = offset / terrain.spacing_m;
    return static_cast<int>(
        std::clamp(up ? std::ceil(index) : std::floor(index), 0.0, static_cast<double>(count - 1)));
  };
  const Vec2 low = centre - terrain.origin - Vec2::Constant(radius_m);
  const Vec2 high = centre - terrain.origin + Vec2::Constant(radius_m);
  for (int row = sample(low.y(), terrain.rows, false); row <= sample(high.y(), terrain.rows, true);
       ++row) {
    for (int column = sample(low.x(), terrain.columns, false);
         column <= sample(high.x(), terrain.columns, true); ++column) {
      const auto i = static_cast<std::size_t>(row * terrain.columns + column);
      highest = std::max(highest, static_cast<double>(terrain.height_m[i]));
    }
  }
  return highest;
}

std::uint32_t ContactScene::object_of_contact(int contact, int geom) const {
  if (geom == mesh_geom_)
    return mesh_objects_[static_cast<std::size_t>(contact - first_mesh_contact_)];
  if (geom == terrain_geom_) return terrain_object_;
  const std::uint32_t shape = shape_of_slot_[static_cast<std::size_t>(geom - first_slot_geom_)];
  return world_.collision_shapes[shape].object;
}

}  // namespace arex::sim
