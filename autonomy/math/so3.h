#pragma once

#include "math/types.h"

/// Rotations: exponential map, logarithm and Jacobians of SO(3).
/// Source: Sola et al., A micro Lie theory for state estimation in robotics, 2018, section IV.
namespace arex::so3 {

/// The cross-product matrix: hat(a) * b = a x b.
Mat3 hat(const Vec3& a);

/// Rotation matrix of a rotation vector (rad).
Mat3 Exp(const Vec3& phi);

/// Rotation vector (rad) of a rotation matrix, |phi| <= pi.
Vec3 Log(const Mat3& R);

/// Right Jacobian: Exp(phi + d) ~ Exp(phi) Exp(right_jacobian(phi) d). The transpose of the paper's
/// A(phi) is the left Jacobian; A(phi)^T = right_jacobian(phi) up to the paper's sign convention.
Mat3 right_jacobian(const Vec3& phi);

/// Inverse of the right Jacobian: Log(Exp(phi) Exp(d)) ~ phi + right_jacobian_inverse(phi) d.
Mat3 right_jacobian_inverse(const Vec3& phi);

/// Yaw of a rotation (rad, in (-pi, pi]): the heading of its x axis in the horizontal plane.
double yaw(const Mat3& R);

/// Rotation by an angle (rad) about z.
Mat3 from_yaw(double yaw_rad);

/// Angle of a rotation (rad, in [0, pi]).
double angle(const Mat3& R);

/// An angle wrapped to (-pi, pi].
double wrap(double angle_rad);

}  // namespace arex::so3
