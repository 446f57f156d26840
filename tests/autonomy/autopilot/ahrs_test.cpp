#include "autopilot/ahrs.h"

#include <gtest/gtest.h>

#include <numbers>

#include "math/random.h"
#include "math/so3.h"

namespace arex {
namespace {

constexpr double kDt = 1e-3;
constexpr double kDegree = std::numbers::pi / 180;

/// An aggressive flight given in closed form, with the attitude that a multicopter must have to fly
/// it: thrust along body z, rotor drag in the rotor plane, thrust making up the rest.
class AnalyticFlight {
 public:
  AnalyticFlight(std::uint64_t seed, const Vec3& wind, double drag_s_per_m, double body_drag)
      : wind_(wind), drag_(drag_s_per_m), body_drag_(body_drag) {
    RandomStream random(seed, "analytic_flight");
    for (int axis = 0; axis < 3; ++axis) {
      for (int i = 0; i < 3; ++i) {
        const double rate = random.uniform(0.3, 1.6);
        const double peak = axis == 2 ? 0.5 : 1.6;  // m/s^2 of this term
        terms_[axis][i] = {peak / (rate * rate), rate, random.uniform(0, 6.28)};
      }
    }
  }
  [[nodiscard]] Vec3 velocity(double t) const {
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis) {
      v[axis] = 0;
      for (const auto& s : terms_[axis])
        v[axis] += s.size * s.rate * std::cos(s.rate * t + s.phase);
    }
    return v * ramp(t);
  }
  [[nodiscard]] Vec3 acceleration(double t) const {
    constexpr double kStep = 1e-4;
    return (velocity(t + kStep) - velocity(t - kStep)) / (2 * kStep);
  }
  /// Attitude and specific force in B.
  void sample(double t, Mat3& R, Vec3& f_B) const {
    // The wind is there from the first moment in the air; a fifth of a second to lean into it.
    const Vec3 air = velocity(t) - wind_ * std::clamp((t - 4) / 0.2, 0.0, 1.0);
    const Vec3 f = acceleration(t) + Vec3(0, 0, kGravity);
    const Vec3 rotors = f + body_drag_ * air.norm() * air;  // what the rotors must deliver
    Vec3 z = rotors.normalized();
    for (int i = 0; i < 20; ++i) {
      z = (rotors / rotors.dot(z) + drag_ * air).normalized();
    }
    const double yaw = ramp(t) * (0.6 * std::sin(0.4 * t) + 0.1 * (t - 4));
    const Vec3 y = z.cross(Vec3(std::cos(yaw), std::sin(yaw), 0)).normalized();
    R << y.cross(z), y, z;
    f_B = R.transpose() * f;
  }

 private:
  static double ramp(double t) { return t < 4 ? 0 : std::min((t - 4) / 3, 1.0); }
  struct Term {
    double size, rate, phase;
  };
  std::array<std::array<Term, 3>, 3> terms_;
  Vec3 wind_;
  double drag_;
  double body_drag_;
};

struct Errors {
  double tilt_rms = 0, tilt_max = 0, yaw_max = 0, climb_rms = 0, peak_acceleration = 0,
         peak_speed = 0;
  double tilt_calibration = 0;  ///< mean squared tilt error over the variance the filter claims
};

Errors fly(std::uint64_t seed, double seconds, const AnalyticFlight& flight) {
  RandomStream random(seed, "imu");
  Ahrs ahrs{AhrsConfig{}};
  Errors e;
  Mat3 R_before;
  Vec3 f_before;
  flight.sample(0, R_before, f_before);
  Vec3 gyro_bias = 0.005 * random.normal3();
  double height = 0;
  int samples = 0;
  for (int tick = 1; tick <= static_cast<int>(seconds * 1000); ++tick) {
    const double t = tick * kDt;
    Mat3 R;
    Vec3 f;
    flight.sample(t, R, f);
    height += flight.velocity(t - 0.5 * kDt).z() * kDt;
    gyro_bias += 2e-5 * std::sqrt(kDt) * random.normal3();
    ImuSample imu{tick * kNanosecondsPerTick, so3::Log(R_before.transpose() * R) / kDt + gyro_bias,
                  0.5 * (f + f_before)};
    imu.gyro_radps += 1e-4 * 22.36 * random.normal3();
    imu.accel_mps2 += 1.4e-3 * 22.36 * random.normal3();
    if (t > 4) {  // vibration of turning rotors
      const double phase = 2 * std::numbers::pi * 114 * t;
      imu.accel_mps2 += Vec3(2 * std::sin(phase), 2 * std::cos(phase), std::sin(2 * phase));
      imu.gyro_radps += 0.03 * Vec3(std::cos(phase), std::sin(phase), std::cos(phase));
    }
    ahrs.set_on_ground(t < 4);
    ahrs.add_imu(imu);
    if (tick % 10 == 0) {
      ahrs.add_magnetometer(
          {imu.stamp, R.transpose() * Vec3(0.2, 0, -0.43) + 0.003 * random.normal3()});
    }
    if (tick % 20 == 0) {
      ahrs.add_barometer({imu.stamp, 101325 * std::exp(-height / 8434.5) + random.normal()});
    }
    R_before = R;
    f_before = f;
    if (t < 10) continue;
    ++samples;
    const Mat3 error = R * ahrs.R_AB().transpose();
    const double tilt = std::acos(std::min(error(2, 2), 1.0));
    e.tilt_rms += tilt * tilt;
    e.tilt_max = std::max(e.tilt_max, tilt);
    e.yaw_max = std::max(e.yaw_max, std::abs(so3::yaw(error)));
    e.climb_rms += std::pow(ahrs.velocity().z() - flight.velocity(t).z(), 2);
    e.peak_acceleration = std::max(e.peak_acceleration, flight.acceleration(t).norm());
    const Mat3 P_A = ahrs.R_AB() * ahrs.covariance().block<3, 3>(0, 0) * ahrs.R_AB().transpose();
    e.tilt_calibration += tilt * tilt / (P_A(0, 0) + P_A(1, 1));
  }
  EXPECT_TRUE(ahrs.initialised());
  e.tilt_rms = std::sqrt(e.tilt_rms / samples);
  e.climb_rms = std::sqrt(e.climb_rms / samples);
  e.tilt_calibration /= samples;
  return e;
}

TEST(Ahrs, HoldsTheHorizonOverThreeAggressiveMinutes) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const Errors e = fly(seed, 180, AnalyticFlight(seed, Vec3(1.5, -1.0, 0), 0.02, 0.008));
    EXPECT_GT(e.peak_acceleration, 4.0);  // levelling by the accelerometer would be 20 degrees off
    EXPECT_LT(e.tilt_rms, 0.4 * kDegree);
    EXPECT_LT(e.tilt_max, 1.0 * kDegree);
    EXPECT_LT(e.yaw_max, 1.5 * kDegree);
    EXPECT_LT(e.climb_rms, 0.05);
    EXPECT_LT(e.tilt_calibration, 1.0);  // the filter does not claim more than it knows
  }
}

