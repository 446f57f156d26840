#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/SVD>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <set>
#include <string>

#include "math/random.h"
#include "messages/vehicle.h"
#include "odometry/visual/marginalisation.h"
#include "odometry/visual/window_solver.h"
#include "support/analytic_motion.h"

namespace arex {
namespace {

constexpr double kBaseline = 0.05, kFocal = 422.6;

WindowNoise noise_of(bool first_estimates) {
  WindowNoise noise;
  noise.ray_std = 0.5 / kFocal;
  noise.disparity_std = std::sqrt(2.0) * noise.ray_std;  // each eye's by itself
  noise.huber_sigma = 1e6;                               // linear problems only
  noise.baseline_m = kBaseline;
  noise.first_estimates = first_estimates;
  return noise;
}

/// Frames 0.2 s apart along a motion, each displaced a little from the truth, and points ahead that
/// are seen with noise. @param newest_too whether the newest frame sees what the oldest does
Window make_window(std::uint64_t seed, int frames, bool newest_too = true) {
  static const test::AnalyticMotion motion{test::loop_points(24, 16, 1.5, 2, 0.8, 1), 0.8, 0.5};
  RandomStream random(seed, "window");
  Window window;
  window.camera.X_BC = VehicleConfig{}.X_BC();
  std::vector<Pose> truth;
  for (int k = 0; k < frames; ++k) {
    const Stamp stamp = from_seconds(6 + 0.2 * k);
    const test::MotionState x = motion.at(to_seconds(stamp));
    truth.push_back(x.X_OB * window.camera.X_BC);
    WindowFrame frame;
    frame.number = 10 + k;
    frame.stamp = stamp;
    frame.keyframe = true;
    frame.state = {x.X_OB.R * so3::Exp(0.003 * random.normal3()),
                   x.X_OB.p + 0.01 * random.normal3(),
                   x.v_OB + 0.02 * random.normal3(),
                   {},
                   {}};
    frame.state.b_g.setZero();
    frame.state.b_a.setZero();
    if (k > 0) {
      Preintegration imu({}, Vec3::Zero(), Vec3::Zero());
      std::vector<ImuSample> samples;
      for (Stamp t = stamp - from_seconds(0.2); t <= stamp; t += 5'000'000) {
        samples.push_back(motion.imu(t));
      }
      for (const auto& interval : imu_intervals(samples, samples.front().stamp, stamp, 1)) {
        imu.add(interval);
      }
      frame.imu = imu;
    }
    window.frames.push_back(frame);
  }
  for (int l = 0; l < 40; ++l) {
    const int anchor = l % 2 == 0 ? 0 : random.uniform_int(1, frames - 2);
    const Vec3 p_O = truth[static_cast<std::size_t>(anchor)] *
                     Vec3(random.uniform(-4, 4), random.uniform(-2, 2), random.uniform(4, 15));
    Landmark landmark;
    landmark.id = 100 + l;
    const int last = anchor == 0 && !newest_too ? frames - 2 : frames - 1;
    for (int k = anchor; k <= last; ++k) {
      const Vec3 p_C = truth[static_cast<std::size_t>(k)].inverse() * p_O;
      Observation o;
      o.frame = 10 + k;
      const auto shaken = [&](const Vec2& z) {
        return Vec2(z + 0.5 / kFocal * Vec2(random.normal(), random.normal()));
      };
      o.left = shaken(p_C.hnormalized());
      if (k % 2 == 0) o.right = shaken((p_C - kBaseline * Vec3::UnitX()).hnormalized());
      landmark.seen.push_back(o);
      if (k == anchor) landmark.state = {o.left, (1 + 0.05 * random.normal()) / p_C.z()};
    }
    window.landmarks.emplace(landmark.id, landmark);
  }
  window.prior.camera = window.camera;
  return window;
}

/// A prior on the first frame and the camera that leaves nothing free.
void pin_down(Window& window) {
  const WindowLayout one{1};
  window.prior.frames = {window.frames.front().state};
  window.prior.camera = window.camera;
  window.prior.rows.J = 100 * Eigen::MatrixXd::Identity(one.size(), one.size());
  window.prior.rows.r = Eigen::VectorXd::Zero(one.size());
}

TEST(WindowSolver, StepsWhereADenseSolutionOfTheFullSystemDoes) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Window window = make_window(seed, 5);
    pin_down(window);
    const NormalEquations equations = linearise(window, noise_of(false));
    const Eigen::Index n = equations.H.rows(), v = equations.W.rows();
    const auto m = static_cast<Eigen::Index>(3 * equations.terms.size());
    ASSERT_GT(m, 90);
    Eigen::MatrixXd full = Eigen::MatrixXd::Zero(n + m, n + m);
    Eigen::VectorXd g(n + m);
    full.topLeftCorner(n, n) = equations.H.selfadjointView<Eigen::Lower>();
    full.block(0, n, v, m) = equations.W.leftCols(m);
    full.block(n, 0, m, v) = equations.W.leftCols(m).transpose();
    g.head(n) = equations.g;
    Eigen::Index at = n;
    for (const auto& term : equations.terms) {
      full.block<3, 3>(at, at) = term.H;
      g.segment<3>(at) = term.g;
      at += 3;
    }
    const Eigen::VectorXd dense = -full.ldlt().solve(g);
    const WindowStep step = solve(equations, 0);
    EXPECT_LT((step.states - dense.head(n)).norm(), 1e-6 * dense.head(n).norm());
    EXPECT_LT((step.landmarks - dense.tail(m)).norm(), 1e-6 * dense.tail(m).norm());
  }
}

