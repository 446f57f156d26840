#include "autopilot/health_monitor.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <utility>

namespace arex {
namespace {

// An IMU at 1 kHz flies the vehicle: it is missed at once. The others correct slowly.
constexpr StreamWatchConfig kImuStream{.silent_s = 0.02, .stuck_readings = 50, .late_s = 0.004};
constexpr StreamWatchConfig kFieldStream{.silent_s = 0.2, .stuck_readings = 60};
constexpr StreamWatchConfig kPressureStream{
    .silent_s = 0.3, .stuck_readings = 20, .learnt_readings = 50};
constexpr StreamWatchConfig kPowerStream{.silent_s = 0.2, .stuck_readings = 100};

}  // namespace

HealthMonitor::HealthMonitor(const HealthConfig& config, const Eigen::Matrix4d& mix,
                             double weight_n)
    : config_(config),
      imu_("autopilot's imu", kImuStream),
      magnetometer_("magnetometer", kFieldStream),
      barometer_("barometer", kPressureStream),
      power_("power", kPowerStream),
      vibration_(config.vibration, kFlightImuHz),
      motors_(config.motor, mix, weight_n),
      pack_(config.pack_resistance_ohm),
      field_("magnetometer", config.field_step_gauss),
      pressure_("barometer", config.pressure_step_pa),
      voltage_("power", config.voltage_step_v) {}

void HealthMonitor::add_imu(Stamp now, const ImuSample& imu) {
  const Vec3 &w = imu.gyro_radps, &a = imu.accel_mps2;
  imu_.add(now, imu.stamp, std::array{w.x(), w.y(), w.z(), a.x(), a.y(), a.z()});
  vibration_.add(w, a);
}

void HealthMonitor::add_magnetometer(Stamp now, const MagnetometerSample& sample) {
  magnetometer_.add(now, sample.stamp, {sample.field_gauss.data(), 3});
  field_.add(sample.field_gauss);
}

void HealthMonitor::add_barometer(Stamp now, const BarometerSample& sample) {
  barometer_.add(now, sample.stamp, {&sample.pressure_pa, 1});
  pressure_.add(Vec3(sample.pressure_pa, 0, 0));
}

void HealthMonitor::add_battery(Stamp now, const BatterySample& sample) {
  power_.add(now, sample.stamp, std::array{sample.voltage_v, sample.current_a});
  voltage_.add(Vec3(sample.voltage_v, 0, 0));
  pack_.add(sample, voltage_.step_rms() > config_.voltage_step_v);
}

void HealthMonitor::update(Stamp now, const Flight& flight, double dt_s) {
  watch_streams(now, flight.in_air);
  watch_noise(now, field_);
  watch_noise(now, pressure_);
  watch_noise(now, voltage_);
  // On the ground the motors idle, and hands may shake it.
  const auto shaken = vibration_.update();
  if (shaken && flight.armed) report(now, EventKind::kVibration, "autopilot: " + *shaken);
  watch_tilt(now, flight, dt_s);
  watch_battery(now);
  if (!flight.in_air) {
    motors_.reset();
    return;
  }
  motors_.update(flight.missing, dt_s);
  while (const auto found = motors_.take()) {
    report(now, EventKind::kVehicleFault,
           fmt::format("motor {} {}: {:.0f} % of its hover thrust is missing", found->motor + 1,
                       found->stopped ? "stopped" : "weak", 100 * found->fraction));
  }
}

void HealthMonitor::watch_streams(Stamp now, bool in_air) {
  for (StreamWatch* stream : {&imu_, &magnetometer_, &barometer_, &power_}) {
    stream->expect(now);
    if (auto change = stream->update(now, in_air)) {
      report(now, EventKind::kSensorFault, *std::move(change));
    }
  }
}

void HealthMonitor::watch_noise(Stamp now, NoiseWatch& watch) {
  if (auto change = watch.update()) report(now, EventKind::kSensorFault, *std::move(change));
}

double HealthMonitor::pressure_noise_pa() const {
  // A step is the difference of two readings.
  return pressure_.noisy() ? pressure_.step_rms() / std::numbers::sqrt2 : 0;
}

void HealthMonitor::watch_tilt(Stamp now, const Flight& flight, double dt_s) {
  tilted_s_ = flight.armed && flight.tilt_rad > config_.tilt_limit_rad ? tilted_s_ + dt_s : 0;
  if (tilted_s_ == 0) tilt_told_ = false;
  if (tilted_s_ <= config_.tilt_s || std::exchange(tilt_told_, true)) return;
  report(now, EventKind::kVehicleFault,
         fmt::format("out of control: leans by {:.0f} degrees",
                     flight.tilt_rad * 180 / std::numbers::pi));
}

void HealthMonitor::watch_battery(Stamp now) {
  const auto resistance = pack_.resistance_ohm();
  const auto fall_v = pack_.fall_v();
  const bool resists =
      resistance && *resistance >= config_.weak_pack_factor * config_.pack_resistance_ohm;
  if ((!resists && !fall_v) || std::exchange(pack_told_, true)) return;
  const std::string how =
      fall_v ? fmt::format("its voltage fell by {:.1f} V at once", *fall_v)
             : fmt::format("the pack's inner resistance is {:.0f} mohm", 1e3 * *resistance);
  report(now, EventKind::kVehicleFault, "battery cell weak: " + how);
}

void HealthMonitor::report(Stamp now, EventKind kind, std::string detail) {
  notices_.push_back({now, kind, std::move(detail)});
}

std::vector<Event> HealthMonitor::take_notices() { return std::exchange(notices_, {}); }

}  // namespace arex
