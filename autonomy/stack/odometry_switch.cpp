#include "stack/odometry_switch.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {

OdometrySwitch::OdometrySwitch(const FailoverConfig& config, std::size_t sources)
    : config_(config), frames_(sources), sound_since_(sources, -1), said_(sources) {}

Odometry OdometrySwitch::moved(const Odometry& odometry, const Offset& offset) {
  if (offset.is_none()) return odometry;
  Odometry out = odometry;
  const Mat3 turn = so3::from_yaw(offset.yaw_rad);
  out.X_OB = offset.pose() * odometry.X_OB;
  out.v_OB = turn * odometry.v_OB;
  Eigen::Matrix<double, 6, 6> T = Eigen::Matrix<double, 6, 6>::Identity();
  T.bottomRightCorner<3, 3>() = turn;
  out.covariance = T * odometry.covariance * T.transpose();
  return out;
}

OdometrySwitch::Offset OdometrySwitch::between(std::size_t flying, std::size_t other) const {
  const Stamp both = std::min(said_[flying].end(), said_[other].end());
  const Pose common = frames_[flying].pose() * said_[flying].at(both);
  const Pose X_OB = said_[other].at(both);
  Offset offset;
  offset.yaw_rad = so3::wrap(so3::yaw(common.R) - so3::yaw(X_OB.R));
  offset.shift_m = common.p - so3::from_yaw(offset.yaw_rad) * X_OB.p;
  return offset;
}

bool OdometrySwitch::has_failed(const Odometry& odometry) const {
  if (odometry.status == OdometryStatus::kLost) return true;
  if (odometry.status == OdometryStatus::kInitialising) return false;  // it has not begun
  return to_seconds(odometry.stamp - odometry.correction_stamp) > config_.silent_after_s;
}

std::optional<std::size_t> OdometrySwitch::successor(
    const std::vector<const Odometry*>& sources) const {
  const Stamp now = sources[flying_]->stamp;
  for (std::size_t i = 0; i < flying_; ++i) {
    if (sound_since_[i] >= 0 && now - sound_since_[i] >= from_seconds(config_.back_after_s)) {
      return i;
    }
  }
  if (!has_failed(*sources[flying_])) return std::nullopt;
  for (std::size_t i = 0; i < sources.size(); ++i) {
    if (i != flying_ && sound_since_[i] >= 0) return i;
  }
  return std::nullopt;
}

void OdometrySwitch::align_later() {
  if (sound_since_[flying_] < 0) return;
  for (std::size_t i = flying_ + 1; i < said_.size(); ++i) {
    if (sound_since_[i] >= 0) frames_[i] = between(flying_, i);
  }
}

std::optional<std::size_t> OdometrySwitch::update(const std::vector<const Odometry*>& sources) {
  for (std::size_t i = 0; i < sources.size(); ++i) {
    said_[i].add(*sources[i]);
    const bool sound = sources[i]->status == OdometryStatus::kOk && !has_failed(*sources[i]);
    if (!sound) {
      sound_since_[i] = -1;
    } else if (sound_since_[i] < 0) {
      sound_since_[i] = sources[flying_]->stamp;
    }
  }
  align_later();
  const auto next = successor(sources);
  if (!next) return std::nullopt;
  flying_ = *next;
  if (given_out_.empty()) return next;
  // The estimates need not be of the same moment: 25 ms of a turn are 10 mrad.
  const Stamp both = std::min(given_out_.end(), said_[flying_].end());
  const Pose laid = frames_[flying_].pose() * said_[flying_].at(both);
  const Pose given = given_out_.at(both);
  rest_turn_rad_ = so3::Log(given.R * laid.R.transpose());
  rest_shift_m_ = given.p - laid.p;
  return next;
}

Odometry OdometrySwitch::with_rest(const Odometry& odometry) const {
  if (rest_turn_rad_.isZero(0) && rest_shift_m_.isZero(0)) return odometry;
  Odometry out = odometry;
  out.X_OB.R = so3::Exp(rest_turn_rad_) * odometry.X_OB.R;
  out.X_OB.p = odometry.X_OB.p + rest_shift_m_;
  return out;
}

Odometry OdometrySwitch::in_common_frame(const Odometry& odometry) {
  const double dt = std::max(0.0, to_seconds(odometry.stamp - common_.stamp));
  const auto take_back = [](Vec3& rest, double step) {
    const double left = rest.norm();
    rest *= left > step ? 1 - step / left : 0.0;
  };
  take_back(rest_shift_m_, dt * config_.slew_mps);
  take_back(rest_turn_rad_, dt * config_.slew_radps);
  common_ = with_rest(moved(odometry, frames_[flying_]));
  given_out_.add(common_);
  return common_;
}

Odometry OdometrySwitch::in_frame_of(std::size_t source) const {
  const Offset& frame = frames_[source];
  Offset back;
  back.yaw_rad = -frame.yaw_rad;
  back.shift_m = -(so3::from_yaw(back.yaw_rad) * frame.shift_m);
  return moved(common_, back);
}

}  // namespace arex