TEST(Ahrs, ForgivesADragConstantThatIsThirtyPercentOff) {
  for (const double drag : {0.014, 0.026}) {
    const Errors e = fly(11, 120, AnalyticFlight(11, Vec3(-2, 0, 0), drag, 0.008));
    EXPECT_LT(e.tilt_rms, 0.8 * kDegree);
    EXPECT_LT(e.tilt_max, 1.5 * kDegree);
  }
}

/// Ten still samples a magnetometer sample, on the ground, at attitude R.
void stand(Ahrs& ahrs, const Mat3& R, const Vec3& gyro_bias, const Vec3& field_A, Stamp from,
           double seconds) {
  const Stamp end = from + from_seconds(seconds);
  for (Stamp t = from; t < end; t += kNanosecondsPerTick) {
    ahrs.add_imu({t, gyro_bias, R.transpose() * Vec3(0, 0, kGravity)});
    if (t % (10 * kNanosecondsPerTick) == 0) {
      ahrs.add_magnetometer({t, R.transpose() * field_A});
      ahrs.add_barometer({t, 100000});
    }
  }
}

TEST(Ahrs, StaticInitialisationIsExactWithoutNoise) {
  RandomStream random(1, "ahrs");
  for (int i = 0; i < 10; ++i) {
    const Mat3 R = so3::from_yaw(random.uniform(-3, 3)) * so3::Exp(0.2 * random.normal3());
    const Vec3 bias = 0.01 * random.normal3();
    Ahrs ahrs{AhrsConfig{}};
    stand(ahrs, R, bias, {0.3, 0, -0.4}, 0, 2.5);
    ASSERT_TRUE(ahrs.initialised());
    EXPECT_LT(so3::angle(ahrs.R_AB().transpose() * R), 1e-9);
    EXPECT_LT((ahrs.gyro_bias() - bias).norm(), 1e-12);
    EXPECT_LT(ahrs.velocity().norm(), 1e-9);
    EXPECT_NEAR(ahrs.height_m(), 0, 1e-9);
  }
}

TEST(Ahrs, MagneticDisturbanceTurnsTheHeadingButNeverTilts) {
  Ahrs ahrs{AhrsConfig{}};
  stand(ahrs, Mat3::Identity(), Vec3::Zero(), {0.3, 0, -0.4}, 0, 2.5);
  // The field turns by 5 degrees and dips more.
  stand(ahrs, Mat3::Identity(), Vec3::Zero(), so3::from_yaw(-5 * kDegree) * Vec3(0.3, 0, -0.6),
        from_seconds(2.5), 30);
  EXPECT_NEAR(so3::yaw(ahrs.R_AB()), 5 * kDegree, 1 * kDegree);
  EXPECT_GT(ahrs.R_AB()(2, 2), std::cos(0.01 * kDegree));
}

}  // namespace
}  // namespace arex
