#include "odometry/visual/window_solver.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace arex {
namespace {

// A landmark is no further than this, m: beyond, the ray alone tells, and a depth of infinity or
// behind it would keep it from coming back.
constexpr double kFurthest = 1000;

void add_rows(const LinearRows& rows, NormalEquations& out) {
  if (rows.J.rows() == 0) return;
  out.H.selfadjointView<Eigen::Lower>().rankUpdate(rows.J.transpose());
  out.g.noalias() += rows.J.transpose() * rows.r;
  out.cost += 0.5 * rows.r.squaredNorm();
}

/// The IMU's rows touch two frames only.
void add_imu(const Window& window, int to, const WindowNoise& noise, NormalEquations& out) {
  const WindowFrame& frame = window.frames[static_cast<std::size_t>(to)];
  const FrameState& before = window.frames[static_cast<std::size_t>(to - 1)].state;
  const ImuJacobian whitening = imu_whitening(*frame.imu);
  const ImuJacobians by = imu_jacobians(*frame.imu, linearised_at(window, to - 1, noise),
                                        linearised_at(window, to, noise));
  Eigen::Matrix<double, kFrameDim, 2 * kFrameDim> J;
  J << whitening * by.from, whitening * by.to;
  const ImuResidual r = whitening * imu_residual(*frame.imu, before, frame.state);
  const Eigen::Matrix<double, 2 * kFrameDim, 2 * kFrameDim> H = J.transpose() * J;
  const Eigen::Matrix<double, 2 * kFrameDim, 1> g = J.transpose() * r;
  const WindowLayout layout = window.layout();
  const auto place = [&](int i) {
    return i < kFrameDim ? layout.at(to - 1, i) : layout.at(to, i - kFrameDim);
  };
  for (int i = 0; i < 2 * kFrameDim; ++i) {
    out.g[place(i)] += g[i];
    for (int j = 0; j < 2 * kFrameDim; ++j) {
      if (place(i) >= place(j)) out.H(place(i), place(j)) += H(i, j);
    }
  }
  out.cost += 0.5 * r.squaredNorm();
}

/// Huber's weight of a residual of that many sigma, and its cost.
struct Robust {
  double weight, cost;
};
Robust huber(double sigma, double limit) {
  if (sigma <= limit) return {1, 0.5 * sigma * sigma};
  return {limit / sigma, limit * (sigma - 0.5 * limit)};
}

/// Moves the window's states and landmarks; what it was.
struct Undo {
  std::vector<FrameState> states;
  CameraState camera;
  std::vector<LandmarkState> landmarks;
};

Undo apply(Window& window, const NormalEquations& equations, const WindowStep& step) {
  Undo undo;
  const WindowLayout layout = window.layout();
  undo.camera = window.camera;
  for (int k = 0; k < layout.frames; ++k) {
    FrameState& state = window.frames[static_cast<std::size_t>(k)].state;
    undo.states.push_back(state);
    FrameError d;
    d << step.states.segment<kPoseDim>(layout.pose(k)),
        step.states.segment<kMotionDim>(layout.motion(k));
    state = retract(state, d);
  }
  window.camera = retract(window.camera, step.states.segment<kCameraDim>(layout.camera()));
  for (std::size_t l = 0; l < equations.terms.size(); ++l) {
    LandmarkState& state = equations.terms[l].landmark->state;
    undo.landmarks.push_back(state);
    const Vec3 d =
        step.landmarks.segment<kLandmarkDim>(kLandmarkDim * static_cast<Eigen::Index>(l));
    state.ray += d.head<2>();
    state.inverse_depth = std::max(state.inverse_depth + d.z(), 1 / kFurthest);
  }
  return undo;
}

void take_back(Window& window, const NormalEquations& equations, const Undo& undo) {
  for (std::size_t k = 0; k < undo.states.size(); ++k) window.frames[k].state = undo.states[k];
  window.camera = undo.camera;
  for (std::size_t l = 0; l < equations.terms.size(); ++l) {
    equations.terms[l].landmark->state = undo.landmarks[l];
  }
}

/// Calls `visit(sight, slot of the anchor, slot of the observer)` for the sights that a landmark's
/// first `count` frames have of it.
template <class Visit>
void for_each_sight(const Window& window, const Landmark& landmark, const WindowNoise& noise,
                    std::size_t count, const Visit& visit) {
  const Observation& anchor = landmark.seen.front();
  const auto anchor_slot = static_cast<std::size_t>(window.slot(anchor.frame));
  for (std::size_t i = 0; i < std::min(count, landmark.seen.size()); ++i) {
    const Observation& seen = landmark.seen[i];
    const auto slot = static_cast<std::size_t>(window.slot(seen.frame));
    Sight sight{seen, i == 0, false, noise.baseline_m};
    visit(sight, anchor_slot, slot);
    sight.right = true;
    if (seen.right) visit(sight, anchor_slot, slot);
  }
}

}  // namespace

