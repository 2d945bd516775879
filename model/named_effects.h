#pragma once

#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

#include "model/effects/magnetic_field.h"
#include "model/effects/rigid_drag.h"
#include "model/effects/roll_drag.h"
#include "model/effects/viscous_drag.h"

/// @file
/// The effects that stand in a file of their own, model/effects/NAME.h: what a scene says of it,
/// how that is read, and its loads. A new one needs its file, its name in NamedEffects below, and a
/// test (tests/model/NAME_test.cc); plant, statics, modes, energies, reduced model, summaries, the
/// scene's reference and editors' schema then have it. Its type, with defaults for its settings,
/// has
///
///   kName              its key below `effects`
///   kOnVelocity        whether its loads depend on velocity (vibration modes are without)
///   kWithoutPotential  where its loads have no potential: why, as "effects.NAME WHY" reads; or
///   null Read(v, effect)    reads it from a scene (model/schema.h); absent, it stays empty
///   Check(v, e, bodies)    where there is something to refuse for these bodies
///   SectionLoad        on arms' sections (model/loads.h), from From(e, arm, water)
///   RootLoad           on the root (model/root_loads.h), from From(e, bodies)
///
/// of the last three those that it needs.

namespace mantle::model {

template <typename Effect, typename = void>
struct SectionLoadOf {
  using type = std::tuple<>;  ///< none
};
template <typename Effect>
struct SectionLoadOf<Effect, std::void_t<typename Effect::SectionLoad>> {
  using type = std::tuple<typename Effect::SectionLoad>;  ///< its own
};
template <typename Effect, typename = void>
struct RootLoadOf {
  using type = std::tuple<>;  ///< none
};
template <typename Effect>
struct RootLoadOf<Effect, std::void_t<typename Effect::RootLoad>> {
  using type = std::tuple<typename Effect::RootLoad>;  ///< its own
};

/// Of each type at most one, absent where a scene does not name it.
template <typename... Effect>
class EffectList {
  template <typename... T>
  static std::variant<T...> VariantOf(std::tuple<T...>);

 public:
  template <typename T>
  std::optional<T>& Get() {
    return std::get<std::optional<T>>(effects_);
  }
  template <typename T>
  const std::optional<T>& Get() const {
    return std::get<std::optional<T>>(effects_);
  }
  template <typename T>
  void Set(T effect) {
    Get<T>() = std::move(effect);
  }
  /// `visit(std::optional<T>&)` for every type in turn.
  template <typename Visit>
  void ForEach(Visit&& visit) {
    std::apply([&](auto&... effect) { (visit(effect), ...); }, effects_);
  }
  template <typename Visit>
  void ForEach(Visit&& visit) const {
    std::apply([&](const auto&... effect) { (visit(effect), ...); }, effects_);
  }

  /// One of `Own`, or a load of one of the effects on a section.
  template <typename... Own>
  using SectionLoads =
      decltype(VariantOf(std::tuple_cat(std::declval<std::tuple<Own...>>(),
                                        std::declval<typename SectionLoadOf<Effect>::type>()...)));
  /// One of `Own`, or a load of one of the effects on the root.
  template <typename... Own>
  using RootLoads = decltype(VariantOf(std::tuple_cat(
      std::declval<std::tuple<Own...>>(), std::declval<typename RootLoadOf<Effect>::type>()...)));

 private:
  std::tuple<std::optional<Effect>...> effects_;
};

/// The effect's type, of what EffectList::ForEach visits.
template <typename Visited>
using EffectType = typename std::remove_cvref_t<Visited>::value_type;

using NamedEffects = EffectList<RollDrag, RigidDrag, MagneticField, ViscousDrag>;

}  // namespace mantle::model