TEST(WindowSolver, LinearisesTheCostItReports) {
  Window window = make_window(4, 4);
  pin_down(window);
  const WindowNoise noise = noise_of(false);
  const NormalEquations at = linearise(window, noise);
  const WindowLayout layout = window.layout();
  for (int k = 0; k < layout.frames; ++k) {
    for (int i = 0; i < kFrameDim; ++i) {
      constexpr double h = 1e-7;
      FrameError d = FrameError::Zero();
      d[i] = h;
      FrameState& state = window.frames[static_cast<std::size_t>(k)].state;
      const FrameState before = state;
      state = retract(before, d);
      const double plus = linearise(window, noise).cost;
      state = retract(before, -d);
      const double minus = linearise(window, noise).cost;
      state = before;
      const double slope = (plus - minus) / (2 * h);
      const double g = at.g[layout.at(k, i)];
      EXPECT_NEAR(slope, g, 1e-3 * std::max(1.0, std::abs(g))) << k << ' ' << i;
    }
  }
}

TEST(WindowSolver, ReducesTheCostToWhatTheNoiseLeaves) {
  Window window = make_window(5, 6);
  pin_down(window);
  int residuals = 0;
  for (const auto& [id, landmark] : window.landmarks) residuals += 2 * landmark.images() - 3;
  const SolveReport report = optimise(window, noise_of(false), 10, 1e-6);
  EXPECT_GT(report.cost_before, 3 * report.cost_after);
  // A chi square of as many degrees as there are residuals, roughly.
  EXPECT_LT(report.cost_after, 0.5 * 1.3 * residuals);
  EXPECT_GT(report.cost_after, 0.5 * 0.4 * residuals);
}

TEST(Elimination, LeavesTheMinimumOfTheRestWhereItIs) {
  RandomStream random(6, "elimination");
  LinearRows rows{Eigen::MatrixXd(30, 12), Eigen::VectorXd(30)};
  for (Eigen::Index i = 0; i < rows.J.size(); ++i) rows.J.data()[i] = random.normal();
  for (Eigen::Index i = 0; i < rows.r.size(); ++i) rows.r[i] = random.normal();
  const std::vector<int> gone{3, 0, 7}, kept{1, 2, 4, 5, 6, 8, 9, 10, 11};
  const LinearRows rest = eliminate(rows, gone, kept);
  const Eigen::VectorXd batch =
      -(rows.J.transpose() * rows.J).ldlt().solve(rows.J.transpose() * rows.r);
  const Eigen::VectorXd alone =
      -(rest.J.transpose() * rest.J).ldlt().solve(rest.J.transpose() * rest.r);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_NEAR(alone[static_cast<Eigen::Index>(i)], batch[kept[i]], 1e-10);
  }
}

TEST(Elimination, SquareRootIsOneAndLeavesOutWhatIsNotKnown) {
  RandomStream random(7, "root");
  Eigen::MatrixXd A(4, 9);
  for (Eigen::Index i = 0; i < A.size(); ++i) A.data()[i] = random.normal();
  const Eigen::MatrixXd H = A.transpose() * A;
  const Eigen::VectorXd g = A.transpose() * Eigen::Vector4d(1, -2, 3, 4);
  const LinearRows root = square_root(H, g);
  EXPECT_EQ(root.J.rows(), 4);
  EXPECT_LT((root.J.transpose() * root.J - H).norm(), 1e-10);
  EXPECT_LT((root.J.transpose() * root.r - g).norm(), 1e-9);
}

