#include "autopilot/motor_watch.h"

#include <algorithm>
#include <utility>

namespace arex {

MotorWatch::Lowest MotorWatch::lowest(const Vec4& thrust_n) const {
  int motor = 0;
  const double least = thrust_n.minCoeff(&motor);
  Vec4 others = thrust_n;
  others[motor] = others.maxCoeff();
  return {motor, (others.minCoeff() - least) / hover_n_};
}

bool MotorWatch::grows(Suspicion& suspicion, const Lowest& lowest, double limit, double dt_s,
                       double needed_s) {
  if (lowest.fraction < limit || lowest.motor != suspicion.motor) {
    suspicion.motor = lowest.motor;
    suspicion.since_s = 0;
    return false;
  }
  suspicion.since_s += dt_s;
  bool& told = suspicion.told[static_cast<std::size_t>(lowest.motor)];
  return suspicion.since_s >= needed_s && !std::exchange(told, true);
}

void MotorWatch::update(const Missing& missing, double dt_s) {
  constexpr double kCarried = 0.05;  // of the weight: by the ground, not by the rotors
  if (missing.steady[0] > kCarried * 4 * hover_n_) {
    reset();
    return;
  }
  steady_n_ += dt_s / (dt_s + kSteady_s) * (mix_ * missing.steady - steady_n_);
  at_once_n_ += dt_s / (dt_s + kAtOnce_s) * (mix_ * missing.at_once - at_once_n_);
  const Lowest steady = lowest(steady_n_), at_once = lowest(at_once_n_);
  if (grows(weak_, steady, config_.weak_fraction, dt_s, config_.weak_s)) {
    findings_.push_back({steady.motor, steady.fraction, false});
  }
  if (grows(stopped_, at_once, config_.stopped_fraction, dt_s, config_.stopped_s)) {
    findings_.push_back({at_once.motor, at_once.fraction, true});
  }
  compare_with_usual(dt_s);
}

void MotorWatch::compare_with_usual(double dt_s) {
  constexpr double kLearnt_s = 3, kMemory_s = 20;
  constexpr double kBesideOthers = 0.5;  // of the worst: a share of what it lacks is put on others
  const Vec4 fallen = (usual_.beyond_n - steady_n_) / hover_n_;
  const bool learns = usual_.learnt_s < kLearnt_s;
  if (learns) usual_.learnt_s += dt_s;
  usual_.beyond_n -= dt_s / (learns ? usual_.learnt_s : kMemory_s) * hover_n_ * fallen;
  const double limit = std::max(config_.fallen_fraction, kBesideOthers * fallen.maxCoeff());
  for (int motor = 0; motor < 4; ++motor) {
    const auto i = static_cast<std::size_t>(motor);
    double& since_s = usual_.fallen_s[i];
    since_s = !learns && fallen[motor] >= limit ? since_s + dt_s : 0;
    if (since_s < config_.fallen_s || std::exchange(weak_.told[i], true)) continue;
    findings_.push_back({motor, fallen[motor], false});
  }
}

void MotorWatch::reset() {
  steady_n_.setZero();
  at_once_n_.setZero();
  weak_.since_s = stopped_.since_s = 0;
  usual_ = {};
}

std::optional<MotorWatch::Finding> MotorWatch::take() {
  if (findings_.empty()) return std::nullopt;
  const Finding finding = findings_.front();
  findings_.pop_front();
  return finding;
}

double MotorWatch::weakness() const { return lowest(steady_n_).fraction; }

}  // namespace arex
