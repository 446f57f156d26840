#include "odometry/visual/marginalisation.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "odometry/visual/window_solver.h"

namespace arex {
namespace {

LinearRows stacked(const std::vector<LinearRows>& parts) {
  Eigen::Index rows = 0;
  for (const LinearRows& part : parts) rows += part.J.rows();
  LinearRows all{Eigen::MatrixXd(rows, parts.front().J.cols()), Eigen::VectorXd(rows)};
  Eigen::Index row = 0;
  for (const LinearRows& part : parts) {
    all.J.middleRows(row, part.J.rows()) = part.J;
    all.r.segment(row, part.J.rows()) = part.r;
    row += part.J.rows();
  }
  return all;
}

/// Which of a landmark's sights it starts afresh with when those before go into the prior: the
/// newest; their number: none. One that the newest frame does not see is over.
std::size_t fresh_from(const Window& window, const Landmark& landmark) {
  const std::size_t n = landmark.seen.size();
  return n < 2 || landmark.seen.back().frame != window.newest().number ? n : n - 1;
}

/// What the landmarks anchored in the oldest frame say of poses and camera, without the sight that
/// they start afresh with.
LinearRows landmark_rows(Window& window, const WindowNoise& noise) {
  const WindowLayout layout = window.layout();
  const int n = layout.visual_size();
  NormalEquations equations = empty_equations(window);
  const WindowExposures exposures(window, noise);
  for (auto& [id, landmark] : window.landmarks) {
    if (landmark.seen.front().frame != window.frames.front().number) continue;
    if (!noise.uses(landmark)) continue;
    const std::size_t count = fresh_from(window, landmark);
    // A single frame says nothing of the others.
    if (count >= 2) add_landmark(window, exposures, landmark, noise, count, equations);
  }
  const ReducedEquations reduced = reduce(equations, 0);
  const Eigen::MatrixXd H = reduced.H.topLeftCorner(n, n).selfadjointView<Eigen::Lower>();
  const LinearRows root = square_root(H, reduced.g.head(n));
  LinearRows rows{Eigen::MatrixXd::Zero(root.J.rows(), layout.size()), root.r};
  rows.J.leftCols(n) = root.J;
  return rows;
}

/// The landmark as another frame's left eye has it; its depth unknown where it is hardly before it.
LandmarkState state_from(const Window& window, const Landmark& landmark, const Observation& seen) {
  const Observation& anchor = landmark.seen.front();
  const auto pose = [&](const Observation& o) {
    const FrameState& x = window.frames[static_cast<std::size_t>(window.slot(o.frame))].state;
    return Pose{x.R_OB, x.p_OB} * window.camera.X_BC;
  };
  const Vec3 p =
      pose(seen).inverse() *
      (pose(anchor) * Vec3(landmark.state.ray.homogeneous() / landmark.state.inverse_depth));
  constexpr double kNearest = 0.1;  // m
  if (p.z() <= kNearest) return {seen.left, 0};
  return {p.hnormalized(), 1 / p.z()};
}

/// Landmarks anchored in the oldest frame find another anchor, or go.
void leave_oldest(Window& window, const WindowNoise& noise) {
  const std::int64_t oldest = window.frames.front().number;
  for (auto it = window.landmarks.begin(); it != window.landmarks.end();) {
    Landmark& landmark = it->second;
    std::vector<Observation>& seen = landmark.seen;
    if (seen.front().frame == oldest) {
      const bool used = noise.uses(landmark);
      const std::size_t from = used ? fresh_from(window, landmark) : 1;
      if (from < seen.size()) {
        landmark.state =
            used ? state_from(window, landmark, seen[from]) : LandmarkState{seen[from].left, 0};
      }
      seen.erase(seen.begin(), seen.begin() + static_cast<std::ptrdiff_t>(from));
    }
    it = seen.empty() ? window.landmarks.erase(it) : std::next(it);
  }
}

}  // namespace

LinearRows eliminate(const LinearRows& rows, const std::vector<int>& gone,
                     const std::vector<int>& kept) {
  LinearRows out{Eigen::MatrixXd::Zero(0, static_cast<Eigen::Index>(kept.size())), {}};
  std::vector<int> columns;
  const auto in_use = [&](int column) { return !rows.J.col(column).isZero(0); };
  std::copy_if(gone.begin(), gone.end(), std::back_inserter(columns), in_use);
  const auto first_kept = static_cast<Eigen::Index>(columns.size());
  std::vector<Eigen::Index> places;  // of the columns kept and in use, in `out`
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!in_use(kept[i])) continue;
    columns.push_back(kept[i]);
    places.push_back(static_cast<Eigen::Index>(i));
  }
  const Eigen::Index m = rows.J.rows(), n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd A(m, n + 1);
  for (Eigen::Index j = 0; j < n; ++j) A.col(j) = rows.J.col(columns[static_cast<std::size_t>(j)]);
  A.col(n) = rows.r;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(A);
  const Eigen::Index last = std::min(m, n);
  const Eigen::Index count = std::max<Eigen::Index>(0, last - first_kept);
  const Eigen::MatrixXd R = qr.matrixQR().triangularView<Eigen::Upper>();
  out.J = Eigen::MatrixXd::Zero(count, static_cast<Eigen::Index>(kept.size()));
  for (std::size_t j = 0; j < places.size(); ++j) {
    out.J.col(places[j]) = R.block(first_kept, first_kept + static_cast<Eigen::Index>(j), count, 1);
  }
  out.r = R.block(first_kept, n, count, 1);
  return out;
}