const FrameState& linearised_at(const Window& window, int frame, const WindowNoise& noise) {
  const auto k = static_cast<std::size_t>(frame);
  return noise.first_estimates && k < window.prior.frames.size() ? window.prior.frames[k]
                                                                 : window.frames[k].state;
}

LinearRows prior_rows(const Window& window) {
  const WindowPrior& prior = window.prior;
  const WindowLayout from{static_cast<int>(prior.frames.size())}, to = window.layout();
  LinearRows rows{Eigen::MatrixXd::Zero(prior.rows.J.rows(), to.size()), prior.rows.r};
  if (prior.rows.J.rows() == 0) return rows;
  Eigen::VectorXd d = Eigen::VectorXd::Zero(from.size());
  for (int k = 0; k < from.frames; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const FrameError error = local(prior.frames[i], window.frames[i].state);
    d.segment<kPoseDim>(from.pose(k)) = error.head<kPoseDim>();
    d.segment<kMotionDim>(from.motion(k)) = error.tail<kMotionDim>();
    rows.J.middleCols<kPoseDim>(to.pose(k)) = prior.rows.J.middleCols<kPoseDim>(from.pose(k));
    rows.J.middleCols<kMotionDim>(to.motion(k)) =
        prior.rows.J.middleCols<kMotionDim>(from.motion(k));
  }
  d.segment<kCameraDim>(from.camera()) = local(prior.camera, window.camera);
  rows.J.middleCols<kCameraDim>(to.camera()) = prior.rows.J.middleCols<kCameraDim>(from.camera());
  rows.r.noalias() += prior.rows.J * d;
  return rows;
}

LinearRows imu_rows(const Window& window, int to, const WindowNoise& noise) {
  const WindowFrame& frame = window.frames[static_cast<std::size_t>(to)];
  const FrameState& before = window.frames[static_cast<std::size_t>(to - 1)].state;
  const ImuJacobian whitening = imu_whitening(*frame.imu);
  const ImuJacobians by = imu_jacobians(*frame.imu, linearised_at(window, to - 1, noise),
                                        linearised_at(window, to, noise));
  const WindowLayout layout = window.layout();
  LinearRows rows{Eigen::MatrixXd::Zero(kFrameDim, layout.size()),
                  whitening * imu_residual(*frame.imu, before, frame.state)};
  const ImuJacobian from = whitening * by.from, at = whitening * by.to;
  for (int i = 0; i < kFrameDim; ++i) {
    rows.J.col(layout.at(to - 1, i)) = from.col(i);
    rows.J.col(layout.at(to, i)) = at.col(i);
  }
  return rows;
}

NormalEquations empty_equations(const Window& window) {
  const WindowLayout layout = window.layout();
  NormalEquations out;
  out.H = Eigen::MatrixXd::Zero(layout.size(), layout.size());
  out.g = Eigen::VectorXd::Zero(layout.size());
  out.W.resize(layout.visual_size(), 0);
  return out;
}

WindowExposures::WindowExposures(const Window& window, const WindowNoise& noise) {
  for (int k = 0; k < window.layout().frames; ++k) {
    const WindowFrame& frame = window.frames[static_cast<std::size_t>(k)];
    now.emplace_back(frame.state, frame.timing, window.camera.t_d);
    linearised.emplace_back(linearised_at(window, k, noise), frame.timing, window.camera.t_d);
  }
}

