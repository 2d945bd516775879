#include "firmware_sim/master/drive_configuration.h"

#include <fmt/format.h>

#include <array>
#include <stdexcept>
#include <string_view>

namespace mantle::firmware_sim {

namespace {

constexpr std::uint8_t kOnSync = 1;  // transmission type
constexpr std::size_t kMostMapped = 4;

// A mapped object as 16xx and 1Axx hold it: index, sub-index, length in bits.
constexpr std::uint32_t Mapped(std::uint16_t index, unsigned bits) {
  return (std::uint32_t{index} << 16U) | bits;
}

struct PdoPlan {
  std::uint16_t communication;
  std::uint16_t mapping;
  std::uint32_t cob_base;
  bool receive;
  std::array<std::uint32_t, kMostMapped> mapped;  // ends with the first 0
};

constexpr std::array<PdoPlan, 4> kPlans{{
    {object::kRpdo1,
     object::kRpdo1Mapping,
     CobRpdo1(0),
     true,
     {Mapped(object::kControlword, 16), Mapped(object::kTargetTorque, 16),
      Mapped(object::kTargetPosition, 32), 0}},
    {object::kTpdo1,
     object::kTpdo1Mapping,
     CobTpdo1(0),
     false,
     {Mapped(object::kStatusword, 16), Mapped(object::kTorqueActual, 16),
      Mapped(object::kPositionActual, 32), 0}},
    {object::kRpdo2,
     object::kRpdo2Mapping,
     CobRpdo2(0),
     true,
     {Mapped(object::kTargetVelocity, 32), Mapped(object::kTorqueOffset, 16),
      Mapped(object::kMode, 8), 0}},
    {object::kTpdo2,
     object::kTpdo2Mapping,
     CobTpdo2(0),
     false,
     {Mapped(object::kVelocityActual, 32), Mapped(object::kCurrentActual, 16),
      Mapped(object::kModeDisplay, 8), Mapped(object::kTemperature, 8)}},
}};

class StepFinder {
 public:
  explicit StepFinder(std::size_t step) : left_(step) {}
  void Offer(std::uint16_t index, int sub, std::uint8_t size, std::uint32_t value) {
    if (left_-- == 0) {
      found_ = SdoWrite{{index, static_cast<std::uint8_t>(sub)}, size, value};
    }
  }
  const std::optional<SdoWrite>& found() const { return found_; }

 private:
  std::size_t left_;
  std::optional<SdoWrite> found_;
};

void OfferPdo(const PdoPlan& plan, const DriveSettings& settings, NodeId node, bool used,
              StepFinder& finder) {
  const std::uint32_t cob_id = (plan.receive ? 0U : kPdoNoRtr) | (plan.cob_base + node);
  finder.Offer(plan.communication, 1, 4, cob_id | kPdoInvalid);
  if (!used) return;
  finder.Offer(plan.mapping, 0, 1, 0);
  int count = 0;
  for (const std::uint32_t mapped : plan.mapped) {
    if (mapped != 0) finder.Offer(plan.mapping, ++count, 4, mapped);
  }
  finder.Offer(plan.mapping, 0, 1, static_cast<std::uint32_t>(count));
  finder.Offer(plan.communication, 2, 1, kOnSync);
  if (plan.receive) {
    finder.Offer(plan.communication, 5, 2,
                 static_cast<std::uint32_t>(settings.rpdo_timeout_us / 1000));
  }
  finder.Offer(plan.communication, 1, 4, cob_id);
}

void Check(std::string_view name, std::int64_t value, std::int64_t low, std::int64_t high,
           std::string_view unit) {
  if (value < low || value > high) {
    throw std::invalid_argument(
        fmt::format("master: {} is {} {}, must be {} to {}", name, value, unit, low, high));
  }
}

}  // namespace

void CheckSettings(const DriveSettings& settings) {
  Check("period", settings.period_us, 1000, 255'000, "us");
  Check("master heartbeat", settings.master_heartbeat_us, 1000, 10'000'000, "us");
  // Two heartbeats may be lost before the drives give up.
  Check("master silence", settings.master_silence_us, 3 * settings.master_heartbeat_us, 65'535'000,
        "us");
  Check("drive heartbeat", settings.drive_heartbeat_us, 1000, 65'535'000, "us");
  Check("RPDO time-out", settings.rpdo_timeout_us, 2 * settings.period_us, 65'535'000, "us");
  Check("torque slope", settings.torque_slope_permille_s, 1, UINT32_MAX, "1/1000 per s");
  Check("maximal torque", settings.max_torque_permille, 0, 2000, "1/1000");
  Check("largest position", settings.max_position_counts, settings.min_position_counts, INT32_MAX,
        "counts");
}

std::optional<SdoWrite> ConfigurationStep(const DriveSettings& settings, NodeId node,
                                          std::size_t step) {
  StepFinder finder(step);
  for (std::size_t i = 0; i < kPlans.size(); ++i) {
    OfferPdo(kPlans[i], settings, node, i < 2 || settings.second_pdos, finder);
  }
  const auto milliseconds = [](std::int64_t time_us) {
    return static_cast<std::uint32_t>((time_us + 999) / 1000);
  };
  finder.Offer(object::kConsumerHeartbeat, 1, 4,
               (std::uint32_t{kMasterNode} << 16U) | milliseconds(settings.master_silence_us));
  finder.Offer(object::kProducerHeartbeat, 0, 2, milliseconds(settings.drive_heartbeat_us));
  finder.Offer(object::kInterpolationPeriod, 1, 1, milliseconds(settings.period_us));
  finder.Offer(object::kInterpolationPeriod, 2, 1, 0xFD);  // 10^-3 s
  finder.Offer(object::kTorqueSlope, 0, 4, settings.torque_slope_permille_s);
  finder.Offer(object::kMaxTorque, 0, 2, settings.max_torque_permille);
  finder.Offer(object::kPositionLimits, 1, 4,
               static_cast<std::uint32_t>(settings.min_position_counts));
  finder.Offer(object::kPositionLimits, 2, 4,
               static_cast<std::uint32_t>(settings.max_position_counts));
  finder.Offer(object::kFollowingErrorWindow, 0, 4, settings.following_error_counts);
  finder.Offer(object::kMode, 0, 1, static_cast<std::uint8_t>(settings.mode));
  return finder.found();
}

}  // namespace mantle::firmware_sim
