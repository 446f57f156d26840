#include "odometry/visual/visual_inertial_source.h"

#include <utility>

namespace arex {

std::optional<OdometrySource::Job> VisualInertialSource::add_images(const StereoImagePtr& images) {
  std::optional<ImageJob> prepared = odometry_.prepare(images);
  if (!prepared) return std::nullopt;
  return [this, job = *std::move(prepared)]() -> Delivery {
    VisualUpdate update = odometry_.correct(job);
    std::vector<FeatureSight> features;
    if (report_features_) {
      for (const ImageFeature& f : odometry_.tracker().features()) {
        features.push_back({update.stamp, f.id, f.left_px, f.age});
      }
    }
    return [this, update = std::move(update), features = std::move(features)] {
      apply(update, features);
    };
  };
}

void VisualInertialSource::apply(const VisualUpdate& update, std::vector<FeatureSight> features) {
  odometry_.apply(update);
  features_ = std::move(features);
  faults_.insert(faults_.end(), update.faults.begin(), update.faults.end());
  if (update.status == OdometryStatus::kInitialising) return;
  ++tally_.exposures;
  tally_.tracked += update.window.tracked;
  tally_.keyframes += update.window.keyframe;
}

}  // namespace arex
