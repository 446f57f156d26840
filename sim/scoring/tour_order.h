#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace arex::sim {

/// In which order to visit places: the travelling salesman's problem, by local search.
///
/// Nearest neighbour from place 0, then 2-opt (a stretch flown backwards) and Or-opt (up to three
/// places moved elsewhere) until neither shortens the tour, then the same from copies of the best
/// tour with three edges exchanged at random, a fixed number of times. Not proven optimal; up to
/// eight places it is the optimum in nearly every case (tour_order_test asks brute force).
/// Source: Johnson and McGeoch, The traveling salesman problem: a case study in local optimization,
/// 1997; Martin, Otto and Felten, Large-step Markov chains for the TSP, 1991 (the double bridge).
///
/// @param distance_m symmetric, n x n with n >= 1, finite, between the places
/// @param closed back to place 0 at the end; false: it ends at whichever place is best
/// @param perturbations how often the best tour is disturbed and improved again
/// @return a permutation of 0 to n - 1 that begins with 0
std::vector<std::size_t> order_tour(const Eigen::MatrixXd& distance_m, bool closed,
                                    int perturbations);

/// Length of the tour in that order, m.
double tour_length(const Eigen::MatrixXd& distance_m, const std::vector<std::size_t>& order,
                   bool closed);

}  // namespace arex::sim
