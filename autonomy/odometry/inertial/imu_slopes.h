#pragma once

#include <span>
#include <vector>

#include "odometry/inertial/navigation_state.h"
#include "odometry/inertial/standstill.h"

namespace arex {

/// Tells the intervals of one prediction how the readings change over them, which is what an error
/// of the IMU's delay costs there (ImuInterval::gyro_slope and its like).
///
/// It is the change of the level, the mean of the readings about an instant, from the intervals'
/// begin to their end. From one prediction to the next levels telescope: what the slopes have added
/// up to is the vehicle's rate now, and not a sum of errors. And they keep apart from what the
/// scans are compared with. A mean of readings over a time errs by the difference of the angles by
/// which the IMU is shaken at its two ends; a scan, whose points come all along that time, errs by
/// the mean of the angles between. The two are not correlated. The slope of a straight line through
/// the readings is, with the mean of the angles, and drew the delay by milliseconds in the first
/// second of a flight.
///
/// A slope that is noise itself would let an estimate believe that it had seen no delay: it is left
/// out in proportion, and what is unknown of it told.
///
/// @param intervals of imu_intervals() with the same samples, scale and delay
/// @param window over which a level is averaged; less where readings are wanting
/// @param shaking of the IMU
void add_slopes(std::vector<ImuInterval>& intervals, std::span<const ImuSample> samples,
                double accel_scale, double delay_s, Stamp window, const WhiteNoise& shaking);

}  // namespace arex
