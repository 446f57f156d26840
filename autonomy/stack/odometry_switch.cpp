#include "stack/odometry_switch.h"

#include <algorithm>
#include <cmath>

#include "math/so3.h"

namespace arex {

OdometrySwitch::OdometrySwitch(const FailoverConfig& config, std::size_t sources)
    : config_(config), frames_(sources), sound_since_(sources, -1) {}

Odometry OdometrySwitch::moved(const Odometry& odometry, const Offset& offset) {
  if (offset.is_none()) return odometry;
  Odometry out = odometry;
  const Mat3 turn = so3::from_yaw(offset.yaw_rad);
  out.X_OB = Pose{turn, offset.shift_m} * odometry.X_OB;
  out.v_OB = turn * odometry.v_OB;
  Eigen::Matrix<double, 6, 6> T = Eigen::Matrix<double, 6, 6>::Identity();
  T.bottomRightCorner<3, 3>() = turn;
  out.covariance = T * odometry.covariance * T.transpose();
  return out;
}

OdometrySwitch::Offset OdometrySwitch::between(const Odometry& common, const Odometry& odometry) {
  Offset offset;
  offset.yaw_rad = so3::wrap(so3::yaw(common.X_OB.R) - so3::yaw(odometry.X_OB.R));
  // The estimates need not be of the same moment.
  const double late_s = to_seconds(common.stamp - odometry.stamp);
  const Vec3 p = odometry.X_OB.p + late_s * odometry.v_OB;
  offset.shift_m = common.X_OB.p - so3::from_yaw(offset.yaw_rad) * p;
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

void OdometrySwitch::align_later(const std::vector<const Odometry*>& sources) {
  if (sound_since_[flying_] < 0) return;
  for (std::size_t i = flying_ + 1; i < sources.size(); ++i) {
    if (sound_since_[i] >= 0) {
      frames_[i] = between(moved(*sources[flying_], frames_[flying_]), *sources[i]);
    }
  }
}

std::optional<std::size_t> OdometrySwitch::update(const std::vector<const Odometry*>& sources) {
  for (std::size_t i = 0; i < sources.size(); ++i) {
    const bool sound = sources[i]->status == OdometryStatus::kOk && !has_failed(*sources[i]);
    if (!sound) {
      sound_since_[i] = -1;
    } else if (sound_since_[i] < 0) {
      sound_since_[i] = sources[flying_]->stamp;
    }
  }
  align_later(sources);
  const auto next = successor(sources);
  if (!next) return std::nullopt;
  flying_ = *next;
  const Odometry laid = moved(*sources[flying_], frames_[flying_]);
  rest_.yaw_rad = so3::wrap(so3::yaw(common_.X_OB.R) - so3::yaw(laid.X_OB.R));
  rest_.shift_m = common_.X_OB.p - laid.X_OB.p - to_seconds(common_.stamp - laid.stamp) * laid.v_OB;
  return next;
}

Odometry OdometrySwitch::with_rest(const Odometry& odometry) const {
  if (rest_.is_none()) return odometry;
  // The heading turns where the vehicle is, so that its place does not swing around O.
  Odometry out = odometry;
  const Mat3 turn = so3::from_yaw(rest_.yaw_rad);
  out.X_OB.R = turn * odometry.X_OB.R;
  out.X_OB.p = odometry.X_OB.p + rest_.shift_m;
  return out;
}

Odometry OdometrySwitch::in_common_frame(const Odometry& odometry) {
  const double dt = std::max(0.0, to_seconds(odometry.stamp - common_.stamp));
  const double step_m = dt * config_.slew_mps, step_rad = dt * config_.slew_radps;
  const double left_m = rest_.shift_m.norm();
  rest_.shift_m *= left_m > step_m ? 1 - step_m / left_m : 0.0;
  rest_.yaw_rad -= std::clamp(rest_.yaw_rad, -step_rad, step_rad);
  common_ = with_rest(moved(odometry, frames_[flying_]));
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
