#include "scoring/tour_order.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "math/random.h"

namespace arex::sim {
namespace {

using Order = std::vector<std::size_t>;

constexpr double kShorter_m = 1e-9;  // what rounding alone saves is no improvement

/// A tour that is made shorter step by step. Place 0 stays first.
class TourSearch {
 public:
  TourSearch(const Eigen::MatrixXd& distance, bool closed, Order order)
      : distance_(distance), closed_(closed), order_(std::move(order)) {}

  /// Down to where neither move helps.
  void descend() {
    while (reverse_stretch() || move_stretch()) {
    }
  }
  [[nodiscard]] const Order& order() const { return order_; }

 private:
  [[nodiscard]] double between(std::size_t a, std::size_t b) const {
    return distance_(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
  }
  /// From a place to what follows position `at`; nothing does at the end of an open tour.
  [[nodiscard]] double onwards(std::size_t place, std::size_t at) const {
    if (at + 1 < order_.size()) return between(place, order_[at + 1]);
    return closed_ ? between(place, order_[0]) : 0;
  }

  /// 2-opt, the first reversal that shortens the tour.
  bool reverse_stretch() {
    for (std::size_t i = 1; i < order_.size(); ++i) {
      for (std::size_t j = i + 1; j < order_.size(); ++j) {
        const double before = between(order_[i - 1], order_[i]) + onwards(order_[j], j);
        const double after = between(order_[i - 1], order_[j]) + onwards(order_[i], j);
        if (after > before - kShorter_m) continue;
        std::reverse(position(i), position(j + 1));
        return true;
      }
    }
    return false;
  }

  /// Or-opt, the first move of up to three places that shortens the tour.
  bool move_stretch() {
    constexpr std::size_t kLongest = 3;
    for (std::size_t length = 1; length <= kLongest; ++length) {
      for (std::size_t i = 1; i + length <= order_.size(); ++i) {
        if (move(i, i + length - 1)) return true;
      }
    }
    return false;
  }

  /// Moves the places at positions i to j behind the first other position where that helps.
  bool move(std::size_t i, std::size_t j) {
    const std::size_t first = order_[i], last = order_[j], before = order_[i - 1];
    const double freed = between(before, first) + onwards(last, j) - onwards(before, j);
    for (std::size_t k = 0; k < order_.size(); ++k) {
      if (k + 1 >= i && k <= j) continue;
      const double gap = onwards(order_[k], k);
      const double ahead = between(order_[k], first) + onwards(last, k) - gap;
      const double turned = between(order_[k], last) + onwards(first, k) - gap;
      if (std::min(ahead, turned) > freed - kShorter_m) continue;
      if (turned < ahead) std::reverse(position(i), position(j + 1));
      if (k < i) {
        std::rotate(position(k + 1), position(i), position(j + 1));
      } else {
        std::rotate(position(i), position(j + 1), position(k + 1));
      }
      return true;
    }
    return false;
  }

  Order::iterator position(std::size_t at) {
    return order_.begin() + static_cast<Order::difference_type>(at);
  }

  const Eigen::MatrixXd& distance_;
  bool closed_;
  Order order_;
};

Order nearest_neighbours(const Eigen::MatrixXd& distance) {
  Order order(static_cast<std::size_t>(distance.rows()));
  std::iota(order.begin(), order.end(), std::size_t{0});
  for (auto here = order.begin(); here + 1 < order.end(); ++here) {
    const auto away = [&](std::size_t place) {
      return distance(static_cast<Eigen::Index>(*here), static_cast<Eigen::Index>(place));
    };
    std::iter_swap(here + 1, std::min_element(here + 1, order.end(), [&](auto a, auto b) {
                     return away(a) < away(b) || (away(a) == away(b) && a < b);
                   }));
  }
  return order;
}

/// Three cuts behind place 0; the two stretches between them change places. No sequence of 2-opt
/// moves undoes that easily.
Order double_bridge(const Order& order, RandomStream& random) {
  std::array<int, 3> cut{};
  const int last = static_cast<int>(order.size());
  for (int& c : cut) c = random.uniform_int(1, last);
  std::sort(cut.begin(), cut.end());
  Order other = order;
  std::rotate(other.begin() + cut[0], other.begin() + cut[1], other.begin() + cut[2]);
  return other;
}

}  // namespace

double tour_length(const Eigen::MatrixXd& distance_m, const Order& order, bool closed) {
  double length = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i + 1 == order.size() && !closed) break;
    const std::size_t next = order[(i + 1) % order.size()];
    length += distance_m(static_cast<Eigen::Index>(order[i]), static_cast<Eigen::Index>(next));
  }
  return length;
}

Order order_tour(const Eigen::MatrixXd& distance_m, bool closed, int perturbations) {
  constexpr std::size_t kLeast = 4;  // below that there is nothing to exchange
  const auto descended = [&](Order order) {
    TourSearch search(distance_m, closed, std::move(order));
    search.descend();
    return search.order();
  };
  Order best = descended(nearest_neighbours(distance_m));
  if (best.size() < kLeast) return best;
  double least = tour_length(distance_m, best, closed);
  RandomStream random(0, "tour_order");
  for (int i = 0; i < perturbations; ++i) {
    Order other = descended(double_bridge(best, random));
    const double length = tour_length(distance_m, other, closed);
    if (length > least - kShorter_m) continue;
    least = length;
    best = std::move(other);
  }
  return best;
}

}  // namespace arex::sim
