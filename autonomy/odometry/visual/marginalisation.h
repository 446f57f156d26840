#pragma once

#include <vector>

#include "odometry/visual/window.h"

/// Forgetting frames without forgetting what they said, and without counting anything twice: what
/// goes into the prior is taken out of the window, landmarks' sights included.
namespace arex {

/// The least-squares rows that remain on the `kept` unknowns when the sum is minimised over the
/// `gone` ones: QR, so that nothing is squared. Columns of `kept` stay in their order.
/// @param gone, kept columns of `rows`
[[nodiscard]] LinearRows eliminate(const LinearRows& rows, const std::vector<int>& gone,
                                   const std::vector<int>& kept);

/// Rows with J'J = H and J'r = g, by eigenvectors; directions without information are left out.
/// @param H symmetric, positive semidefinite
[[nodiscard]] LinearRows square_root(const Eigen::MatrixXd& H, const Eigen::VectorXd& g);

/// Takes the oldest frame out of the window and leaves in the prior what it and the landmarks
/// anchored in it said. A landmark used this way starts afresh from its sight in the newest frame,
/// which was not.
/// @pre two frames or more
void marginalise_oldest(Window& window, const WindowNoise& noise);

/// Takes the newest frame out of the window with all that it saw; its readings of the IMU are
/// returned, for whoever joins them to the next frame's.
/// @pre the prior does not know it
Preintegration drop_newest(Window& window);

}  // namespace arex