LinearRows square_root(const Eigen::MatrixXd& H, const Eigen::VectorXd& g) {
  // What rounding leaves of a direction without information, relative to the best one.
  constexpr double kNothing = 1e-13;
  // Not by Cholesky: Eigen's LDLT pivots by the diagonal as it was given, meets pivots that are
  // nothing but rounding, and makes much of them.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(H);
  const Eigen::VectorXd& values = eigen.eigenvalues();  // ascending
  const double least = kNothing * std::max(values[values.size() - 1], 1e-300);
  const Eigen::Index count = (values.array() > least).count();
  const auto known = eigen.eigenvectors().rightCols(count);
  const Eigen::VectorXd root = values.tail(count).cwiseSqrt();
  return {root.asDiagonal() * known.transpose(), (known.transpose() * g).cwiseQuotient(root)};
}

void marginalise_oldest(Window& window, const WindowNoise& noise) {
  const WindowLayout before = window.layout(), after{before.frames - 1};
  const LinearRows rows =
      stacked({prior_rows(window), imu_rows(window, 1, noise), landmark_rows(window, noise)});
  std::vector<int> gone, kept(static_cast<std::size_t>(after.size()));
  for (int i = 0; i < kFrameDim; ++i) gone.push_back(before.at(0, i));
  for (int k = 0; k < after.frames; ++k) {
    for (int i = 0; i < kFrameDim; ++i) {
      kept[static_cast<std::size_t>(after.at(k, i))] = before.at(k + 1, i);
    }
  }
  for (int i = 0; i < kCameraDim; ++i) {
    kept[static_cast<std::size_t>(after.camera() + i)] = before.camera() + i;
  }

  WindowPrior prior;
  prior.rows = eliminate(rows, gone, kept);
  prior.camera = window.camera;
  Eigen::VectorXd since = Eigen::VectorXd::Zero(after.size());  // the prior's states to today's
  for (int k = 0; k < after.frames; ++k) {
    const FrameState& at = linearised_at(window, k + 1, noise);
    prior.frames.push_back(at);
    const FrameError d = local(at, window.frames[static_cast<std::size_t>(k + 1)].state);
    for (int i = 0; i < kFrameDim; ++i) since[after.at(k, i)] = d[i];
  }
  prior.rows.r.noalias() -= prior.rows.J * since;

  leave_oldest(window, noise);
  window.frames.erase(window.frames.begin());
  window.frames.front().imu.reset();
  window.prior = std::move(prior);
}

Preintegration drop_newest(Window& window) {
  const std::int64_t number = window.newest().number;
  for (auto it = window.landmarks.begin(); it != window.landmarks.end();) {
    std::vector<Observation>& seen = it->second.seen;
    if (seen.back().frame == number) seen.pop_back();
    it = seen.empty() ? window.landmarks.erase(it) : std::next(it);
  }
  Preintegration imu = *window.newest().imu;
  window.frames.pop_back();
  return imu;
}

}  // namespace arex
