#pragma once

#include <Eigen/Core>
#include <vector>

#include "odometry/visual/window.h"

/// Gauss-Newton over the window, damped where it has to be. Landmarks are eliminated first, a 3x3
/// block each; the rest is one dense Cholesky factorisation.
namespace arex {

/// The squared problem around a state: 1/2 |r + J d|^2 by d' H d / 2 + g' d + cost.
struct NormalEquations {
  /// A landmark's own rows.
  struct LandmarkTerm {
    Landmark* landmark = nullptr;
    Mat3 H = Mat3::Zero();
    Vec3 g = Vec3::Zero();
  };
  Eigen::MatrixXd H;  ///< lower triangle, WindowLayout
  Eigen::VectorXd g;
  Eigen::MatrixXd W;  ///< how landmarks hang on poses and camera: three columns each
  std::vector<LandmarkTerm> terms;
  double cost = 0;
};

[[nodiscard]] NormalEquations linearise(Window& window, const WindowNoise& noise);

/// H and g of poses, camera and motions alone, for the best landmarks, damped by `lambda`.
struct ReducedEquations {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};
[[nodiscard]] ReducedEquations reduce(const NormalEquations& equations, double lambda);

/// The damped step of all unknowns: the window's, then the landmarks in order of their terms.
struct WindowStep {
  Eigen::VectorXd states;
  Eigen::VectorXd landmarks;
};
[[nodiscard]] WindowStep solve(const NormalEquations& equations, double lambda);

struct SolveReport {
  int iterations = 0;
  double cost_before = 0, cost_after = 0;
  Eigen::Matrix<double, kFrameDim, kFrameDim> newest_covariance;  ///< of the newest frame's error
  Eigen::Matrix<double, kCameraDim, kCameraDim> camera_covariance;
};
/// @param iterations at most; a rejected step counts as one
/// @param converged a step of fewer sigma ends it
SolveReport optimise(Window& window, const WindowNoise& noise, int iterations, double converged);

// Pieces that marginalisation takes single.

/// Where the window's frames were when exposed, and where derivatives are taken.
struct WindowExposures {
  WindowExposures(const Window& window, const WindowNoise& noise);
  std::vector<Exposure> now, linearised;
};
/// Mean distance, in units of ray_std, of a landmark's sights from where the window puts it;
/// nothing where it would lie behind a camera.
[[nodiscard]] std::optional<double> mean_residual(const Window& window,
                                                  const WindowExposures& exposures,
                                                  const Landmark& landmark,
                                                  const WindowNoise& noise);
/// Adds the sights that the first `count` frames have of a landmark to `equations` as a term of its
/// own.
void add_landmark(const Window& window, const WindowExposures& exposures, Landmark& landmark,
                  const WindowNoise& noise, std::size_t count, NormalEquations& equations);
/// Equations of nothing, for the window's layout.
[[nodiscard]] NormalEquations empty_equations(const Window& window);
/// Whitened rows of the IMU between frames `to` - 1 and `to`.
[[nodiscard]] LinearRows imu_rows(const Window& window, int to, const WindowNoise& noise);
/// The prior's rows around the window's present state, columns: the window's layout.
[[nodiscard]] LinearRows prior_rows(const Window& window);
/// Where derivatives of a frame's factors are taken.
[[nodiscard]] const FrameState& linearised_at(const Window& window, int frame,
                                              const WindowNoise& noise);

}  // namespace arex
