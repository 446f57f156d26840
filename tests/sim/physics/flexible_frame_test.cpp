#include "physics/flexible_frame.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "math/so3.h"

namespace arex::sim {
namespace {

constexpr double kTwoPi = 2 * std::numbers::pi;
constexpr double kTick_s = kSecondsPerTick;

FrameConfig soft(double mode_hz, double damping, double ratio = 1.5) {
  FrameConfig config;
  config.load_ratio = ratio;
  config.mode_hz = mode_hz;
  config.mode_damping = damping;
  config.unbalance_n = 0;
  return config;
}

/// Amplitude of a series' line by projection, over whole periods.
double amplitude(const std::vector<double>& series, double frequency_hz) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    sum += series[i] * std::polar(1.0, -kTwoPi * frequency_hz * kTick_s * static_cast<double>(i));
  }
  return 2 * std::abs(sum) / static_cast<double>(series.size());
}

/// Amplitudes of q and q' of q'' + 2 z w0 q' + w0^2 q = a at the ticks, for a sine of amplitude 1
/// that is held over each: x <- F x + G a, so (z I - F)^-1 G at z = exp(i w T).
Eigen::Vector2d response(double mode_hz, double damping, double frequency_hz) {
  const double w0 = kTwoPi * mode_hz;
  Eigen::Matrix3d A;  // of [q, q', a]
  A << 0, 1, 0, -w0 * w0, -2 * damping * w0, 1, 0, 0, 0;
  Eigen::Matrix3d exponential = Eigen::Matrix3d::Identity(), term = exponential;
  for (int i = 1; i < 25; ++i) {
    term = (kTick_s / i * term * A).eval();
    exponential += term;
  }
  const std::complex<double> z = std::polar(1.0, kTwoPi * frequency_hz * kTick_s);
  const Eigen::Matrix2cd zI_F = z * Eigen::Matrix2cd::Identity() -
                                exponential.topLeftCorner<2, 2>().cast<std::complex<double>>();
  const Eigen::Vector2cd G = exponential.topRightCorner<2, 1>().cast<std::complex<double>>();
  return (zI_F.inverse() * G).cwiseAbs();
}

TEST(FlexibleFrame, TurnsAndShiftsAsTwoBodiesOnASpring) {
  for (const double frequency : {10.0, 40.0, 50.0, 100.0}) {
    FlexibleFrame frame(soft(50, 0.05), load_airframe(), 1);
    std::vector<double> rate, turn, shift;
    for (int i = 0; i < 3000; ++i) {
      Truth rigid;
      rigid.stamp = i * kNanosecondsPerTick;
      const double drive = std::cos(kTwoPi * frequency * kTick_s * i);
      rigid.alpha_WB_B = Vec3(0, 10 * drive, 0);
      rigid.a_WB = Vec3(2 * drive, 0, 0);
      frame.step(rigid);
      if (i < 2000) continue;
      rate.push_back(frame.plate().w_WB_B.y());
      turn.push_back(so3::Log(frame.plate().X_WB.R).y());
      shift.push_back(frame.plate().X_WB.p.x());
    }
    const Eigen::Vector2d gain = 1.5 * response(50, 0.05, frequency);
    EXPECT_NEAR(amplitude(turn, frequency), 10 * gain[0], 0.02 * 10 * gain[0]) << frequency;
    EXPECT_NEAR(amplitude(rate, frequency), 10 * gain[1], 0.02 * 10 * gain[1]) << frequency;
    EXPECT_NEAR(amplitude(shift, frequency), 2 * gain[0], 0.02 * 2 * gain[0]) << frequency;
  }
}

TEST(FlexibleFrame, HangsInItsSpringFromTheBegin) {
  FlexibleFrame frame(soft(20, 0.01), load_airframe(), 1);
  for (int i = 0; i < 1000; ++i) {
    Truth rigid;
    rigid.stamp = i * kNanosecondsPerTick;
    frame.step(rigid);
    const double sag = 1.5 * kGravity / std::pow(kTwoPi * 20, 2);
    ASSERT_NEAR(frame.plate().X_WB.p.z(), sag, 1e-9);
    ASSERT_LT(frame.plate().v_WB.norm() + frame.plate().w_WB_B.norm(), 1e-9);
  }
}

// Whoever integrates what an IMU on the plate reads finds its pose: rates and pose are of one
// motion.
TEST(FlexibleFrame, ItsRatesAreThoseOfItsPose) {
  FrameConfig config = soft(30, 0.02, 3);
  config.unbalance_n = 2;
  FlexibleFrame frame(config, load_airframe(), 4);
  Truth rigid;
  Pose before;
  Vec3 v_before = Vec3::Zero();
  for (int i = 0; i < 2000; ++i) {
    const double t = kTick_s * i;
    rigid.stamp = i * kNanosecondsPerTick;
    rigid.alpha_WB_B = Vec3(3 * std::sin(9 * t), 4 * std::cos(31 * t), std::sin(77 * t));
    rigid.w_WB_B += kTick_s * rigid.alpha_WB_B;
    rigid.X_WB.R = rigid.X_WB.R * so3::Exp(kTick_s * rigid.w_WB_B);
    rigid.a_WB = Vec3(std::sin(40 * t), 0, std::cos(3 * t));
    rigid.v_WB += kTick_s * rigid.a_WB;
    rigid.X_WB.p += kTick_s * rigid.v_WB;
    rigid.rotor_radps.fill(700);
    frame.step(rigid);
    const Truth& plate = frame.plate();
    if (i > 10) {
      const Vec3 w = so3::Log(before.R.transpose() * plate.X_WB.R) / kTick_s;
      const Vec3 v = (plate.X_WB.p - before.p) / kTick_s;
      // The rate of a difference is that of its middle: half a tick of acceleration.
      EXPECT_LT((w - plate.w_WB_B).norm(), 0.6 * kTick_s * plate.alpha_WB_B.norm() + 0.03) << i;
      EXPECT_LT((v - plate.v_WB).norm(), 0.6 * kTick_s * plate.a_WB.norm() + 0.01) << i;
      EXPECT_LT((plate.v_WB - v_before - kTick_s * plate.a_WB).norm(), 1e-9);
    }
    before = plate.X_WB;
    v_before = plate.v_WB;
  }
}

TEST(FlexibleFrame, RotorsShakeItMostWhereTheirSpeedMeetsItsMode) {
  const auto shaken = [](double rotor_hz) {
    FrameConfig config = soft(80, 0.03);
    config.unbalance_n = 1;
    config.reference_speed_radps = kTwoPi * rotor_hz;  // the same force at every speed
    FlexibleFrame frame(config, load_airframe(), 2);
    double squares = 0;
    for (int i = 0; i < 4000; ++i) {
      Truth rigid;
      rigid.stamp = i * kNanosecondsPerTick;
      rigid.rotor_radps.fill(kTwoPi * rotor_hz);
      frame.step(rigid);
      if (i >= 2000) squares += frame.plate().w_WB_B.squaredNorm() / 2000;
    }
    return std::sqrt(squares);
  };
  const double below = shaken(40), at = shaken(80), beyond = shaken(160);
  EXPECT_GT(at, 8 * below);
  EXPECT_GT(at, 8 * beyond);
}

}  // namespace
}  // namespace arex::sim
