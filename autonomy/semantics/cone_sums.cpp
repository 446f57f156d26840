#include "semantics/cone_sums.h"

namespace arex {

ConePoints::ConePoints(std::span<const Vec3> points, const Vec2& about) : about_(about) {
  const auto n = static_cast<Eigen::Index>(points.size());
  for (Column* column : {&x_, &y_, &h_}) column->resize(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Vec3& p = points[static_cast<std::size_t>(i)];
    x_[i] = static_cast<float>(p.x() - about.x());
    y_[i] = static_cast<float>(p.y() - about.y());
    h_[i] = static_cast<float>(p.z() - kBreastHeight);
  }
  hh_ = h_.square();
}

ConeSums ConePoints::sums(const Stem& stem, double scale, double sigma, double most) const {
  constexpr float kLeast = 1e-6F;  // m: on the axis no direction leads out
  const Eigen::Vector2f centre = (stem.centre - about_).cast<float>(),
                        lean = stem.lean.cast<float>();
  const auto radius = static_cast<float>(stem.radius), taper = static_cast<float>(stem.taper);
  out_x_ = x_ - centre.x() - lean.x() * h_;
  out_y_ = y_ - centre.y() - lean.y() * h_;
  product_ = (out_x_.square() + out_y_.square()).sqrt();
  distance_ = product_ - radius + taper * h_;
  weight_ =
      (distance_.abs() <= static_cast<float>(most) && product_ >= kLeast)
          .select((1 + (distance_ * static_cast<float>(1 / scale)).square()).square().inverse() *
                      static_cast<float>(1 / (sigma * sigma)),
                  0.0F);
  product_ = product_.max(kLeast).inverse();
  out_x_ *= product_;
  out_y_ *= product_;

  // Of every product in the sums, its sums with the powers of the height.
  const auto moments = [&] {
    return Vec3(static_cast<double>(product_.sum()), static_cast<double>((product_ * h_).sum()),
                static_cast<double>((product_ * hh_).sum()));
  };
  ConeSums out;
  Mat6& A = out.A;
  A.setZero();
  const auto place = [&](Eigen::Index i, Eigen::Index j, const Vec3& m) {
    A(j, i) = m[0];
    A(j + 2, i) = A(i + 2, j) = m[1];
    A(j + 2, i + 2) = m[2];
  };
  product_ = weight_ * out_x_ * out_y_;
  place(0, 1, moments());
  product_ = weight_ * out_x_.square();
  place(0, 0, moments());
  product_ = weight_ * out_y_.square();
  place(1, 1, moments());
  const auto place_size = [&](Eigen::Index i, const Vec3& m) {
    A(4, i) = m[0];
    A(5, i) = -m[1];
    A(4, i + 2) = m[1];
    A(5, i + 2) = -m[2];
  };
  product_ = weight_ * out_x_;
  place_size(0, moments());
  product_ = weight_ * out_y_;
  place_size(1, moments());
  product_ = weight_;
  const Vec3 plain = moments();
  A(4, 4) = plain[0];
  A(5, 4) = -plain[1];
  A(5, 5) = plain[2];

  weight_ *= distance_;
  product_ = weight_ * out_x_;
  const Vec3 off_x = moments();
  product_ = weight_ * out_y_;
  const Vec3 off_y = moments();
  product_ = weight_;
  const Vec3 off = moments();
  out.b << off_x[0], off_y[0], off_x[1], off_y[1], off[0], -off[1];
  return out;
}

}  // namespace arex
