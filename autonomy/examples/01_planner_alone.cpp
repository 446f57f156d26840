// The B-spline planner without anything around it: a grid with a pillar in the way, a state, a
// goal.
//
//     build/autonomy/examples/01_planner_alone

#include <cstdio>
#include <vector>

#include "planning/bspline_planner.h"

int main() {
  using namespace arex;

  // 12 m x 8 m x 3 m at 0.1 m, all of it seen and free.
  const Eigen::Vector3i size(120, 80, 30);
  std::vector<std::uint8_t> cells(static_cast<std::size_t>(size.prod()), GridView::kKnown);
  GridView grid;
  grid.resolution_m = 0.1;
  grid.low = Vec3(-1, -4, 0);
  grid.size = size;
  grid.cells = cells.data();

  // A pillar of 0.4 m at x = 5 m, and the inflation of 0.5 m around it: what the vehicle's centre
  // must not enter.
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const Vec3 p = grid.centre_of({x, y, z});
        const double off = (p.head<2>() - Vec2(5, 0.1)).cwiseAbs().maxCoeff();
        std::uint8_t& cell = cells[grid.index({x, y, z})];
        if (off < 0.2) cell |= GridView::kOccupied;
        if (off < 0.7) cell |= GridView::kInflated;
      }
    }
  }

  BsplinePlanner planner((LocalPlannerConfig()));
  PlanRequest request;
  request.start = {Vec3(0, 0, 1.5), Vec3(1, 0, 0), Vec3::Zero()};
  request.goal = Vec3(9, 0, 1.5);
  const PlanResult plan = planner.plan(grid, request);
  if (!plan.ok()) {
    std::fprintf(stderr, "no plan: %s\n", to_string(plan.status).data());
    return 1;
  }
  std::printf("# made by: %s\n# time_s x_m y_m z_m speed_mps\n",
              to_string(plan.diagnostics.stage).data());
  for (double t = 0; t <= plan.trajectory.duration_s(); t += 0.25) {
    const Vec3 p = plan.trajectory.position(t);
    std::printf("%.2f %.3f %.3f %.3f %.2f\n", t, p.x(), p.y(), p.z(),
                plan.trajectory.velocity(t).norm());
  }
  return 0;
}
