#include <cmath>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "app/commands.h"
#include "run/scenario.h"
#include "sensors/picture.h"

namespace arex::app {
namespace {

struct StampedPose {
  double time_s = 0;
  Pose X_OB;
};

// truth.tum of a run folder. A last line cut short by a kill is left out.
std::vector<StampedPose> read_tum(const std::filesystem::path& file) {
  std::ifstream stream(file);
  if (!stream) throw ConfigError(file.string() + ":1: cannot be read, expected a run folder");
  std::vector<StampedPose> poses;
  for (std::string line; std::getline(stream, line);) {
    if (line.empty() || line.front() == '#') continue;
    std::istringstream fields(line);
    StampedPose pose;
    Quat q;
    if (fields >> pose.time_s >> pose.X_OB.p.x() >> pose.X_OB.p.y() >> pose.X_OB.p.z() >> q.x() >>
        q.y() >> q.z() >> q.w()) {
      pose.X_OB.R = q.normalized().toRotationMatrix();
      poses.push_back(pose);
    }
  }
  if (poses.empty()) throw ConfigError(file.string() + ":1: holds no pose, expected a flown run");
  return poses;
}

// Behind and above the vehicle, looking a little ahead of it.
Pose chase_view(const Pose& X_WB) {
  const Mat3 R_heading = so3::from_yaw(so3::yaw(X_WB.R));
  return sim::look_at(X_WB.p + R_heading * Vec3(-2.6, 0.5, 0.9),
                      X_WB.p + R_heading * Vec3(1.5, 0, 0));
}

// From above the middle of the path, high enough to see all of it.
Pose top_view(const std::vector<Vec3>& path_W, double field_of_view_rad) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : path_W) box.extend(p);
  const double extent = std::max(12.0, 1.3 * box.sizes().head<2>().maxCoeff());
  const Vec3 eye = box.center() + Vec3(-0.45 * extent, 0, extent / std::tan(field_of_view_rad / 2));
  return sim::look_at(eye, box.center());
}

}  // namespace

int render(const RenderArguments& arguments) {
  const std::filesystem::path folder = arguments.folder;
  const sim::Scenario scenario = sim::load_scenario(folder / "resolved.yaml", {}, {});
  const std::vector<StampedPose> poses = read_tum(folder / "truth.tum");
  const worlds::World world = scenario.build_world();
  const Pose X_WO = sim::start_pose(world, scenario.config.stack.vehicle);

  const double time = arguments.time_s.value_or(poses.back().time_s / 2);
  sim::PictureOverlay overlay;
  overlay.paths.emplace_back().radius_m = 0.012;
  Pose X_WB = X_WO * poses.front().X_OB;
  for (std::size_t i = 0; i < poses.size(); i += 20) {
    const Pose X_WB_i = X_WO * poses[i].X_OB;
    overlay.paths.back().points_W.push_back(X_WB_i.p);
    if (poses[i].time_s <= time) X_WB = X_WB_i;
  }
  overlay.vehicles.push_back(X_WB);

  sim::PictureOptions options;
  const bool top = arguments.view == "top";
  if (top) options.cut_above_m = X_WB.p.z() + 1.0;
  if (top) overlay.paths.back().radius_m = 0.12;
  const Pose X_WC =
      top ? top_view(overlay.paths.back().points_W, options.field_of_view_rad) : chase_view(X_WB);
  sim::save_png(sim::render_picture(world, X_WC, options, overlay), arguments.out);
  std::printf("%s: %s view at %.2f s\n", arguments.out.c_str(), arguments.view.c_str(), time);
  return 0;
}

}  // namespace arex::app