void add_landmark(const Window& window, const WindowExposures& exposures, Landmark& landmark,
                  const WindowNoise& noise, std::size_t count, NormalEquations& out) {
  const WindowLayout layout = window.layout();
  const int camera = layout.camera();
  NormalEquations::LandmarkTerm term;
  term.landmark = &landmark;
  const Eigen::Index column = kLandmarkDim * static_cast<Eigen::Index>(out.terms.size());
  if (out.W.cols() <= column) out.W.conservativeResize(Eigen::NoChange, 2 * column + 96);
  auto W = out.W.middleCols<kLandmarkDim>(column);
  W.setZero();
  const auto visit = [&](const Sight& sight, std::size_t a, std::size_t s) {
    const auto residual =
        sight_residual(sight, exposures.now[a], exposures.now[s], window.camera, landmark.state);
    if (!residual) return;
    const double scale = 1 / (sight.right ? noise.disparity_std : noise.ray_std);
    const Robust robust = huber(scale * residual->norm(), noise.huber_sigma);
    out.cost += robust.cost;
    const double factor = scale * std::sqrt(robust.weight);
    const Vec2 r = factor * *residual;
    SightJacobians J = sight_jacobians(sight, exposures.linearised[a], exposures.linearised[s],
                                       window.camera, landmark.state);
    J.landmark *= factor;
    term.H.noalias() += J.landmark.transpose() * J.landmark;
    term.g.noalias() += J.landmark.transpose() * r;
    if (sight.own) return;
    J.anchor *= factor;
    J.seen *= factor;
    J.camera *= factor;
    const int pa = layout.pose(static_cast<int>(a)), ps = layout.pose(static_cast<int>(s));
    out.H.block<kPoseDim, kPoseDim>(pa, pa).noalias() += J.anchor.transpose() * J.anchor;
    out.H.block<kPoseDim, kPoseDim>(ps, ps).noalias() += J.seen.transpose() * J.seen;
    out.H.block<kPoseDim, kPoseDim>(ps, pa).noalias() += J.seen.transpose() * J.anchor;
    out.H.block<kCameraDim, kPoseDim>(camera, pa).noalias() += J.camera.transpose() * J.anchor;
    out.H.block<kCameraDim, kPoseDim>(camera, ps).noalias() += J.camera.transpose() * J.seen;
    out.H.block<kCameraDim, kCameraDim>(camera, camera).noalias() +=
        J.camera.transpose() * J.camera;
    out.g.segment<kPoseDim>(pa).noalias() += J.anchor.transpose() * r;
    out.g.segment<kPoseDim>(ps).noalias() += J.seen.transpose() * r;
    out.g.segment<kCameraDim>(camera).noalias() += J.camera.transpose() * r;
    W.template middleRows<kPoseDim>(pa).noalias() += J.anchor.transpose() * J.landmark;
    W.template middleRows<kPoseDim>(ps).noalias() += J.seen.transpose() * J.landmark;
    W.template middleRows<kCameraDim>(camera).noalias() += J.camera.transpose() * J.landmark;
  };
  for_each_sight(window, landmark, noise, count, visit);
  // Without a depth its ray says nothing of the frames.
  if (term.H(2, 2) <= 0) return;
  out.terms.push_back(term);
}

NormalEquations linearise(Window& window, const WindowNoise& noise) {
  NormalEquations out = empty_equations(window);
  // At once, for each has some hundred kilobytes.
  out.terms.reserve(window.landmarks.size());
  out.W.resize(Eigen::NoChange, kLandmarkDim * static_cast<Eigen::Index>(window.landmarks.size()));
  add_rows(prior_rows(window), out);
  for (int to = 1; to < window.layout().frames; ++to) add_imu(window, to, noise, out);
  const WindowExposures exposures(window, noise);
  for (auto& [id, landmark] : window.landmarks) {
    if (!noise.uses(landmark)) continue;
    add_landmark(window, exposures, landmark, noise, landmark.seen.size(), out);
  }
  return out;
}

