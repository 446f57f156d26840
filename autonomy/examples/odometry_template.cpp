// A plug-in with an odometry of one's own: the IMU alone, from a standing start. It drifts within
// seconds: fly on something else and let it run beside. Copy it, rename it, and change it. In a
// scenario:
//
//     plugins: [build/autonomy/examples/libodometry_template.so]
//     odometries: {dead_reckoning: {type: imu_only, standstill_s: 1.0}}
//
// Its track is dead_reckoning.tum, its errors stand in summary.json under
// odometries.dead_reckoning.

#include <memory>

#include "math/so3.h"
#include "odometry/odometry_source.h"
#include "stack/modules.h"

namespace {

using namespace arex;

struct ImuOnlyConfig {
  double standstill_s = 1.0;

  void fields(auto& f) {
    f("standstill_s", standstill_s, "averaged at the start: biases and the vertical");
    f.check(standstill_s > 0 && standstill_s <= 60, "0 < standstill_s <= 60");
  }
};

class ImuOnlyOdometry : public OdometrySource {
 public:
  explicit ImuOnlyOdometry(const ImuOnlyConfig& config)
      : standstill_(from_seconds(config.standstill_s)) {}

  void add_imu(const ImuSample& imu) override {
    if (count_ == 0) first_ = imu.stamp;
    if (odometry_.status == OdometryStatus::kInitialising) {
      average(imu);
    } else {
      integrate(imu);
    }
    last_ = imu.stamp;
    odometry_.stamp = imu.stamp;
    odometry_.w_OB_B = imu.gyro_radps - gyro_mean_;
  }

  // A source that corrects itself by scans returns a job here, and placed scans from take_scans():
  // odometry/lidar_inertial_source.cpp is one. Images and motion capture are taken likewise.

  [[nodiscard]] const Odometry& odometry() const override { return odometry_; }
  [[nodiscard]] OdometryNeed need() const override {
    return odometry_.status == OdometryStatus::kOk ? OdometryNeed::kNothing : OdometryNeed::kImu;
  }

 private:
  void average(const ImuSample& imu) {
    ++count_;
    gyro_mean_ += (imu.gyro_radps - gyro_mean_) / count_;
    accel_mean_ += (imu.accel_mps2 - accel_mean_) / count_;
    if (imu.stamp - first_ < standstill_) return;
    const Vec3 up_B = accel_mean_.normalized();
    odometry_.X_OB.R = Quat::FromTwoVectors(up_B, Vec3::UnitZ()).toRotationMatrix();
    accel_scale_ = kGravity / accel_mean_.norm();
    odometry_.status = OdometryStatus::kOk;
  }

  void integrate(const ImuSample& imu) {
    const double dt = to_seconds(imu.stamp - last_);
    const Vec3 a_OB = odometry_.X_OB.R * (accel_scale_ * imu.accel_mps2) - Vec3(0, 0, kGravity);
    odometry_.X_OB.p += dt * odometry_.v_OB + 0.5 * dt * dt * a_OB;
    odometry_.v_OB += dt * a_OB;
    odometry_.X_OB.R = odometry_.X_OB.R * so3::Exp(dt * (imu.gyro_radps - gyro_mean_));
  }

  Stamp standstill_;
  Odometry odometry_;
  int count_ = 0;
  Stamp first_ = 0;
  Stamp last_ = 0;
  Vec3 gyro_mean_ = Vec3::Zero();
  Vec3 accel_mean_ = Vec3::Zero();
  double accel_scale_ = 1;
};

}  // namespace

AREX_PLUGIN(modules) {
  modules.odometry.add<ImuOnlyConfig>("imu_only", "dead reckoning from a standing start",
                                      [](const ImuOnlyConfig& config, const ModuleContext&) {
                                        return std::make_unique<ImuOnlyOdometry>(config);
                                      });
}
