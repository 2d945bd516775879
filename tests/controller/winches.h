#pragma once

#include "controller/winch_map.h"

namespace mantle::controller {

/// A small winch: 1.25 mm per motor radian, 3 mN m rated.
inline WinchMap SmallWinch() {
  WinchMap map;
  map.metres_per_rad = 1.25e-3;
  map.metres_per_count = 3.835e-6;
  map.gear_efficiency = 0.9;
  map.friction_torque_nm = 0.08e-3;
  map.stiction_ratio = 1.3;
  map.inertia_kgm2 = 5.7e-8;
  map.permille_nm = 3e-6;
  return map;
}

}  // namespace mantle::controller
