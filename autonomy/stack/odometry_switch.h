#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "math/so3.h"
#include "messages/estimates.h"
#include "odometry/pose_history.h"

namespace arex {

/// When another odometry takes over, and how gently.
struct FailoverConfig {
  double silent_after_s = 0.5;
  double back_after_s = 2;
  double slew_mps = 0.1;
  double slew_radps = 0.02;

  void fields(auto& f) {
    f("silent_after_s", silent_after_s,
      "without a correction for longer the flying source is taken for lost; on the IMU alone the "
      "position errs by 1 cm until then");
    f("back_after_s", back_after_s, "an earlier source is ok for so long before it flies again");
    f("slew_mps", slew_mps, "what two sources differ by comes in at this speed");
    f("slew_radps", slew_radps, "the same of the attitude");
    f.check(silent_after_s > 0 && back_after_s >= 0, "silent_after_s > 0, back_after_s >= 0");
    f.check(slew_mps > 0 && slew_mps <= 10 && slew_radps > 0 && slew_radps <= 10,
            "0 < slew_mps, slew_radps <= 10");
  }
};

/// Which of several odometry sources flies, the first while it can, and where its frame lies in the
/// one that the vehicle flies in.
///
/// Each source has an O of its own, level like the others: they differ by a heading and a place.
/// While one flies, the frames of those behind it in the list are laid over its own; when it fails,
/// the next goes on from there. Whatever is left between the two is added to the estimate and taken
/// back slowly: neither a change nor the way back is a step to the controller. The frame of one
/// further ahead stays where it was, for the maps were made in it.
class OdometrySwitch {
 public:
  OdometrySwitch(const FailoverConfig& config, std::size_t sources);

  /// The newest estimate of each source that may fly, in its own frame; every 5 ms or so.
  /// @return the index of the source that flies from now on, if that has changed.
  std::optional<std::size_t> update(const std::vector<const Odometry*>& sources);

  [[nodiscard]] std::size_t flying() const { return flying_; }
  /// The flying source's estimate in the frame that the vehicle flies in. To be called once for
  /// each new estimate, in order.
  [[nodiscard]] Odometry in_common_frame(const Odometry& odometry);
  /// The newest one that was given out, in the frame of a source.
  [[nodiscard]] Odometry in_frame_of(std::size_t source) const;

 private:
  /// A turn about the vertical, then a shift.
  struct Offset {
    double yaw_rad = 0;
    Vec3 shift_m = Vec3::Zero();
    [[nodiscard]] bool is_none() const { return yaw_rad == 0 && shift_m.isZero(0); }
    [[nodiscard]] Pose pose() const { return {so3::from_yaw(yaw_rad), shift_m}; }
  };
  static Odometry moved(const Odometry& odometry, const Offset& offset);
  /// What lays one source over another, by what both said of the same moment.
  [[nodiscard]] Offset between(std::size_t flying, std::size_t other) const;
  [[nodiscard]] bool has_failed(const Odometry& odometry) const;
  [[nodiscard]] std::optional<std::size_t> successor(
      const std::vector<const Odometry*>& sources) const;
  void align_later();
  [[nodiscard]] Odometry with_rest(const Odometry& odometry) const;

  FailoverConfig config_;
  std::vector<Offset> frames_;      ///< of each source's O
  std::vector<Stamp> sound_since_;  ///< -1: it is not
  std::size_t flying_ = 0;
  std::vector<PoseHistory> said_;  ///< by each source, in its own O
  Odometry common_;                ///< the newest given out
  PoseHistory given_out_;
  // Still to be taken back. Sources differ in roll and pitch, too; about the vehicle, or its place
  // would swing around O.
  Vec3 rest_turn_rad_ = Vec3::Zero();  ///< rotation vector in O
  Vec3 rest_shift_m_ = Vec3::Zero();
};

}  // namespace arex
