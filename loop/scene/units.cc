#include "loop/scene/units.h"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <numbers>
#include <span>

namespace mantle::scene {
namespace {

struct Unit {
  std::string_view name;
  double si;
};

constexpr double kDegree = std::numbers::pi / 180.0;

constexpr std::array kLengths = {Unit{"m", 1}, Unit{"mm", 1e-3}, Unit{"cm", 1e-2}};
constexpr std::array kTimes = {Unit{"s", 1}, Unit{"ms", 1e-3}, Unit{"us", 1e-6}, Unit{"min", 60}};
constexpr std::array kMasses = {Unit{"kg", 1}, Unit{"g", 1e-3}};
constexpr std::array kAngles = {Unit{"rad", 1}, Unit{"deg", kDegree}};
constexpr std::array kForces = {Unit{"N", 1}, Unit{"mN", 1e-3}, Unit{"kN", 1e3}};
constexpr std::array kMoments = {Unit{"N m", 1}, Unit{"mN m", 1e-3}, Unit{"kN m", 1e3}};
constexpr std::array kForcesPerLength = {Unit{"N/m", 1}, Unit{"mN/m", 1e-3}, Unit{"kN/m", 1e3}};
constexpr std::array kMomentsPerLength = {Unit{"N m/m", 1}, Unit{"mN m/m", 1e-3}};
constexpr std::array kPressures = {Unit{"Pa", 1}, Unit{"kPa", 1e3}, Unit{"MPa", 1e6},
                                   Unit{"GPa", 1e9}};
constexpr std::array kViscosities = {Unit{"Pa s", 1}, Unit{"kPa s", 1e3}};
constexpr std::array kDensities = {Unit{"kg/m^3", 1}, Unit{"g/cm^3", 1e3}};
constexpr std::array kSpeeds = {Unit{"m/s", 1}, Unit{"mm/s", 1e-3}, Unit{"cm/s", 1e-2}};
constexpr std::array kAngularSpeeds = {Unit{"rad/s", 1}, Unit{"deg/s", kDegree}};
constexpr std::array kAccelerations = {Unit{"m/s^2", 1}};
constexpr std::array kFrequencies = {Unit{"Hz", 1}, Unit{"kHz", 1e3}};
constexpr std::array kCurvatures = {Unit{"1/m", 1}, Unit{"rad/m", 1}, Unit{"deg/m", kDegree}};
constexpr std::array kStiffnesses = {Unit{"N/m", 1}, Unit{"kN/m", 1e3}, Unit{"N/mm", 1e3}};
constexpr std::array kDampings = {Unit{"N s/m", 1}};
constexpr std::array kAreas = {Unit{"m^2", 1}, Unit{"cm^2", 1e-4}, Unit{"mm^2", 1e-6}};
constexpr std::array kVolumes = {Unit{"m^3", 1}, Unit{"L", 1e-3}, Unit{"mL", 1e-6},
                                 Unit{"cm^3", 1e-6}};
constexpr std::array kInertias = {Unit{"kg m^2", 1}, Unit{"g mm^2", 1e-9}};
constexpr std::array kRollDrags = {Unit{"N m s^2", 1}};
// The six entries of a diagonal have two units: they are given as plain numbers.
constexpr std::array kSectionStiffnesses = {Unit{"N m^2 (three), N (three)", 0}};
constexpr std::array kSectionDampings = {Unit{"N m^2 s (three), N s (three)", 0}};
constexpr std::array kSectionInertias = {Unit{"kg m (three), kg/m (three)", 0}};

std::span<const Unit> Units(Quantity quantity) {
  switch (quantity) {
    case Quantity::kNumber:
      return {};
    case Quantity::kLength:
      return kLengths;
    case Quantity::kTime:
      return kTimes;
    case Quantity::kMass:
      return kMasses;
    case Quantity::kAngle:
      return kAngles;
    case Quantity::kForce:
      return kForces;
    case Quantity::kMoment:
      return kMoments;
    case Quantity::kForcePerLength:
      return kForcesPerLength;
    case Quantity::kMomentPerLength:
      return kMomentsPerLength;
    case Quantity::kPressure:
      return kPressures;
    case Quantity::kViscosity:
      return kViscosities;
    case Quantity::kDensity:
      return kDensities;
    case Quantity::kSpeed:
      return kSpeeds;
    case Quantity::kAngularSpeed:
      return kAngularSpeeds;
    case Quantity::kAcceleration:
      return kAccelerations;
    case Quantity::kFrequency:
      return kFrequencies;
    case Quantity::kCurvature:
      return kCurvatures;
    case Quantity::kStiffness:
      return kStiffnesses;
    case Quantity::kDamping:
      return kDampings;
    case Quantity::kArea:
      return kAreas;
    case Quantity::kVolume:
      return kVolumes;
    case Quantity::kInertia:
      return kInertias;
    case Quantity::kRollDrag:
      return kRollDrags;
    case Quantity::kSectionStiffness:
      return kSectionStiffnesses;
    case Quantity::kSectionDamping:
      return kSectionDampings;
    case Quantity::kSectionInertia:
      return kSectionInertias;
  }
  return {};
}

}  // namespace

std::string_view SiUnit(Quantity quantity) {
  const auto units = Units(quantity);
  return units.empty() ? std::string_view{} : units.front().name;
}

std::string UnitsOf(Quantity quantity) {
  std::string out;
  for (const Unit& unit : Units(quantity)) {
    if (!out.empty()) out += ", ";
    out += unit.name;
  }
  return out;
}

std::string BoundText(schema::Range range) {
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  if (low && high)
    return fmt::format("in {}{}, {}]", range.low_open ? '(' : '[', range.low, range.high);
  if (low) return fmt::format("{} {}", range.low_open ? ">" : ">=", range.low);
  return high ? fmt::format("<= {}", range.high) : "";
}

std::optional<double> ParseQuantity(std::string_view text, Quantity quantity) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [after, error] = std::from_chars(text.data(), end, value);
  if (error != std::errc()) return std::nullopt;
  std::string_view name(after, static_cast<std::size_t>(end - after));
  while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
  while (!name.empty() && name.back() == ' ') name.remove_suffix(1);
  for (const Unit& unit : Units(quantity)) {
    if (unit.name == name && unit.si != 0) return value * unit.si;
  }
  return std::nullopt;
}

}  // namespace mantle::scene
