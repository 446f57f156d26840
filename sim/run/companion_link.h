#pragma once

#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "autopilot/motor_model.h"
#include "run/interfaces.h"
#include "run/serial_line.h"
#include "stack/flight_software.h"

namespace arex::sim {

/// The flight software as the autopilot knows it: at the other end of a UART. What the autopilot
/// measures goes up, commands come down; what comes from other sensors does not pass here.
class CompanionLink : public FlightSoftware {
 public:
  /// @param motor, vehicle what companion and autopilot believe of full thrust
  CompanionLink(const InterfaceConfig& config, const MotorBelief& motor,
                const VehicleConfig& vehicle, std::unique_ptr<FlightSoftware> software,
                std::uint64_t seed);

  /// Whether a vehicle that is so connected differs from one without.
  [[nodiscard]] static bool is_needed(const InterfaceConfig& config) {
    return config.uart.enabled || config.command == InterfaceConfig::Command::kThrottle;
  }

  void begin(Stamp now) override;
  void add_imu(const ImuSample& imu) override;
  void add_autopilot(const AutopilotStatus& status) override;
  void add_battery(const BatterySample& battery) override;
  std::optional<AttitudeCommand> tick() override;

  void add_operator(const OperatorMessage& message) override { software_->add_operator(message); }
  void add_mocap(const MocapSample& mocap) override { software_->add_mocap(mocap); }
  void add_scan(const LidarScanPtr& scan) override { software_->add_scan(scan); }
  void add_depth(const DepthImagePtr& depth) override { software_->add_depth(depth); }
  void add_images(const StereoImagePtr& images) override { software_->add_images(images); }
  [[nodiscard]] bool accepts_depth(const std::string& device, Stamp stamp) override {
    return software_->accepts_depth(device, stamp);
  }
  std::vector<Event> take_events() override { return software_->take_events(); }
  std::vector<Decision> take_decisions() override { return software_->take_decisions(); }
  std::vector<FeatureSight> take_features() override { return software_->take_features(); }
  [[nodiscard]] MappedFrames mapped_frames() const override { return software_->mapped_frames(); }
  [[nodiscard]] FlightView view() const override { return software_->view(); }
  [[nodiscard]] std::vector<Vec3> planned_path() const override {
    return software_->planned_path();
  }
  void read_cloud(Stamp due, CloudReader reader) override {
    software_->read_cloud(due, std::move(reader));
  }
  [[nodiscard]] const PointCloudMap& cloud() const override { return software_->cloud(); }
  [[nodiscard]] const Mapper& mapper() const override { return software_->mapper(); }

 private:
  using Report = std::variant<ImuSample, AutopilotStatus, BatterySample>;

  void report(int bytes, const Report& what);
  void hand_on(const Report& what);
  /// As a share of full thrust, and back: what the companion takes for that, and what it is.
  [[nodiscard]] double throttle_of(double thrust_n) const;
  [[nodiscard]] double thrust_of(double throttle) const;

  InterfaceConfig config_;
  MotorModel motor_;
  double battery_v_;  ///< as the autopilot measures it
  std::unique_ptr<FlightSoftware> software_;
  SerialLine<Report> up_;
  SerialLine<AttitudeCommand> down_;
  Stamp now_ = 0;
};

}  // namespace arex::sim