ReducedEquations reduce(const NormalEquations& equations, double lambda) {
  ReducedEquations out{equations.H, equations.g};
  out.H.diagonal() *= 1 + lambda;
  if (equations.terms.empty()) return out;
  const Eigen::Index n = equations.W.rows();
  const Eigen::Index columns = kLandmarkDim * static_cast<Eigen::Index>(equations.terms.size());
  Eigen::MatrixXd scaled(n, columns);
  Eigen::VectorXd rest(columns);
  Eigen::Index column = 0;
  for (const auto& term : equations.terms) {
    Mat3 damped = term.H;
    damped.diagonal() *= 1 + lambda;
    const Mat3 L = damped.llt().matrixL();
    const Mat3 inverse = L.triangularView<Eigen::Lower>().solve(Mat3::Identity());
    scaled.middleCols<kLandmarkDim>(column).noalias() =
        equations.W.middleCols<kLandmarkDim>(column) * inverse.transpose();
    rest.segment<kLandmarkDim>(column) = inverse * term.g;
    column += kLandmarkDim;
  }
  out.H.topLeftCorner(n, n).selfadjointView<Eigen::Lower>().rankUpdate(scaled, -1);
  out.g.head(n).noalias() -= scaled * rest;
  return out;
}

WindowStep solve(const NormalEquations& equations, double lambda) {
  ReducedEquations reduced = reduce(equations, lambda);
  WindowStep step;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(reduced.H);  // in its place
  step.states = -factor.solve(reduced.g);
  const Eigen::Index columns = kLandmarkDim * static_cast<Eigen::Index>(equations.terms.size());
  step.landmarks = equations.W.leftCols(columns).transpose() * step.states.head(equations.W.rows());
  Eigen::Index column = 0;
  for (const auto& term : equations.terms) {
    Mat3 damped = term.H;
    damped.diagonal() *= 1 + lambda;
    auto d = step.landmarks.segment<kLandmarkDim>(column);
    d = -damped.llt().solve(Vec3(term.g + d)).eval();
    column += kLandmarkDim;
  }
  return step;
}

SolveReport optimise(Window& window, const WindowNoise& noise, int iterations, double converged) {
  constexpr double kLeastDamping = 1e-7, kMostDamping = 1e3;
  SolveReport report;
  NormalEquations equations = linearise(window, noise);
  report.cost_before = equations.cost;
  double lambda = kLeastDamping;
  while (report.iterations < iterations) {
    ++report.iterations;
    const WindowStep step = solve(equations, lambda);
    if (!step.states.allFinite() || !step.landmarks.allFinite()) {
      lambda = std::min(kMostDamping, 100 * lambda);
      continue;
    }
    const Undo undo = apply(window, equations, step);
    NormalEquations next = linearise(window, noise);
    if (!(next.cost <= equations.cost)) {
      take_back(window, equations, undo);
      lambda = std::min(kMostDamping, 100 * lambda);
      continue;
    }
    const double gained = equations.cost - next.cost;
    equations = std::move(next);
    lambda = std::max(kLeastDamping, 0.01 * lambda);
    if (2 * gained < converged * converged * static_cast<double>(step.states.size())) break;
  }
  report.cost_after = equations.cost;

  const WindowLayout layout = window.layout();
  Eigen::MatrixXd H = reduce(equations, 0).H;
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factor(H);
  Eigen::MatrixXd wanted = Eigen::MatrixXd::Zero(layout.size(), kFrameDim + kCameraDim);
  const int last = layout.frames - 1;
  for (int i = 0; i < kFrameDim; ++i) wanted(layout.at(last, i), i) = 1;
  for (int i = 0; i < kCameraDim; ++i) wanted(layout.camera() + i, kFrameDim + i) = 1;
  const Eigen::MatrixXd P = factor.solve(wanted);
  for (int i = 0; i < kFrameDim; ++i) {
    report.newest_covariance.row(i) = P.row(layout.at(last, i)).head<kFrameDim>();
  }
  report.camera_covariance = P.block<kCameraDim, kCameraDim>(layout.camera(), kFrameDim);
  return report;
}

std::optional<double> mean_residual(const Window& window, const WindowExposures& exposures,
                                    const Landmark& landmark, const WindowNoise& noise) {
  double sum = 0;
  int count = 0;
  bool behind = false;
  for_each_sight(window, landmark, noise, landmark.seen.size(),
                 [&](const Sight& sight, std::size_t a, std::size_t s) {
                   const auto residual = sight_residual(sight, exposures.now[a], exposures.now[s],
                                                        window.camera, landmark.state);
                   behind |= !residual;
                   if (residual) sum += residual->norm() / noise.ray_std;
                   ++count;
                 });
  if (behind || count == 0) return std::nullopt;
  return sum / count;
}

}  // namespace arex
