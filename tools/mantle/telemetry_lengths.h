#pragma once

#include <cstdint>
#include <span>

#include "tools/mantle/telemetry.h"

/// Whether the counts and lengths in an encoded message fit into it: to be known before the
/// generated decoder allocates what they claim. One walk per .lcm file, in its order, over what LCM
/// puts on the wire: big-endian numbers, a text as its length (4 bytes, the zero byte at its end
/// included) and its bytes.

namespace mantle::tools {

/// `bytes` begin behind the fingerprint of the type. True where the message ends exactly with them.
template <typename Message>
bool LengthsFit(std::span<const std::uint8_t> bytes);

template <>
bool LengthsFit<StateTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<ReducedStateTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<PlanTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<DrivesTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<EnergyTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<StatusTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<ShapeTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<ControlTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<WaterTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<SessionTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<SensorsTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<CommandTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<CycleTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<StepTelemetry>(std::span<const std::uint8_t> bytes);
template <>
bool LengthsFit<SteppedTelemetry>(std::span<const std::uint8_t> bytes);

}  // namespace mantle::tools
