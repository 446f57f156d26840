#include "physics/physics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "physics/contact_scene.h"
#include "physics/wind.h"

namespace arex::sim {
namespace {

bool is_ground(worlds::SurfaceClass surface) {
  using worlds::SurfaceClass;
  return surface == SurfaceClass::kGround || surface == SurfaceClass::kFloor ||
         surface == SurfaceClass::kRamp;
}

}  // namespace

class Physics::Impl {
 public:
  Impl(const PhysicsConfig& config, const worlds::World& world, const Pose& X_WB_start,
       std::uint64_t seed)
      : config_(config),
        world_(world),
        scene_(world, config.contact, config.body),
        data_(mj_makeData(&scene_.model())),
        powertrain_(config.motor, config.rotor, config.battery),
        wind_(config.wind, seed) {
    if (!data_) throw std::runtime_error("MuJoCo cannot allocate its data");
    if (std::abs(scene_.model().opt.timestep - kSecondsPerTick) > 1e-12) {
      throw std::runtime_error("models/arex/arex.xml: timestep differs from the tick");
    }
    set_state(X_WB_start, Vec3::Zero(), Vec3::Zero(), {});
  }

  void set_state(const Pose& X_WB, const Vec3& v_WB, const Vec3& w_WB_B,
                 const std::array<double, 4>& rotor_radps) {
    const Quat q = X_WB.quaternion();
    const std::array<mjtNum, 7> position{X_WB.p.x(), X_WB.p.y(), X_WB.p.z(), q.w(),
                                         q.x(),      q.y(),      q.z()};
    std::copy(position.begin(), position.end(), data_->qpos);
    std::copy_n(v_WB.data(), 3, data_->qvel);
    std::copy_n(w_WB_B.data(), 3, data_->qvel + 3);
    std::fill_n(data_->qacc_warmstart, 6, 0.0);
    powertrain_.set_rotor_radps(rotor_radps);
    truth_.X_WB = X_WB;
    truth_.v_WB = v_WB;
    truth_.w_WB_B = w_WB_B;
    truth_.a_WB = truth_.alpha_WB_B = Vec3::Zero();
    truth_.rotor_radps = rotor_radps;
    scene_.put_vehicle(X_WB.p);
    contacts_.clear();
  }

  void step(const MotorCommand& command, const CarriedMotion* carry) {
    powertrain_.step(command);
    wind_.step();
    if (carry) {
      apply_wrench(*carry);
    } else {
      apply_forces();
    }
    scene_.update(truth_.X_WB.p);
    scene_.step(*data_, truth_.X_WB);
    check_health();
    read_contacts();  // MuJoCo finds contacts before it moves: truth_ still holds that moment
    read_truth();
  }

  // Thrust, drag and reaction of the rotors, and the airframe's drag, as one wrench about B.
  void apply_forces() {
    const Airframe& airframe = scene_.airframe();
    const RotorConfig& rotor = config_.rotor;
    const Mat3 R_BW = truth_.X_WB.R.transpose();
    const Vec3 w = truth_.w_WB_B;
    const Vec3 air_B = R_BW * (truth_.v_WB - wind_.velocity());  // of B through the air
    Vec3 force = Vec3::Zero(), torque = Vec3::Zero();
    double spin_momentum = 0;  // along B's z

    for (std::size_t i = 0; i < 4; ++i) {
      const double speed = powertrain_.rotor_radps()[i];
      const Vec3 air = air_B + w.cross(airframe.p_BR[i]);
      const double static_thrust = rotor.thrust_coefficient * speed * speed;
      // Thrust falls linearly with the advance ratio J = v / (n D); T = T0 - T0/w * w J / J0.
      const double axial =
          air.z() * (2 * std::numbers::pi) / (rotor.diameter_m * rotor.zero_thrust_advance_ratio);
      const double thrust = std::max(0.0, rotor.thrust_coefficient * speed * (speed - axial));
      const Vec3 rotor_force(-rotor.drag_s_per_m * thrust * air.x(),
                             -rotor.drag_s_per_m * thrust * air.y(), thrust);
      force += rotor_force;
      torque += airframe.p_BR[i].cross(rotor_force);
      torque.z() -= kRotorSpin[i] * (rotor.torque_ratio_m * static_thrust +
                                     rotor.inertia_kgm2 * powertrain_.rotor_acceleration()[i]);
      spin_momentum += kRotorSpin[i] * rotor.inertia_kgm2 * speed;
    }
    torque -= w.cross(Vec3(0, 0, spin_momentum));  // gyroscopic

    const Vec3 air = air_B + w.cross(airframe.p_BBcm);
    const Vec3 drag = -0.5 * config_.drag.air_density_kgpm3 * air.norm() *
                      config_.drag.drag_area_m2.cwiseProduct(air);
    force += drag;
    torque += airframe.p_BBcm.cross(drag);

    apply(truth_.X_WB.R * force, torque);
  }

  // Newton and Euler about the centre of mass, moved to B's origin.
  void apply_wrench(const CarriedMotion& carry) {
    const Airframe& airframe = scene_.airframe();
    const Vec3& w = truth_.w_WB_B;
    const Vec3& p_BBcm = airframe.p_BBcm;
    const Vec3 a_cm_B = truth_.X_WB.R.transpose() * (carry.a_WB + Vec3(0, 0, kGravity)) +
                        carry.alpha_WB_B.cross(p_BBcm) + w.cross(w.cross(p_BBcm));
    const Vec3 force = airframe.mass_kg * a_cm_B;
    const Vec3 spin = airframe.inertia_kgm2 * w;
    const Vec3 torque =
        airframe.inertia_kgm2 * carry.alpha_WB_B + w.cross(spin) + p_BBcm.cross(force);
    apply(truth_.X_WB.R * force, torque);
  }