// H, its lower rows, and g of a flight's landmarks: 46 of 73 directions are known, the others are
// what rounding leaves. Eigen's LDLT, which pivots by the diagonal as it was given, met a pivot of
// rounding among them, and the window moved by 0.2 m.
TEST(Elimination, SquareRootMakesNothingOfRounding) {
  std::ifstream file(AREX_SOURCE_DIR
                     "/tests/autonomy/visual_odometry/data/landmarks_of_a_window.txt");
  Eigen::Index n = 0;
  ASSERT_TRUE(file >> n);
  const auto number = [&file] {  // hexadecimal: to the last bit
    std::string text;
    file >> text;
    return std::strtod(text.c_str(), nullptr);
  };
  Eigen::MatrixXd H(n, n);
  Eigen::VectorXd g(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index k = 0; k <= i; ++k) H(i, k) = H(k, i) = number();
    g[i] = number();
  }
  ASSERT_TRUE(file);
  const LinearRows root = square_root(H, g);
  EXPECT_EQ(root.J.rows(), 46);
  EXPECT_LT((root.J.transpose() * root.J - H).norm(), 1e-12 * H.norm());
  EXPECT_LT((root.J.transpose() * root.r - g).norm(), 1e-9 * g.norm());
  EXPECT_LT(root.r.squaredNorm(), 50);
}

TEST(Marginalisation, ThenSolvingIsTheBatchSolution) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    // The newest frame sees nothing of what goes into the prior, so that nothing is left out.
    Window window = make_window(seed, 5, false);
    pin_down(window);
    const WindowNoise noise = noise_of(false);
    const WindowStep batch = solve(linearise(window, noise), 0);
    const WindowLayout before = window.layout();
    marginalise_oldest(window, noise);
    const WindowLayout after = window.layout();
    ASSERT_EQ(after.frames, before.frames - 1);
    const WindowStep rest = solve(linearise(window, noise), 0);
    for (int k = 0; k < after.frames; ++k) {
      for (int i = 0; i < kFrameDim; ++i) {
        EXPECT_NEAR(rest.states[after.at(k, i)], batch.states[before.at(k + 1, i)], 2e-6);
      }
    }
  }
}

TEST(Marginalisation, CountsNoSightTwice) {
  Window window = make_window(2, 5);
  pin_down(window);
  const WindowNoise noise = noise_of(true);
  std::set<std::int64_t> anchored;
  for (const auto& [id, landmark] : window.landmarks) {
    if (landmark.seen.front().frame == window.frames.front().number) anchored.insert(id);
  }
  ASSERT_GT(anchored.size(), 10U);
  const std::int64_t newest = window.newest().number;
  marginalise_oldest(window, noise);
  for (const std::int64_t id : anchored) {
    const Landmark& landmark = window.landmarks.at(id);
    ASSERT_EQ(landmark.seen.size(), 1U);
    EXPECT_EQ(landmark.seen.front().frame, newest);
    EXPECT_GT(landmark.state.inverse_depth, 0);
  }
}

TEST(Marginalisation, KeepsTheWindowsIgnoranceOfPlaceAndHeading) {
  for (const std::uint64_t seed : {1, 2}) {
    Window window = make_window(seed, 5);
    // Biases and camera are known; nothing says where it is, which way it looks and how fast it is.
    pin_down(window);
    const WindowLayout one{1};
    window.prior.rows.J.topRows(one.pose(0) + kPoseDim).setZero();
    window.prior.rows.J.middleRows<3>(one.motion(0)).setZero();
    // One interval of the IMU is used up by the velocities; the second tells where down is.
    marginalise_oldest(window, noise_of(true));
    marginalise_oldest(window, noise_of(true));
    const WindowLayout layout = window.layout();
    const Eigen::MatrixXd& J = window.prior.rows.J;
    Eigen::MatrixXd gauge = Eigen::MatrixXd::Zero(layout.size(), 4);
    for (int k = 0; k < layout.frames; ++k) {
      const FrameState& x = window.frames[static_cast<std::size_t>(k)].state;
      gauge.block<3, 3>(layout.at(k, kPosition), 0) = Mat3::Identity();
      gauge.block<3, 1>(layout.at(k, kRotation), 3) = x.R_OB.transpose() * Vec3::UnitZ();
      gauge.block<3, 1>(layout.at(k, kPosition), 3) = Vec3::UnitZ().cross(x.p_OB);
      gauge.block<3, 1>(layout.at(k, kVelocity), 3) = Vec3::UnitZ().cross(x.v_OB);
    }
    // Rounding is all that the prior says of what it does not know: the newest pose among it.
    std::vector<int> used;
    for (int i = 0; i < layout.size(); ++i) {
      if (J.col(i).norm() > 1) used.push_back(i);
    }
    EXPECT_EQ(used.size(), 2U * kPoseDim + kMotionDim + kCameraDim);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(J(Eigen::all, used));
    const Eigen::VectorXd s = svd.singularValues();
    EXPECT_LT((J * gauge).norm(), 1e-5 * s[0]);
    const auto known = static_cast<Eigen::Index>(used.size()) - 4;
    EXPECT_GE(s.size(), known);
    EXPECT_GT(s[known - 1], 0.1);  // the least known, in units of a radian or a metre
    for (Eigen::Index i = known; i < s.size(); ++i) EXPECT_LT(s[i], 1e-5 * s[0]);
  }
}

}  // namespace
}  // namespace arex