  // The free joint's generalised force: in W at B's origin, and about B's origin in B.
  void apply(const Vec3& force_W, const Vec3& torque_B) {
    std::copy_n(force_W.data(), 3, data_->qfrc_applied);
    std::copy_n(torque_B.data(), 3, data_->qfrc_applied + 3);
  }

  void check_health() const {
    for (int warning :
         {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL, mjWARN_BADQPOS, mjWARN_BADQVEL, mjWARN_BADQACC}) {
      if (data_->warning[warning].number != 0) {
        throw std::runtime_error(
            "physics failed at " + std::to_string(to_seconds(truth_.stamp)) +
            " s: " + mju_warningText(warning, data_->warning[warning].lastinfo));
      }
    }
  }

  void read_contacts() {
    contacts_.clear();
    const mjModel& model = scene_.model();
    for (int i = 0; i < data_->ncon; ++i) {
      const mjContact& touch = data_->contact[i];
      const bool vehicle_second = model.geom_bodyid[touch.geom2] != 0;
      const int vehicle_geom = vehicle_second ? touch.geom2 : touch.geom1;
      const int world_geom = vehicle_second ? touch.geom1 : touch.geom2;
      Contact contact;
      contact.part = part_of_geom(model, vehicle_geom);
      contact.object = scene_.object_of_contact(i, world_geom);
      contact.surface_class = world_.objects.at(contact.object).surface_class;
      contact.p_W = Vec3(touch.pos[0], touch.pos[1], touch.pos[2]);
      // MuJoCo's normal points from geom1 to geom2.
      contact.normal_W =
          (vehicle_second ? 1 : -1) * Vec3(touch.frame[0], touch.frame[1], touch.frame[2]);
      const Vec3 arm_B = truth_.X_WB.R.transpose() * (contact.p_W - truth_.X_WB.p);
      const Vec3 v_W = truth_.v_WB + truth_.X_WB.R * truth_.w_WB_B.cross(arm_B);
      contact.impact_speed_mps = std::max(0.0, -contact.normal_W.dot(v_W));
      std::array<mjtNum, 6> wrench{};
      mj_contactForce(&model, data_.get(), i, wrench.data());
      contact.normal_force_n = wrench[0];
      const double limit = is_ground(contact.surface_class) ? config_.contact.hard_landing_limit_mps
                                                            : config_.contact.leg_bump_limit_mps;
      contact.collision = contact.part != AirframePart::kLeg || contact.impact_speed_mps > limit;
      contacts_.push_back(contact);
    }
  }

  void read_truth() {
    const Vec3 v = Eigen::Map<const Vec3>(data_->qvel);
    const Vec3 w = Eigen::Map<const Vec3>(data_->qvel + 3);
    truth_.stamp += kNanosecondsPerTick;
    truth_.a_WB = (v - truth_.v_WB) / kSecondsPerTick;
    truth_.alpha_WB_B = (w - truth_.w_WB_B) / kSecondsPerTick;
    truth_.v_WB = v;
    truth_.w_WB_B = w;
    const mjtNum* q = data_->qpos;
    truth_.X_WB = {Quat(q[3], q[4], q[5], q[6]).toRotationMatrix(), Vec3(q[0], q[1], q[2])};
    truth_.rotor_radps = powertrain_.rotor_radps();
  }

  PhysicsConfig config_;
  const worlds::World& world_;
  ContactScene scene_;
  MujocoData data_;
  Powertrain powertrain_;
  DrydenWind wind_;
  Truth truth_;
  std::vector<Contact> contacts_;
};

Physics::Physics(const PhysicsConfig& config, const worlds::World& world, const Pose& X_WB_start,
                 std::uint64_t seed)
    : impl_(std::make_unique<Impl>(config, world, X_WB_start, seed)) {}
Physics::~Physics() = default;
Physics::Physics(Physics&&) noexcept = default;
Physics& Physics::operator=(Physics&&) noexcept = default;

void Physics::set_faults(const DriveFaults& faults) { impl_->powertrain_.set_faults(faults); }
void Physics::step(const MotorCommand& command) { impl_->step(command, nullptr); }
void Physics::step(const MotorCommand& command, const CarriedMotion& carry) {
  impl_->step(command, &carry);
}
const Truth& Physics::truth() const { return impl_->truth_; }
const BatteryState& Physics::battery() const { return impl_->powertrain_.battery(); }
const Powertrain& Physics::powertrain() const { return impl_->powertrain_; }
const Airframe& Physics::airframe() const { return impl_->scene_.airframe(); }
const Vec3& Physics::wind_W() const { return impl_->wind_.velocity(); }
std::span<const Contact> Physics::contacts() const { return impl_->contacts_; }

bool Physics::landed() const {
  bool on_ground = false;
  for (const Contact& contact : impl_->contacts_) {
    if (contact.part != AirframePart::kLeg) return false;
    on_ground = on_ground || is_ground(contact.surface_class);
  }
  return on_ground;
}

const Contact* Physics::collision() const {
  const Contact* worst = nullptr;
  for (const Contact& contact : impl_->contacts_) {
    if (contact.collision && (!worst || contact.impact_speed_mps > worst->impact_speed_mps)) {
      worst = &contact;
    }
  }
  return worst;
}

void Physics::set_state(const Pose& X_WB, const Vec3& v_WB, const Vec3& w_WB_B,
                        const std::array<double, 4>& rotor_radps) {
  impl_->set_state(X_WB, v_WB, w_WB_B, rotor_radps);
}

}  // namespace arex::sim
